// How many edges a search for candidates has met, and what it has left out.
#pragma once

#include <cstdint>

namespace edgegrad {

struct EdgeCounts {
    int64_t of = 0;     // edges of all visible meshes
    int64_t kept = 0;   // candidates; edges of instanced meshes count once
    int64_t flat = 0;   // left out: between two faces of one plane where nothing jumps
    int64_t seams = 0;  // kept though flat: normals or attributes jump there
    int64_t still = 0;  // left out: of meshes that stand still

    void add(const EdgeCounts& c) { kept += c.kept, flat += c.flat, seams += c.seams; }
};

}  // namespace edgegrad
