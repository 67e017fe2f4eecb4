// Finds the crossings of scan lines with the pictures of edges that are seen through chains of mirrors and
// smooth glass (derivations, J).
//
// There is no projection from such an edge to the picture, so rays that meet it are searched for from the
// camera. The chains of two neighbouring places on a line are compared vertex by vertex. If they differ,
// bisection finds the place in between, and the edge that the ray touches is taken from the faces met there.
// If both halves of an interval contain a difference, one of them is chosen at random and gets twice the
// weight. Thus any number of crossings in a segment are counted correctly in the mean. If the ray continues
// at one place and ends below its face at the other, the crossing is the face's horizon, and the chain is the
// one that continues. If only the lights of the table differ that both rays meet, it is the outline of a
// light (boundary/specular/mirrored_outline.h). Shadow edges are found in the same way, on the ray from the
// chain's end to a point of a light. That point is sampled at one of the two places. The choice of the place
// affects only the point's density.
//
// A feature narrower than the spacing of the places is found with a probability of its width over the
// spacing, and its crossings have the inverse of it as a weight (weight_of_narrow). Lights of the table that
// lie between two places are always found (boundary/specular/narrow_light.h). Where several features follow
// each other within the spacing, some are missed.
//
// Every second place of a line chooses the events of a chain, and the places on both sides of it follow them.
// This takes three chains for two segments. Lines start at a random offset within such a pair, so that either
// end of a segment is equally often the one that chooses. A crossing that only one end can find gets twice
// the weight. Lines end at the border of their tile of the picture (boundary/specular/scan_plan.h).
#pragma once

#include <algorithm>

#include "boundary/specular/narrow_light.h"
#include "boundary/specular/touched_curve.h"
#include "tasks/image_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Bisection steps. More steps locate crossings up to the rounding of places in the picture.
constexpr int kHalvings = 14;
// The steps after which two crossings in one interval are no longer told apart. In smaller intervals,
// rounding lets rays slip past an edge or between its faces. Such differences belong to one crossing, whose
// sides are known by construction.
constexpr int kApart = 9;

EG_INLINE PicturePoint middle(const PicturePoint& a, const PicturePoint& b) {
    return {0.5f * (a.x + b.x), 0.5f * (a.y + b.y), a.lens_u, a.lens_v};
}
EG_INLINE PicturePoint select(Mask m, const PicturePoint& a, const PicturePoint& b) {
    return {select(m, a.x, b.x), select(m, a.y, b.y), a.lens_u, a.lens_v};
}

// Copies the lanes of a mask.
EG_OUTLINE void take(SpecularChain& to, Mask m, const SpecularChain& from) {
    int most = 0;
    for (int i = 0; i < W; ++i)
        if (m[i] && from.count[i] > most) most = from.count[i];
    to.count = select(m, from.count, to.count);
    for (int k = 0; k < most; ++k) {
        to.key[k] = select(m, from.key[k], to.key[k]);
        to.face[k] = select(m, from.face[k], to.face[k]);
        to.mesh[k] = select(m, from.mesh[k], to.mesh[k]);
        to.instance[k] = select(m, from.instance[k], to.instance[k]);
        to.b1[k] = select(m, from.b1[k], to.b1[k]);
        to.b2[k] = select(m, from.b2[k], to.b2[k]);
        to.from[k] = select(m, from.from[k], to.from[k]);
        to.direction[k] = select(m, from.direction[k], to.direction[k]);
        to.position[k] = select(m, from.position[k], to.position[k]);
        to.normal[k] = select(m, from.normal[k], to.normal[k]);
        to.smooth[k] = select(m, from.smooth[k], to.smooth[k]);
        to.lights[k] = select(m, from.lights[k], to.lights[k]);
    }
}

// Appends the crossing of lane i.
EG_INLINE void append_intersection(ChainCrossings& out, int n, int i, int64_t segment, Mask horizontal,
                                   const PicturePoint& place, const ChainChoices& choices,
                                   const SpecularChain& chain, int level, const TouchedCurve& curve,
                                   float weight) {
    const ChainLight& light = choices.light;
    const bool lit = level > choices.lit[i];
    if (lit) level = choices.lit[i] + 1;  // surfaces on the way to the light are not part of the chain
    out.lit[n] = lit ? -1 : 0;
    out.light_row[n] = light.row[i], out.light_kind[n] = light.kind[i], out.light_face[n] = light.face[i];
    out.light_instance[n] = light.instance[i], out.light_scatters[n] = light.scatters[i];
    out.light_blockers[n] = light.blockers[i], out.light_visible_to[n] = light.visible_to[i];
    out.light_b1[n] = light.b1[i], out.light_b2[n] = light.b2[i];
    out.light_place[0][n] = light.place.x[i], out.light_place[1][n] = light.place.y[i];
    out.light_place[2][n] = light.place.z[i];
    out.light_density[n] = light.density[i];
    out.x[n] = place.x[i], out.y[n] = place.y[i];
    out.lens_u[n] = place.lens_u[i], out.lens_v[n] = place.lens_v[i];
    out.segment[n] = static_cast<int32_t>(segment);
    out.horizontal[n] = horizontal[i];
    out.length[n] = level;
    float probability = 1.0f;
    for (int k = 0; k < level; ++k) {
        out.face[k][n] = chain.face[k][i], out.mesh[k][n] = chain.mesh[k][i];
        out.instance[k][n] = chain.instance[k][i];
        out.b1[k][n] = chain.b1[k][i], out.b2[k][n] = chain.b2[k][i];
        out.closure[k][n] = choices.closure[k][i], out.event[k][n] = choices.event[k][i];
        const Vec3& half = choices.half[k];
        out.half[0][k][n] = half.x[i], out.half[1][k][n] = half.y[i], out.half[2][k][n] = half.z[i];
        probability *= choices.probability[k][i];
    }
    out.edge[n] = curve.edge, out.edge_instance[n] = curve.instance, out.u[n] = curve.u;
    out.field[n] = curve.field, out.contact[n] = curve.contact;
    out.outlined_light[n] = curve.light;
    for (int k = 0; k < 3; ++k)
        out.curve_point[k][n] = curve.point[k], out.outline_normal[k][n] = curve.normal[k];
    for (int k = 0; k < 2; ++k)
        out.crossed_face[k][n] = curve.crossed[k].face,
        out.crossed_instance[k][n] = curve.crossed[k].instance;
    out.weight[n] = weight / probability;
}

// Lanes whose chain ends at a point that receives light from the chosen surface. Empty in opaque scenes: if
// the ray to the surface differs between the ends of the segment, the surface is occluded from one of them.
EG_OUTLINE Mask sees_surface(const SceneView& scene, const ChainChoices& choices, const SpecularChain& chain,
                             Mask active) {
    Mask requested = active & choices.light.scatters & (choices.lit < chain.count);
    if (!(scene.all_flags & kHasTransparency) || !any(requested)) return splat(0);
    Vec3 x = zero3();
    for (int k = 0; k < kMostChain; ++k) x = select(requested & (choices.lit == k), chain.position[k], x);
    const ChainLightRay way = see_chain_light(scene, requested, choices.light, x);
    const Vec3 seen = transmittance(scene, requested, x + way.w * (way.distance * 1e-4f), way.w,
                                    way.distance * 0.9998f, {choices.light.blockers, kDiffuseRay});
    return requested & (largest_component(seen) > 0.0f);
}

// The relative error of a feature's width at which its bisection ends.
constexpr float kWidthError = 0.02f;
// The least width of a feature in segments, and so the inverse of the largest weight of its crossings. A
// lower one leaves less of the corners of features out, but rays that rounding lets slip between two faces
// then seem to be features.
constexpr float kLeastWidth = 1.0f / 64.0f;

// A place on a line at a distance from another one.
EG_INLINE PicturePoint along_line(const PicturePoint& from, Mask horizontal, Float distance) {
    return {select(horizontal, from.x + distance, from.x), select(horizontal, from.y, from.y + distance),
            from.lens_u, from.lens_v};
}

// The width, in segments, of what is seen from `inside` on for at least the distance `seen`, along the line
// in the direction `way` (1 or -1), if `outside` is seen again within a segment; else 1.
EG_OUTLINE Float width_of_narrow(const SceneView& scene, const ScanTask& task, Mask active,
                                 const PicturePoint& inside, Float seen, Float way, Mask horizontal,
                                 UInt stream, ChainChoices& choices, const SpecularChain& outside) {
    SpecularChain chain;
    const Float h = way * kScanSegment;
    trace_chain<false>(scene, task, active, along_line(inside, horizontal, h), stream, choices, chain);
    const Mask narrow = active & (first_difference(outside, chain, active) < 0);
    Float low = max(seen / kScanSegment, splat(kLeastWidth)), high = splat(1.0f);
    for (Mask open = narrow; any(open); open &= high - low > kWidthError * high) {
        const Float middle = 0.5f * (low + high);
        trace_chain<false>(scene, task, open, along_line(inside, horizontal, h * middle), stream, choices,
                           chain);
        const Mask within = first_difference(outside, chain, open) >= 0;
        low = select(open & within, middle, low), high = select(open & ~within, middle, high);
    }
    return select(narrow, 0.5f * (low + high), 1.0f);
}

// Segments whose ends differ, collected until they fill a packet. Few segments of a packet differ, and each
// takes many chains.
struct IntersectedSegments {
    PicturePoint chosen, end;
    UInt stream;
    Mask horizontal;
    Float low, high;   // of the tile
    Float share;       // weight of a line
    Int number, half;  // number in the task; first or second of its pair
    ChainChoices choices;
    SpecularChain at_chosen, at_end;
    Int common;  // number of vertices up to which the other end could follow the events
    Mask lone;   // the other end cannot see the light's point
    Float weight;
    int waiting;  // number of collected segments
    int spare;    // number of segments so far that have no crossing
};

// The weights of crossings between the places p and q that are due to narrow features, for segments with one
// crossing.
//
// If the feature on one side has the width w, in segments, and what is on the other side follows behind it,
// the ends of a segment differ at this crossing only if one of them is in the feature, which has the
// probability w. The chains on both sides of the feature must agree at all later vertices, too.
EG_OUTLINE Float weight_of_narrow(const SceneView& scene, const ScanTask& task, Mask active,
                                  IntersectedSegments& s, const PicturePoint& p, const PicturePoint& q,
                                  Mask to_light) {
    const auto along = [&](const PicturePoint& at)
                           EG_INLINE_LAMBDA { return select(s.horizontal, at.x, at.y); };
    const Float way = select(along(s.end) > along(s.chosen), splat(1.0f), splat(-1.0f));
    const Float beyond = width_of_narrow(scene, task, active, q, abs(along(s.end) - along(q)), way,
                                         s.horizontal, s.stream, s.choices, s.at_chosen);
    Float before = width_of_narrow(scene, task, active, p, abs(along(s.chosen) - along(p)), -way,
                                   s.horizontal, s.stream, s.choices, s.at_end);
    // By the events of p, chains beside its feature end there. They may have events of their own.
    if (const Mask ended = active & ~to_light & (before < 1.0f); any(ended)) {
        ChainChoices own = s.choices;
        SpecularChain one, other;
        trace_chain<true>(scene, task, ended, q, s.stream, own, one);
        const PicturePoint behind = along_line(p, s.horizontal, -way * kScanSegment);
        trace_chain<false>(scene, task, ended, behind, s.stream, own, other);
        before = select(ended & (first_difference(one, other, ended) >= 0), splat(1.0f), before);
    }
    return select(active, 1.0f / (beyond * before), 1.0f);
}

// Finds the crossings of the collected segments, appends them, and empties the collection. Returns the number
// of all crossings found.
EG_OUTLINE int cross_segments(const SceneView& scene, const ScanTask& task, IntersectedSegments& s,
                              ChainCrossings& out, int found) {
    const int count = s.waiting;
    s.waiting = 0;
    Mask active = first_lanes(count);
    PicturePoint p = s.chosen, q = s.end;
    SpecularChain &chain_p = s.at_chosen, &chain_q = s.at_end, chain_m;
    ChainChoices& choices = s.choices;
    Float weight = s.weight;
    Mask single = max(abs(q.x - p.x), abs(q.y - p.y)) > 0.99f * kScanSegment;
    // Bisect the segments
    for (int step = 0; step < kHalvings; ++step) {
        const PicturePoint m = middle(p, q);
        trace_chain<false>(scene, task, active, m, s.stream, choices, chain_m);
        const Mask first = first_difference(chain_p, chain_m, active) >= 0,
                   second = first_difference(chain_m, chain_q, active) >= 0;
        active &= first | second;
        if (!any(active)) return found;
        const Mask both = active & first & second;
        Mask to_first = active & first & ~second;
        if (any(both)) {
            const UInt random = hash(s.stream ^ bits(2 * step + 1 + s.half) * splat(0x165667b1u));
            for (int i = 0; i < W; ++i)
                if (both[i] && (random[i] & 1u)) to_first[i] = -1;
            if (step < kApart) weight = select(both, 2.0f * weight, weight), single &= ~both;
        }
        const Mask to_second = active & ~to_first;
        q = select(to_first, m, q);
        take(chain_q, to_first, chain_m);
        p = select(to_second, m, p);
        take(chain_p, to_second, chain_m);
    }
    // Find the edge that each ray touches
    const Int level = first_difference(chain_p, chain_q, active);
    Mask other_surface = splat(0);
    for (int k = 0; k < kMostChain; ++k) {
        const Mask here = active & (level == k);
        if (any(here)) other_surface |= here & surfaces_differ(chain_p, chain_q, k);
    }
    // Weight the crossings of narrow features
    const Float along_p = select(s.horizontal, p.x, p.y);
    const Mask weighted =
        active & single & other_surface & (level >= 1) & (along_p >= s.low) & (along_p < s.high);
    if (!task.guides && any(weighted)) {
        weight = weight * weight_of_narrow(scene, task, weighted, s, p, q, level > choices.lit);
    }
    for (int i = 0; i < count; ++i) {
        const int k = level[i];
        if (!active[i] || k < 1) continue;
        if (along_p[i] < s.low[i] || along_p[i] >= s.high[i]) continue;
        const bool below = chain_p.key[k][i] == kBelow, horizon = below || chain_q.key[k][i] == kBelow;
        // If the two chains end on different faces, the edge between these faces is the cause.
        const bool parted = horizon && (chain_p.face[k - 1][i] != chain_q.face[k - 1][i] ||
                                        chain_p.instance[k - 1][i] != chain_q.instance[k - 1][i]);
        // Edges seen directly or only through transparent surfaces belong to the primary term.
        const int seen = parted ? k - 1 : k;
        bool bent = false;
        for (int j = 0; j < seen; ++j) bent |= choices.event[j][i] != kEventPasses;
        if (!bent || chain_p.key[k][i] == kDead || chain_q.key[k][i] == kDead) continue;
        const bool light = chain_p.lights[k][i] != chain_q.lights[k][i] && !other_surface[i];
        if (k <= choices.lit[i] && !(light ? task.outlines : task.edges)) continue;
        TouchedCurve curve;
        if (light)
            curve = touched_light(scene, chain_p, chain_q, choices, k, i);
        else if (!horizon || parted)
            curve = touched_curve(scene, task, chain_p, chain_q, seen, i);
        if (!curve.found() && !horizon && !light && k <= choices.lit[i])
            curve = touched_crossing(scene, chain_p, chain_q, k, i);
        if (!curve.found() && (!horizon || parted)) continue;
        out.parted[found] = parted ? -1 : 0;
        const bool twice = s.common[i] <= k || (s.lone[i] && k > choices.lit[i]);
        append_intersection(out, found++, i, s.number[i], s.horizontal, below ? q : p, choices,
                            below ? chain_q : chain_p, k, curve,
                            s.share[i] * weight[i] * (twice ? 2.0f : 1.0f));
    }
    return found;
}

// A segment, chosen by `random`, of the tile in which a place is.
EG_INLINE int32_t segment_at(const ScanTask& task, float x, float y, uint32_t random) {
    const auto column = std::min(static_cast<int32_t>((x - task.low[0]) / task.tile), task.columns - 1),
               row = std::min(static_cast<int32_t>((y - task.low[1]) / task.tile), task.rows - 1);
    const int64_t tile = int64_t{row} * task.columns + column;
    const auto line = static_cast<int64_t>(random % static_cast<uint32_t>(2 * task.tile_lines[tile]));
    return static_cast<int32_t>(task.tile_first[tile] + line * scan_line_segments(task.tile) - task.first);
}

// Collects the segments from `at` on that end at end[half] and whose chains differ there. Finds their
// crossings whenever they fill a packet. Returns the number of crossings.
EG_OUTLINE int sort_out_intersected(const SceneView& scene, const ScanTask& task, int64_t at, int half,
                                    const SegmentPair& s, Mask active, ChainChoices& choices,
                                    const SpecularChain& chosen, IntersectedSegments& crossed,
                                    ChainCrossings& out, int found) {
    SpecularChain end, middle, beside;
    trace_chain<false>(scene, task, active, s.end[half], s.stream, choices, end);
    const Mask differs = active & (first_difference(chosen, end, active) >= 0);
    // Find lights that lie between both ends
    Mask narrow = splat(0), near = narrow;
    PicturePoint between = s.chosen, place = between;
    if (task.outlines && any(active & ~differs)) {
        const PassedLight light = passed_light(scene, active & ~differs, choices, chosen, end,
                                               task.guides ? kGuidedFrom / kScanSegment : 0.0f);
        if (any(light.found)) {
            between.x = s.chosen.x + (s.end[half].x - s.chosen.x) * light.at;
            between.y = s.chosen.y + (s.end[half].y - s.chosen.y) * light.at;
            trace_chain<false>(scene, task, light.found, between, s.stream, choices, middle);
            const Mask other = first_difference(chosen, middle, light.found) >= 0;
            narrow = light.inside & other;
            near = light.found & ~other;
            if (task.guides && any(near))
                near =
                    find_beside(scene, task, near, light, s, half, between, middle, choices, place, beside);
            else
                near = splat(0);
        }
    }
    for (int i = 0; i < W; ++i) crossed.spare += active[i] && !differs[i] && !narrow[i] && !near[i];
    active &= differs | narrow | near;
    if (!any(active)) return found;
    // Find which crossings the other end could not have found
    Int common = end.count;
    for (int k = 0; k < kMostChain; ++k)
        common = select((k < end.count) & (end.key[k] == splat(kDead)), splat(k), common);
    const Mask lone = active & choices.light.scatters & ~sees_surface(scene, choices, end, active);
    // Collect the segments
    const auto collect = [&](int i, const PicturePoint& p, const PicturePoint& q, const SpecularChain& at_p,
                             const SpecularChain& at_q, float weight) {
        const int to = crossed.waiting++;
        move_lane(crossed.chosen, to, p, i), move_lane(crossed.end, to, q, i);
        move_lane(crossed.stream, to, s.stream, i), move_lane(crossed.horizontal, to, s.horizontal, i);
        move_lane(crossed.low, to, s.low, i), move_lane(crossed.high, to, s.high, i);
        move_lane(crossed.share, to, s.share, i);
        crossed.number[to] = static_cast<int32_t>(at) + 2 * i + half, crossed.half[to] = half;
        if (near[i]) {
            crossed.number[to] = segment_at(task, place.x[i], place.y[i], s.stream[i]);
            crossed.low[to] = -__builtin_inff(), crossed.high[to] = __builtin_inff();
        }
        move_lane(crossed.choices, to, choices, i);
        move_lane(crossed.at_chosen, to, at_p, i), move_lane(crossed.at_end, to, at_q, i);
        move_lane(crossed.common, to, common, i), move_lane(crossed.lone, to, lone, i);
        crossed.weight[to] = weight;
        if (crossed.waiting == W) found = cross_segments(scene, task, crossed, out, found);
    };
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        if (near[i]) {
            collect(i, between, place, middle, beside, kGuideWeight);
            continue;
        }
        if (!narrow[i]) {
            collect(i, s.chosen, s.end[half], chosen, end, 1.0f);
            continue;
        }
        // A segment has room for one crossing. The second one takes that of a segment without any; if there
        // is none, one of both is chosen at random.
        const bool both = crossed.spare > 0, first = both || (hash(s.stream[i] ^ 0x68bc21ebu) & 1u);
        if (first) collect(i, s.chosen, between, chosen, middle, both ? 1.0f : 2.0f);
        if (both || !first) collect(i, between, s.end[half], middle, end, both ? 1.0f : 2.0f);
        crossed.spare -= both;
    }
    return found;
}

// Finds the crossings of a task's segments. Returns their number.
static int scan_kernel(const SceneView& scene, const ScanTask& task, ChainCrossings& out) {
    int found = 0;
    IntersectedSegments crossed{};
    for (int64_t at = 0; at < task.count; at += 2 * W) {
        const SegmentPair s = scan_segments(task, at);
        ChainChoices choices;
        choices.light = no_chain_light();
        SpecularChain chosen;
        trace_chain<true>(scene, task, s.active, s.chosen, s.stream, choices, chosen);
        const Mask active = s.active & (chosen.count > 1);
        if (!any(active)) continue;
        for (int half = 0; half < 2; ++half)
            found =
                sort_out_intersected(scene, task, at, half, s, active, choices, chosen, crossed, out, found);
    }
    return crossed.waiting > 0 ? cross_segments(scene, task, crossed, out, found) : found;
}

}  // namespace edgegrad::EDGEGRAD_ISA
