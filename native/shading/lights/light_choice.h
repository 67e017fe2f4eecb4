// Choice of one light for a point, in proportion to a bound of the irradiance from each light. Few lights are
// compared all together; many lights are chosen down a hierarchy of bounds (Conty Estevez and Kulla 2018,
// "Importance Sampling of Many Lights with Adaptive Tree Splitting"; the bound of a node as in pbrt-v4).
#pragma once

#include <cstddef>

#include "scene/view.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// The receiver of light. Lights below its horizon cannot contribute unless its surface also transmits light.
struct Receiver {
    Vec3 position;
    Vec3 normal;      // geometric, on the viewer's side
    Mask both_sides;  // its surface transmits
    // receiving_normal() (shading/receiving_normal.h); null: the geometric normal
    const Vec3* shading = nullptr;
    Float least_facing = splat(0.0f);  // 1 in media, which light reaches from all directions

    // Bound of the cosine with which light from w counts.
    EG_INLINE Float facing(Vec3 w) const {
        Float cosine = dot(w, normal);
        if (shading) cosine = max(cosine, dot(w, *shading));
        return select(both_sides, max(abs(cosine), least_facing), cosine);
    }
};

struct NodePacket {
    Vec3 center, axis;
    Float radius, cos_o, sin_o, cos_e, power;
    Mask two_sided;
    Int child;
    Float by_way, by_way2;
};

EG_INLINE NodePacket broadcast_node(const LightNode& n) {
    return {splat3(n.center), splat3(n.axis),  splat(n.radius), splat(n.cos_o),
            splat(n.sin_o),   splat(n.cos_e),  splat(n.power),  splat(n.two_sided ? -1 : 0),
            splat(n.child),   splat(n.by_way), splat(n.by_way2)};
}

EG_INLINE NodePacket gather_node(const LightNode* nodes, Int at) {
    static_assert(offsetof(LightNode, child) == 12 * sizeof(float));
    static_assert(offsetof(LightNode, by_way) == 14 * sizeof(float));
    Float r[16];
    gather_row(nodes->center, sizeof(LightNode) / sizeof(float), at, r);
    return {{r[0], r[1], r[2]},           {r[4], r[5], r[6]},      r[3],  r[7], r[8], r[9], r[10],
            bits(float_bits(r[11])) != 0, bits(float_bits(r[12])), r[14], r[15]};
}

// Cosine of the angle max(a - b, 0).
EG_INLINE Float cos_difference(Float cos_a, Float sin_a, Float cos_b, Float sin_b) {
    return select(cos_a > cos_b, splat(1.0f), cos_a * cos_b + sin_a * sin_b);
}
EG_INLINE Float sin_difference(Float cos_a, Float sin_a, Float cos_b, Float sin_b) {
    return select(cos_a > cos_b, splat(0.0f), sin_a * cos_b - cos_a * sin_b);
}

EG_INLINE Float sine_of(Float cosine) { return sqrt(max(1.0f - cosine * cosine, 0.0f)); }

// Bound of the irradiance from a node's lights at x. Only the top nodes may be distant lights
// (`kMayBeDistant`); the many members of groups never are. `by_way`: some light of the scene falls less than
// with the square of the distance.
template <bool kMayBeDistant, typename Point>
EG_INLINE Float importance(const NodePacket& n, const Point& x, bool by_way) {
    const Mask distant = kMayBeDistant ? n.radius < 0.0f : splat(0);
    const Vec3 d = n.center - x.position;
    const Float d2 = max(dot(d, d), 1e-30f);
    const Float inverse2 = 1.0f / d2, inverse = sqrt(inverse2);
    Vec3 w = d * inverse;
    // Angle b of the bounding sphere, seen from x.
    const Float sin2_b = n.radius * n.radius * inverse2;
    const Mask inside = ~distant & (sin2_b >= 1.0f);
    Float cos_b = select(inside, splat(-1.0f), sqrt(max(1.0f - sin2_b, 0.0f)));
    Float sin_b = select(inside, splat(0.0f), n.radius * inverse);
    if (kMayBeDistant) {
        w = select(distant, -n.axis, w);
        cos_b = select(distant, n.cos_o, cos_b);
        sin_b = select(distant, n.sin_o, sin_b);
    }
    const Float cos_x = x.facing(w);
    Float power = n.power;
    if (by_way) {
        const Float r = select(inside, n.radius, d2 * inverse);
        power = select(distant, power, power + r * (n.by_way + r * n.by_way2));
    }
    const Float bound = power * max(cos_difference(cos_x, sine_of(cos_x), cos_b, sin_b), 0.0f);
    if (kMayBeDistant && !any(~distant)) return bound;
    // Angle between the direction to x and the nearest direction of emission.
    const Float cosine = -dot(w, n.axis);
    const Float cos_w = select(n.two_sided, abs(cosine), cosine), sin_w = sine_of(cos_w);
    const Float cos_1 = cos_difference(cos_w, sin_w, n.cos_o, n.sin_o);
    const Float sin_1 = sin_difference(cos_w, sin_w, n.cos_o, n.sin_o);
    const Float cos_2 = cos_difference(cos_1, sin_1, cos_b, sin_b);
    // The distance is at least the sphere's radius.
    const Float near = bound * select(cos_2 > n.cos_e, cos_2, 0.0f) *
                       select(inside, 1.0f / max(n.radius * n.radius, 1e-30f), inverse2);
    return kMayBeDistant ? select(distant, bound, near) : near;
}

// Walks from a node down to a single light. At each pair it chooses one child in proportion to `weigh`(node).
// Returns the `child` of the last node. Replaces `u` by a new random number and multiplies `probability` by
// the probability of the walk. Lanes become inactive if both children have zero weight.
template <typename Weigh>
EG_INLINE Int walk_down(const LightNode* nodes, Int node, Mask& active, Float& u, Float& probability,
                        const Weigh& weigh) {
    Int child;
    for (int i = 0; i < W; ++i) child[i] = nodes[node[i]].child;
    for (Mask inner = active & (child >= 0); any(inner); inner = active & (child >= 0)) {
        const Int first = select(inner, child, splat(0));
        const NodePacket one = gather_node(nodes, first);
        const NodePacket other = gather_node(nodes, select(inner, first + 1, splat(0)));
        const Float a = weigh(one), b = weigh(other);
        active &= ~inner | (a + b > 0.0f);
        const Float p = a / max(a + b, 1e-38f);
        const Mask left = u < p;
        const Float share = select(left, p, 1.0f - p);
        probability = select(inner, probability * share, probability);
        const Float within = select(left, u, u - p) / max(share, 1e-30f);
        u = select(inner, min(within, splat(0.99999994f)), u);
        child = select(inner, select(left, one.child, other.child), child);
    }
    return child;
}

struct LightChoice {
    Mask active;
    Int light;
    Float probability;
    Float u;  // a random number, uniform within the choice's interval
};

// Chooses a light for x. The choice is inactive if no light can contribute.
template <typename Point>
EG_INLINE LightChoice choose_light(const LightView& lights, Mask active, const Point& x, Float u) {
    LightChoice choice{active, splat(0), splat(1.0f), u};
    if (lights.top == 1 && !lights.any_group) return choice;
    Int node = splat(0);
    if (lights.top > 1) {
        constexpr int kKept = 40;  // bounds to keep; others are computed twice
        // Compute the bounds of the top nodes
        Float kept[kKept], total = splat(0.0f);
        for (int k = 0; k < lights.top; ++k) {
            const Float bound = importance<true>(broadcast_node(lights.nodes[k]), x, lights.any_by_way);
            total = total + bound;
            if (k < kKept) kept[k] = bound;
        }
        choice.active &= total > 0.0f;
        const Float scale = 1.0f / select(choice.active, total, 1.0f);
        // Choose a top node. If rounding leaves u beyond the last interval, take the last node that is not
        // empty.
        Float sum = splat(0.0f), low = sum, share = splat(1.0f);
        Mask open = choice.active;
        for (int k = 0; k < lights.top; ++k) {
            const Float p =
                (k < kKept ? kept[k]
                           : importance<true>(broadcast_node(lights.nodes[k]), x, lights.any_by_way)) *
                scale;
            const Mask here = open & (p > 0.0f);
            node = select(here, splat(k), node);
            low = select(here, sum, low);
            share = select(here, p, share);
            sum = sum + p;
            open &= u >= sum;
            if (!any(open)) break;
        }
        choice.probability = share;
        choice.u = min(max((u - low) / share, 0.0f), splat(0.99999994f));
    }
    // Choose a light within the top node
    const Int child = walk_down(lights.nodes, node, choice.active, choice.u, choice.probability,
                                [&](const NodePacket& n)
                                    EG_INLINE_LAMBDA { return importance<false>(n, x, lights.any_by_way); });
    choice.light = select(choice.active & (child < 0), -1 - child, splat(0));
    return choice;
}

// Probability with which `choose_light` chooses a light.
EG_INLINE Float light_probability(const LightView& lights, Mask active, const Receiver& x, Int light) {
    Float probability = select(active, splat(1.0f), 0.0f);
    if (lights.top == 1 && !lights.any_group) return probability;
    Int node = gather(lights.node_of, select(active, light, splat(0)));
    // Multiply the probabilities of the walk from the top node
    if (lights.any_group) {
        for (;;) {
            Int parent;
            for (int i = 0; i < W; ++i) parent[i] = lights.nodes[node[i]].parent;
            const Mask inner = active & (parent >= 0);
            if (!any(inner)) break;
            Int first;
            for (int i = 0; i < W; ++i) first[i] = inner[i] ? lights.nodes[parent[i]].child : 0;
            const Float a = importance<false>(gather_node(lights.nodes, first), x, lights.any_by_way);
            const Float b = importance<false>(gather_node(lights.nodes, select(inner, first + 1, splat(0))),
                                              x, lights.any_by_way);
            const Float p = a / max(a + b, 1e-38f);
            const Float share = select(a + b > 0.0f, select(node == first, p, 1.0f - p), 0.0f);
            probability = select(inner, probability * share, probability);
            node = select(inner, parent, node);
        }
    }
    // Multiply by the probability of the top node
    if (lights.top > 1) {
        Float total = splat(0.0f), own = splat(0.0f);
        for (int k = 0; k < lights.top; ++k) {
            const Float bound = importance<true>(broadcast_node(lights.nodes[k]), x, lights.any_by_way);
            total = total + bound;
            own = select(node == splat(k), bound, own);
        }
        probability = select(total > 0.0f, probability * own / select(total > 0.0f, total, 1.0f), 0.0f);
    }
    return probability;
}

}  // namespace edgegrad::EDGEGRAD_ISA
