// The candidate edges of a boundary term: one search finds them, and later calls take them from the cache.
// And how many samples and cells they get.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>

#include "boundary/curves/candidates.h"
#include "boundary/curves/edge_cache.h"
#include "boundary/samples/edge_reach.h"

namespace edgegrad {

using SharedCandidates = std::shared_ptr<const Candidates>;
inline SharedCandidates shared(SharedCandidates known) { return known; }
inline SharedCandidates shared(Candidates made) {
    return std::make_shared<const Candidates>(std::move(made));
}

// The candidates of a search. Those of instances of very many edges are listed by themselves
// (EdgeList::windows).
struct FoundEdges {
    SharedCandidates whole, windows;  // `windows` may be null
    double factor = 1.0;              // of estimates from `windows`
    bool by_reach = false;            // weighted by their reach

    double mass_of_windows() const { return windows ? factor * windows->mass() : 0.0; }
    double mass() const { return whole->mass() + mass_of_windows(); }
    int64_t size() const { return whole->size() + (windows ? windows->size() : 0); }
    EdgeCounts counts() const {
        EdgeCounts out = whole->counts;
        if (windows) out.add(windows->counts);
        return out;
    }
    // Calls visit(candidates, their part of the samples, factor) for each list.
    template <typename Visit>
    void each(const Visit& visit) const {
        if (!windows) return visit(whole, 1.0, 1.0);
        const double part = mass() > 0.0 ? mass_of_windows() / mass() : 0.0;
        if (part < 1.0) visit(whole, 1.0 - part, 1.0);
        if (part > 0.0) visit(windows, part, factor);
    }
};

// The same edges, with weights by how much of the light that passes them reaches what is seen: light in all
// directions, or, if `of_lights`, that of the list of lights.
inline FoundEdges weighted(const EdgeReach& reach, const SceneView& scene, const EdgeList& edges,
                           const FoundEdges& found, bool of_lights) {
    const auto weighted = [&](const SharedCandidates& list) {
        if (!list) return list;
        return shared(of_lights ? reach.weighted_for_lights(scene, edges, *list)
                                : reach.weighted(scene, edges, *list));
    };
    return {weighted(found.whole), weighted(found.windows), found.factor, true};
}

// The candidates that search(edges) finds, which are kept if they are complete.
template <typename Key, typename Search>
FoundEdges searched(const EdgeList& edges, bool in_windows, Kept<Key, Candidates>& kept,
                    const std::type_identity_t<Key>& key, const Search& search) {
    if (in_windows) {
        EdgeList part = edges;
        part.part = EdgeList::kWhole;
        SharedCandidates whole = shared(search(part));
        part.part = EdgeList::kWindows;
        return {std::move(whole), shared(search(part)), static_cast<double>(edges.windows)};
    }
    if (!edges.counts_alone) return {kept.get(key, [&] { return search(edges); }), nullptr};
    const SharedCandidates known = kept.find(key);
    return {known ? known : shared(search(edges)), nullptr};
}

// The part of the samples along edges that are weighted by their reach, of shadows and of light between
// surfaces: more of them reach the picture, which takes time.
constexpr double kReachingShadows = 0.6, kReachingLight = 0.8;

// Number of cells with learned sample weights: per sample, and at most.
inline double learned_cells(double samples) { return std::min(0.06 * samples, 262'144.0); }

// Fewest samples of the primary term per pixel and sample of the picture: in general, and for so many edges
// that samples hit them at random. Along few edges, the error of systematic samples falls faster than that of
// random ones.
constexpr double kLeastPrimary = 0.15, kLeastScattered = 0.09;

// The fraction of the samples that is taken if there are fewer samples than segments (for directions towards
// light: fewer than a few per segment). Samples then hit segments at random, and seconds x variance hardly
// depends on their number. With few segments it falls with the number of samples.
constexpr double kSamplesTowardsLight = 32.0, kLeastPart = 0.25;
inline double scattered(int64_t segments, double each, double samples) {
    return std::clamp(samples / (each * static_cast<double>(std::max<int64_t>(1, segments))), kLeastPart,
                      1.0);
}

}  // namespace edgegrad
