#include "boundary/boundary_plan.h"

#include <algorithm>
#include <cmath>

namespace edgegrad {
namespace {

// Of all samples, those of the first pass; and what its estimate counts for beside the second's, which has
// less variance per sample.
constexpr double kFirst = 0.25;
constexpr float kFirstWeight = 0.1f;
constexpr int64_t kMostShares = int64_t{1} << 20;
// Of the second pass, the part that goes to all shares alike: a share may be worth more than its one sample
// says.
constexpr double kAlike = 0.2;
// A share counts at most for so many of mean size: a single large sample says little.
constexpr double kLargest = 16.0;
// Of its samples, the least part that is taken where the first pass found nothing.
constexpr double kLeast = 0.1;

}  // namespace

BoundaryPlan::BoundaryPlan(Candidates candidates, double wanted, double most, const RenderOptions& options,
                           bool environment, bool guided)
    : candidates_(std::move(candidates)), options_(options), environment_(environment), guided_(guided) {
    const double all = candidates_.size() == 0 ? 0.0 : std::ceil(std::min(wanted, most));
    total_[0] = static_cast<int64_t>(all);
    if (!guided_ || total_[0] == 0) return;
    total_[0] = std::min(kMostShares, static_cast<int64_t>(std::ceil(kFirst * all)));
    total_[1] = std::max<int64_t>(1, static_cast<int64_t>(all) - total_[0]);
    score_.assign(static_cast<size_t>(total_[0]), 0.0f);
}

void BoundaryPlan::guide() {
    const size_t shares = score_.size();
    double sum = 0.0, found = 0.0;
    for (float s : score_) sum += static_cast<double>(s), found += s > 0.0f;
    const double mean = sum / static_cast<double>(shares);
    guide_.assign(1, 0.0);
    for (size_t k = 0; k < shares; ++k) {
        // Neighbours on the list are neighbours in the picture.
        const size_t before = k > 0 ? k - 1 : k, behind = k + 1 < shares ? k + 1 : k;
        const double size = 0.25 * static_cast<double>(score_[before] + score_[behind]) +
                            0.5 * static_cast<double>(score_[k]);
        const double relative = mean > 0.0 ? std::min(size / mean, kLargest) : 1.0;
        guide_.push_back(guide_.back() + kAlike + (1.0 - kAlike) * relative);
    }
    // What was found to be empty needs few samples more.
    const double part = std::clamp(kLeast + found / static_cast<double>(shares), kLeast, 1.0);
    total_[1] = std::max<int64_t>(1, static_cast<int64_t>(std::ceil(part * static_cast<double>(total_[1]))));
}

BoundaryTask BoundaryPlan::task(int pass, int64_t first, int64_t count) {
    BoundaryTask t{};
    t.edge = candidates_.edge.data();
    t.instance = candidates_.instance.empty() ? nullptr : candidates_.instance.data();
    t.u0 = candidates_.u0.data();
    t.u1 = candidates_.u1.data();
    t.cumulative = candidates_.cumulative.data();
    t.pieces = candidates_.size();
    t.first = first;
    t.count = count;
    t.total = total_[pass];
    t.max_depth = options_.max_depth;
    t.seed = options_.seed ^ (pass == 0 ? 0u : 0x3c6ef372u);
    t.environment = environment_;
    t.limits = options_.limits;
    t.guide = pass == 0 ? nullptr : guide_.data();
    t.shares = guided_ ? total_[0] : 1;
    t.scale = !guided_ ? 1.0f : pass == 0 ? kFirstWeight : 1.0f - kFirstWeight;
    t.score = guided_ && pass == 0 ? score_.data() : nullptr;
    return t;
}

}  // namespace edgegrad
