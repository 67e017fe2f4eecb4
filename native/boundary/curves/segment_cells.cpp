#include "boundary/curves/segment_cells.h"

#include <algorithm>
#include <cmath>

namespace edgegrad {
namespace {

// The largest number of direction cells along each axis.
constexpr double kMostDirections = 16.0;
// The largest number of picture cells along each side.
constexpr double kMostPlaces = 512.0;
// The largest number of parts of an edge: positions are floats and cannot resolve more.
constexpr double kMostParts = 1 << 20;

}  // namespace

Candidates cut(const Candidates& edges, int32_t direction_cells, bool chains, const Borders& borders) {
    Candidates out;
    out.direction_cells = direction_cells;
    const int32_t n = direction_cells, kinds = chains ? 2 : 1;
    std::vector<float> u;
    const size_t least = edges.edge.size() * static_cast<size_t>(n * n * kinds);
    out.edge.reserve(least), out.u0.reserve(least), out.u1.reserve(least), out.cell.reserve(least);
    out.cumulative.reserve(least + 1);
    for (int32_t kind = 0; kind < kinds; ++kind) {
        const double share = share_of_mass(chains, kind != 0);
        for (size_t i = 0; i < edges.edge.size(); ++i) {
            const double mass = share * (edges.cumulative[i + 1] - edges.cumulative[i]);
            // A part whose length rounds to zero gets the average weight.
            const double length = std::max(static_cast<double>(edges.u1[i] - edges.u0[i]), 1e-30);
            u.clear();
            borders(i, u);
            const auto parts = static_cast<double>(u.size() - 1);
            for (size_t part = 0; part + 1 < u.size(); ++part) {
                const double here = static_cast<double>(u[part + 1] - u[part]) / length;
                const double each = mass * (here > 0.0 ? here : 1.0 / parts) / (n * n);
                for (int32_t row = 0; row < n; ++row) {
                    for (int32_t column = 0; column < n; ++column) {
                        out.add(edges.edge[i], u[part], u[part + 1], each);
                        if (!edges.instance.empty()) out.instance.push_back(edges.instance[i]);
                        // Alternate the direction of rows, so that consecutive cells are neighbours.
                        const int32_t place = row % 2 ? n - 1 - column : column;
                        out.cell.emplace_back(row * n + place, kind != 0);
                    }
                }
            }
        }
    }
    return out;
}

Candidates whole_picture() {
    Candidates out;
    out.add(0, 0.0f, 1.0f, 1.0);
    return out;
}

namespace {

// Candidates whose segments have all cells of directions (Candidates::parts). `chains` appends a second copy
// for receivers that the camera sees through other surfaces.
template <typename Parts>
Candidates with_cells(const Candidates& edges, int32_t direction_cells, bool chains, const Parts& parts_of) {
    Candidates out;
    out.direction_cells = direction_cells;
    double before = 0.0;
    for (int32_t kind = 0; kind < (chains ? 2 : 1); ++kind) {
        const double share = share_of_mass(chains, kind != 0);
        const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
        append(out.edge, edges.edge), append(out.instance, edges.instance);
        append(out.u0, edges.u0), append(out.u1, edges.u1);
        out.cell.resize(out.edge.size(), SegmentCell(0, kind != 0));
        for (size_t i = 0; i < edges.edge.size(); ++i) {
            out.parts.push_back(parts_of(i));
            out.cumulative.push_back(before + share * edges.cumulative[i + 1]);
        }
        before = out.mass();
    }
    return out;
}

}  // namespace

Candidates over_picture(double requested, bool chains) {
    const auto n = static_cast<int32_t>(std::clamp(std::sqrt(requested), 1.0, kMostPlaces));
    return with_cells(whole_picture(), n, chains, [](size_t) { return 1; });
}

Candidates over_directions(const Candidates& edges, double requested, bool chains) {
    if (edges.size() == 0) return {};
    // Prefer many direction cells: occlusion at an edge varies more with direction than along the edge.
    const double each = std::max(1.0, requested / static_cast<double>(edges.size()));
    const auto n = static_cast<int32_t>(std::clamp(std::floor(std::sqrt(each)), 1.0, kMostDirections));
    const double segments = std::max(1.0, requested / (n * n));
    return with_cells(edges, n, chains, [&](size_t i) {
        const double mass = edges.cumulative[i + 1] - edges.cumulative[i];
        return static_cast<int32_t>(
            std::min(std::max(1.0, std::round(segments * mass / edges.mass())), kMostParts));
    });
}

}  // namespace edgegrad
