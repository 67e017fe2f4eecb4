#include "scene/lights/light_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "util/parallel.h"

namespace edgegrad {
namespace {

constexpr int kBins = 12;
// Below this many lights, halving is used instead of the cheapest split.
constexpr size_t kFewLights = 8;
constexpr float kPi = 3.14159265f;

float clamped_acos(float x) { return std::acos(std::clamp(x, -1.0f, 1.0f)); }

// Solid angle of the emission of Lambertian lights whose axes spread within a cone. The argument is the
// length of the mean axis, (1 + cos o)/2 for uniform axes in a cone of half angle o.
class OrientationMeasure {
 public:
    OrientationMeasure() {
        for (size_t k = 0; k < table_.size(); ++k) {
            const float mean = static_cast<float>(k) / static_cast<float>(table_.size() - 1);
            const float o = clamped_acos(2.0f * mean - 1.0f), w = std::min(o + 0.5f * kPi, kPi);
            table_[k] =
                2.0f * kPi * (1.0f - std::cos(o)) +
                0.5f * kPi *
                    (2.0f * w * std::sin(o) - std::cos(o - 2.0f * w) - 2.0f * o * std::sin(o) + std::cos(o));
        }
    }
    float operator()(float mean) const {
        return table_[std::min(static_cast<size_t>(mean * static_cast<float>(table_.size() - 1) + 0.5f),
                               table_.size() - 1)];
    }

 private:
    std::array<float, 65> table_;
};

// The part of a group that determines the cost of a split: its box, summed axes and power. Groups are added
// quickly, unlike unions of cones: the spread of the axes is estimated from the length of their mean.
struct Group {
    float low[3] = {3e38f, 3e38f, 3e38f}, high[3] = {-3e38f, -3e38f, -3e38f};
    float axes[3] = {0, 0, 0};
    float power = 0.0f;
    int count = 0;

    // `reach`: the distance at which lights of different decays are compared.
    void add(const LightNode& n, float reach) {
        for (int c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], n.center[c] - n.radius);
            high[c] = std::max(high[c], n.center[c] + n.radius);
        }
        // A light that emits in all directions has no axis; a wide one has a short axis.
        const float length = 0.5f * (1.0f + n.cos_o);
        for (int c = 0; c < 3; ++c) axes[c] += length * n.axis[c];
        power += n.intensity(reach);
        ++count;
    }
    void add(const Group& g) {
        for (int c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], g.low[c]);
            high[c] = std::max(high[c], g.high[c]);
            axes[c] += g.axes[c];
        }
        power += g.power;
        count += g.count;
    }
    // Surface area orientation heuristic (Conty Estevez and Kulla 2018, eq. 1).
    float cost(const OrientationMeasure& orientation) const {
        if (!count) return 0.0f;
        const float a = high[0] - low[0], b = high[1] - low[1], c = high[2] - low[2];
        const float length = std::sqrt(axes[0] * axes[0] + axes[1] * axes[1] + axes[2] * axes[2]);
        return power * orientation(length / static_cast<float>(count)) * (a * b + b * c + c * a);
    }
};

class Builder {
 public:
    Builder(std::vector<LightNode> lights, int32_t offset) : lights_(std::move(lights)), offset_(offset) {
        order_.resize(lights_.size());
        for (size_t k = 0; k < order_.size(); ++k) order_[k] = static_cast<int32_t>(k);
        nodes_.reserve(2 * lights_.size());
        nodes_.resize(2);
    }

    std::vector<LightNode> build() {
        reach_ = united_reach();
        split(0, 0, order_.size());
        nodes_[0].parent = -1;
        return std::move(nodes_);
    }

 private:
    // About the size of the box of all lights.
    float united_reach() const {
        float low[3] = {3e38f, 3e38f, 3e38f}, high[3] = {-3e38f, -3e38f, -3e38f};
        for (const LightNode& n : lights_)
            for (int c = 0; c < 3; ++c) {
                low[c] = std::min(low[c], n.center[c] - n.radius);
                high[c] = std::max(high[c], n.center[c] + n.radius);
            }
        return std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    }

    const LightNode& light(size_t k) const { return lights_[static_cast<size_t>(order_[k])]; }

    void split(size_t at, size_t first, size_t last) {
        if (last - first == 1) {
            nodes_[at] = light(first);
            return;
        }
        may_cancel();
        const size_t middle = partition(first, last);
        const size_t pair = nodes_.size();
        nodes_.resize(pair + 2);
        split(pair, first, middle);
        split(pair + 1, middle, last);
        for (size_t k : {pair, pair + 1}) nodes_[k].parent = static_cast<int32_t>(at) + offset_;
        nodes_[at] = united(nodes_[pair], nodes_[pair + 1]);
        nodes_[at].child = static_cast<int32_t>(pair) + offset_;
    }

    // Partitions a range by the cheapest of all planes between bins, or else into halves. Returns the middle.
    size_t partition(size_t first, size_t last) {
        // Compute the bounds of the centres
        float low[3] = {3e38f, 3e38f, 3e38f}, high[3] = {-3e38f, -3e38f, -3e38f};
        for (size_t k = first; k < last; ++k)
            for (int c = 0; c < 3; ++c) {
                low[c] = std::min(low[c], light(k).center[c]);
                high[c] = std::max(high[c], light(k).center[c]);
            }
        const float longest = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
        if (last - first <= kFewLights) return halve(first, last, low, high);
        // Sort the lights into bins
        float best = 3e38f;
        int best_axis = -1, best_bin = 0;
        std::array<std::array<Group, kBins>, 3> bins{};
        for (size_t k = first; k < last; ++k)
            for (int c = 0; c < 3; ++c)
                if (high[c] > low[c])
                    bins[static_cast<size_t>(c)][static_cast<size_t>(bin(light(k), c, low, high))].add(
                        light(k), reach_);
        // Find the cheapest plane
        for (int c = 0; c < 3; ++c) {
            if (!(high[c] > low[c])) continue;
            const auto& row = bins[static_cast<size_t>(c)];
            std::array<float, kBins> right{};
            Group group;
            for (size_t b = kBins - 1; b > 0; --b) {
                group.add(row[b]);
                right[b] = group.cost(orientation_);
            }
            group = {};
            for (size_t b = 0; b + 1 < kBins; ++b) {
                group.add(row[b]);
                // Avoid thin slabs.
                const float cost = longest / (high[c] - low[c]) * (group.cost(orientation_) + right[b + 1]);
                if (group.count > 0 && group.count < static_cast<int>(last - first) && cost < best)
                    best = cost, best_axis = c, best_bin = static_cast<int>(b);
            }
        }
        // Partition by that plane
        const auto begin = order_.begin() + static_cast<ptrdiff_t>(first);
        const auto end = order_.begin() + static_cast<ptrdiff_t>(last);
        if (best_axis < 0) return first + (last - first) / 2;  // all centres coincide
        const auto middle = std::stable_partition(begin, end, [&](int32_t k) {
            return bin(lights_[static_cast<size_t>(k)], best_axis, low, high) <= best_bin;
        });
        return static_cast<size_t>(middle - order_.begin());
    }

    // Splits along the longest side of the box.
    size_t halve(size_t first, size_t last, const float* low, const float* high) {
        int axis = 0;
        for (int c = 1; c < 3; ++c)
            if (high[c] - low[c] > high[axis] - low[axis]) axis = c;
        std::stable_sort(order_.begin() + static_cast<ptrdiff_t>(first),
                         order_.begin() + static_cast<ptrdiff_t>(last), [&](int32_t a, int32_t b) {
                             return lights_[static_cast<size_t>(a)].center[axis] <
                                    lights_[static_cast<size_t>(b)].center[axis];
                         });
        return first + (last - first) / 2;
    }

    static int bin(const LightNode& n, int c, const float* low, const float* high) {
        const float place = (n.center[c] - low[c]) / (high[c] - low[c]);
        return place > 0.0f ? static_cast<int>(std::min(place * kBins, kBins - 0.5f)) : 0;  // 0 of NaN
    }

    std::vector<LightNode> lights_;
    int32_t offset_;
    float reach_ = 0.0f;
    std::vector<int32_t> order_;
    std::vector<LightNode> nodes_;
    OrientationMeasure orientation_;
};

// The smallest cone around two cones of directions.
void unite_cones(const LightNode& a, const LightNode& b, LightNode& out) {
    const auto whole = [&] {
        out.cos_o = -1.0f;
        out.sin_o = 0.0f;
    };
    std::copy_n(a.axis, 3, out.axis);
    if (a.cos_o <= -1.0f || b.cos_o <= -1.0f) return whole();
    float cosine = a.axis[0] * b.axis[0] + a.axis[1] * b.axis[1] + a.axis[2] * b.axis[2];
    // A two-sided light may be seen with its axis reversed.
    const float turn = b.two_sided && cosine < 0.0f ? -1.0f : 1.0f;
    cosine *= turn;
    const float angle = clamped_acos(cosine), oa = clamped_acos(a.cos_o), ob = clamped_acos(b.cos_o);
    float o = 0.5f * (oa + angle + ob);
    if (angle + ob <= oa) {
        o = oa;
    } else if (angle + oa <= ob) {
        o = ob;
        for (int c = 0; c < 3; ++c) out.axis[c] = turn * b.axis[c];
    } else {
        if (o >= kPi) return whole();
        // Rotate a's axis by o - oa towards b's.
        const float sine = std::sin(angle), t = o - oa;
        if (!(sine > 1e-4f) && cosine < 0.0f) return whole();
        const float fb = sine > 1e-4f ? std::sin(t) / sine : 0.5f;
        const float fa = sine > 1e-4f ? std::sin(angle - t) / sine : 0.5f;
        float length = 0.0f;
        for (int c = 0; c < 3; ++c) {
            out.axis[c] = fa * a.axis[c] + fb * turn * b.axis[c];
            length += out.axis[c] * out.axis[c];
        }
        for (float& x : out.axis) x /= std::sqrt(length);
    }
    o = std::min(o + 1e-3f, kPi);  // so that rounding excludes no light
    out.cos_o = std::cos(o);
    out.sin_o = std::sin(o);
}

}  // namespace

LightNode united(const LightNode& a, const LightNode& b) {
    LightNode out{};
    float d[3], distance = 0.0f;
    for (int c = 0; c < 3; ++c) {
        d[c] = b.center[c] - a.center[c];
        distance += d[c] * d[c];
    }
    distance = std::sqrt(distance);
    out.radius = 0.5f * (distance + a.radius + b.radius);
    if (distance + b.radius <= a.radius || distance + a.radius <= b.radius) {
        const LightNode& outer = a.radius > b.radius ? a : b;
        std::copy_n(outer.center, 3, out.center);
        out.radius = outer.radius;
    } else {
        const float t = distance > 0.0f ? (out.radius - a.radius) / distance : 0.0f;
        for (int c = 0; c < 3; ++c) out.center[c] = a.center[c] + t * d[c];
    }
    out.radius *= 1.00001f;
    unite_cones(a, b, out);
    out.cos_e = std::min(a.cos_e, b.cos_e);
    out.two_sided = a.two_sided | b.two_sided;
    out.power = a.power + b.power;
    out.by_way = a.by_way + b.by_way;
    out.by_way2 = a.by_way2 + b.by_way2;
    return out;
}

std::vector<LightNode> light_tree(std::vector<LightNode> lights, int32_t offset) {
    return Builder(std::move(lights), offset).build();
}

}  // namespace edgegrad
