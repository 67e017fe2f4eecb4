#include "engine/decisions/missing/missing_parts.h"

#include "engine/decisions/missing/missing_search.h"

namespace edgegrad {

void note_missing(const BoundaryFacts& facts, const Requested& requested, const std::vector<uint8_t>& closed,
                  int threads, Decisions& decided) {
    const MissingSearch search(facts, requested, closed, threads, decided);
    miss_seen_parts(search);
    decided.found_parting(facts, requested, threads);
    miss_lit_parts(search);
    miss_field_parts(search);
    miss_mirrored_parts(search);
}

}  // namespace edgegrad
