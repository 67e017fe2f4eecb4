// Rays against the bricks of fields. A hit is where the spline changes its sign along the ray, never where it
// is merely small: grazing misses that count as hits would ruin derivatives.
//
// Within a brick the second derivative along a ray is bounded. The parabola of the least curvature through a
// point of the ray therefore lies below the spline up to its first root, and no crossing is skipped by going
// there. Where the parabola of the largest curvature has a root too, exactly one crossing lies between both,
// and the spline is monotone up to it.
#include "sdf/trace.h"

#include "sdf/bricks.h"
#include "sdf/place_code.h"
#include "sdf/spline.h"

namespace edgegrad::EDGEGRAD_ISA {
namespace {

// Least step in cells: crossings nearer to each other may be missed. They are only so near where a ray grazes
// the surface.
constexpr float kLeastStep = 1.0f / 128.0f;
// A crossing is refined to this many cells, the rounding of places in a brick.
constexpr float kResolved = 3e-7f;
constexpr int kMostRefinements = 24;
// The search goes on so many cells behind a crossing.
constexpr float kBehind = 1e-5f;

struct Slope {
    float value, slope;
};

typedef double Four __attribute__((vector_size(32)));

// The part of a ray within a brick: `from` and `direction` in grid coordinates relative to the brick.
class RayInBrick {
 public:
    RayInBrick(const TracedField& field, const FieldBrick& brick, const float (&origin)[3],
               const float (&direction)[3], float near, float far)
        : field_(field.view), brick_(brick) {
        const auto column = [&](int c) {
            Four r;
            __builtin_memcpy(&r, field.to_grid[c], sizeof r);
            return r;
        };
        const auto bound = [](const float (&corner)[4]) {
            return __builtin_convertvector(load_taps(corner), Four);
        };
        const Four x = column(0), y = column(1), z = column(2);
        const Four o = x * origin[0] + y * origin[1] + (z * origin[2] + column(3));
        const Four exact = x * direction[0] + y * direction[1] + z * direction[2];
        // A ray along a face of the box, whose distance to it would be 0/0, is within the box
        const Four d = exact == 0.0 ? Four{} + 1e-300 : exact;
        const Four inverse = 1.0 / d, t0 = (bound(brick.lower) - o) * inverse,
                   t1 = (bound(brick.upper) - o) * inverse;
        const Four in = t0 < t1 ? t0 : t1, out = t0 < t1 ? t1 : t0;
        const double first = max_of(max_of(in[0], in[1]), max_of(in[2], static_cast<double>(near)));
        const double last = min_of(min_of(out[0], out[1]), min_of(out[2], static_cast<double>(far)));
        const double length = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if (!(first < last) || !(length > 0.0) || !(last - first < 1e30)) return;
        start_ = first;
        const Four from = o + d * first;
        for (int a = 0; a < 3; ++a) {
            from_[a] = static_cast<float>(from[a] - brick.first[a]);
            direction_[a] = static_cast<float>(d[a]);
        }
        length_ = static_cast<float>(last - first);
        if (!cut_by_plane()) return;
        cell_ = 1.0f / static_cast<float>(__builtin_sqrt(length));
        bound_curvature();
    }

    bool meets() const { return length_ > 0.0f; }

    // Finds the next crossing and continues behind it with the next call. Returns whether there is one.
    bool next() {
        if (at_ >= length_) return false;
        Slope f = evaluate(at_);
        while (true) {
            const bool inside = f.value < 0.0f;
            const float value = inside ? -f.value : f.value, slope = inside ? -f.slope : f.slope;
            const float least = inside ? -most_ : least_, most = inside ? -least_ : most_;
            // No root of the lower parabola: none of the spline
            const float below = slope * slope - 2.0f * least * value;
            if ((least >= 0.0f && slope >= 0.0f) || below < 0.0f) break;
            const float safe = first_root(value, slope, below);
            if (at_ + safe >= length_) break;
            // A root of the upper parabola: a single crossing
            const float above = slope * slope - 2.0f * most * value;
            if (slope < 0.0f && above > 0.0f) {
                const float end = first_root(value, slope, above);
                if (at_ + end <= length_) return cross(at_ + safe, at_ + end, inside, true);
            }
            const float step = at_ + max_of(safe, kLeastStep * cell_);
            const float before = at_;
            at_ = step < length_ ? step : length_;
            f = evaluate(at_);
            if ((f.value < 0.0f) != inside) return cross(before, at_, inside, false);
            if (at_ >= length_) break;
        }
        at_ = length_;
        return false;
    }

    // The crossing that was found: its distance, and its place in the grid.
    double distance() const { return start_ + static_cast<double>(found_); }
    void place(double (&grid)[3]) const {
        for (int a = 0; a < 3; ++a)
            grid[a] =
                static_cast<double>(from_[a]) + static_cast<double>(found_) * direction_[a] + brick_.first[a];
    }
    // Whether the place is in the brick itself, up to rounding, and not in its overlap.
    bool owns() const {
        constexpr double kSlack = 4e-6;
        double grid[3];
        place(grid);
        bool within = true;
        for (int a = 0; a < 3; ++a)
            within = within && grid[a] >= brick_.first[a] - kSlack && grid[a] <= brick_.last[a] + kSlack;
        return within;
    }

 private:
    static float max_of(float a, float b) { return a > b ? a : b; }
    static double max_of(double a, double b) { return a > b ? a : b; }
    static double min_of(double a, double b) { return a < b ? a : b; }
    // The smallest positive root of value + slope t + c t^2/2, with `square` = slope^2 - 2 c value >= 0.
    static float first_root(float value, float slope, float square) {
        const float down = __builtin_sqrtf(square) - slope;
        return down > 0.0f ? 2.0f * value / down : 3e38f;
    }

    Slope evaluate(float t) const {
        int32_t cell[3];
        float at[3];
        for (int a = 0; a < 3; ++a) {
            const float p = from_[a] + t * direction_[a];
            const int32_t last = brick_.last[a] - brick_.first[a];
            // In the overlap the neighbouring cell is another polynomial.
            const int32_t least = brick_.first[a] > 0 ? -1 : 0;
            const int32_t most = brick_.last[a] < field_.cells(a) ? last : last - 1;
            int32_t c = static_cast<int32_t>(p + 2.0f) - 2;
            c = c < least ? least : c > most ? most : c;
            at[a] = p - static_cast<float>(c);
            cell[a] = c + brick_.first[a];
        }
        const FieldPoint f = spline(field_, cell, at);
        return {f.value, f.gradient[0] * direction_[0] + f.gradient[1] * direction_[1] +
                             f.gradient[2] * direction_[2]};
    }

    // Keeps the part of the ray where the brick's affine function is near zero. Returns whether there is any.
    bool cut_by_plane() {
        float value = brick_.value, slope = 0.0f;
        for (int a = 0; a < 3; ++a) {
            value += brick_.slope[a] * from_[a];
            slope += brick_.slope[a] * direction_[a];
        }
        // In the overlap the bound holds nearly.
        const float error = 1.01f * brick_.error, size = value < 0.0f ? -value : value;
        if (size > error) {
            // The ray starts outside of the slab and may enter it
            const float towards = value < 0.0f ? slope : -slope;
            if (!(towards * length_ > size - error)) return length_ = 0.0f, false;
            at_ = (size - error) / towards;
            const float behind = (size + error) / towards;
            length_ = behind < length_ ? behind : length_;
        } else if (slope != 0.0f) {
            const float behind = (error + (slope > 0.0f ? -value : value)) / (slope < 0.0f ? -slope : slope);
            length_ = behind < length_ ? behind : length_;
        }
        return true;
    }

    void bound_curvature() {
        const float (&d)[3] = direction_;
        const float weight[6] = {d[0] * d[0],        d[1] * d[1],        d[2] * d[2],
                                 2.0f * d[1] * d[2], 2.0f * d[0] * d[2], 2.0f * d[0] * d[1]};
        for (int n = 0; n < 6; ++n) {
            const bool positive = weight[n] > 0.0f;
            least_ += weight[n] * (positive ? brick_.low[n] : brick_.high[n]);
            most_ += weight[n] * (positive ? brick_.high[n] : brick_.low[n]);
        }
    }

    // Refines the crossing between `low`, before it, and `high` by Newton's method within the bracket.
    bool cross(float low, float high, bool inside, bool newton) {
        float t = newton ? low : 0.5f * (low + high);
        const float resolved = kResolved * cell_;
        const float bend = least_ < -most_ ? -least_ : most_ > -least_ ? most_ : -least_;
        for (int k = 0; k < kMostRefinements; ++k) {
            const Slope f = evaluate(t);
            if (((f.value < 0.0f) == inside) && f.value != 0.0f)
                low = t;
            else
                high = t;
            const float step = f.value / f.slope, size = step < 0.0f ? -step : step;
            if (size <= resolved) break;
            const bool newtons = t - step > low && t - step < high;
            t = newtons ? t - step : 0.5f * (low + high);
            // The error that Newton's method leaves
            const float slope = f.slope < 0.0f ? -f.slope : f.slope;
            if ((newtons && bend * size * size <= resolved * slope) || high - low <= resolved) break;
        }
        found_ = t;
        const float behind = t + kBehind * cell_;
        at_ = newton ? behind : max_of(behind, high);
        return true;
    }

    const FieldView& field_;
    const FieldBrick& brick_;
    double start_ = 0.0;
    float from_[3] = {}, direction_[3] = {};
    float length_ = 0.0f, cell_ = 0.0f;  // in units of the direction's length; of a path through one cell
    float least_ = 0.0f, most_ = 0.0f;   // second derivative along the ray
    float at_ = 0.0f, found_ = 0.0f;
};

// Embree's packets of n rays: arrays of n values each (embree/api.h, Ray and Hit).
struct RaysOfPacket {
    float* rays;
    uint32_t n;

    float& ray(uint32_t field, uint32_t i) const { return rays[field * n + i]; }
    void put(float* hit, uint32_t stride, uint32_t field, uint32_t i, uint32_t value) const {
        __builtin_memcpy(hit + field * stride + i, &value, 4);
    }
    RayInBrick in(const TracedField& field, const FieldBrick& brick, uint32_t i) const {
        const float origin[3] = {ray(0, i), ray(1, i), ray(2, i)};
        const float direction[3] = {ray(4, i), ray(5, i), ray(6, i)};
        return RayInBrick(field, brick, origin, direction, ray(3, i), ray(8, i));
    }
    // Writes the hit that `r` has found; `stride` is the hits' number of rays.
    void write(float* hit, uint32_t stride, uint32_t at, const TracedField& field, const RayInBrick& r,
               const embree::UserArguments& args) const {
        double grid[3];
        r.place(grid);
        uint32_t code[2];
        encode_place(field.view, grid, code);
        for (uint32_t c = 0; c < 3; ++c) put(hit, stride, c, at, 0);
        put(hit, stride, 3, at, code[0]), put(hit, stride, 4, at, code[1]);
        put(hit, stride, 5, at, 0);  // a field is one primitive to all but Embree
        put(hit, stride, 6, at, args.geom_id);
        put(hit, stride, 7, at, args.context->inst_id);
        put(hit, stride, 8, at, args.context->inst_prim_id);
    }
};
constexpr uint32_t kRayFields = 12, kHitFields = 9;

// Whether the surface stops a ray; the query's filter may let it pass.
bool stops(const TracedField& field, const RaysOfPacket& packet, uint32_t i, const RayInBrick& r,
           const embree::UserArguments& args) {
    const auto* context = reinterpret_cast<const BrickContext*>(args.context);
    if (!context->filter) return true;
    float ray[kRayFields], hit[kHitFields];
    for (uint32_t k = 0; k < kRayFields; ++k) ray[k] = packet.ray(k, i);
    ray[8] = static_cast<float>(r.distance());
    packet.write(hit, 1, 0, field, r, args);
    int32_t valid = -1;
    const embree::FilterArguments filter{&valid, args.user, args.context, ray, hit, 1};
    context->filter(&filter);
    return valid != 0;
}

// Calls ends(field, packet, ray's number, ray) at the crossings of each valid ray, until it returns true.
//
// Two bricks round a crossing in their overlap differently. So it counts in its own brick, and once: the
// order in which Embree visits bricks does not matter.
template <typename Ends>
void for_each_crossing(const embree::UserArguments& args, const Ends& ends) {
    const auto& field = *static_cast<const TracedField*>(args.user);
    const RaysOfPacket packet{static_cast<float*>(args.rays), args.n};
    for (uint32_t i = 0; i < args.n; ++i) {
        if (!args.valid[i]) continue;
        RayInBrick r = packet.in(field, field.bricks[args.primitive], i);
        while (r.meets() && r.next())
            if (r.owns() && ends(field, packet, i, r)) break;
    }
}

}  // namespace

void intersect_brick(const embree::UserArguments* args) {
    for_each_crossing(
        *args, [&](const TracedField& field, const RaysOfPacket& packet, uint32_t i, const RayInBrick& r) {
            const auto distance = static_cast<float>(r.distance());
            if (!(distance > packet.ray(3, i))) return false;
            if (!(distance < packet.ray(8, i))) return true;
            packet.ray(8, i) = distance;
            packet.write(packet.rays + kRayFields * args->n, args->n, i, field, r, *args);
            return true;
        });
}

void occlude_brick(const embree::UserArguments* args) {
    for_each_crossing(
        *args, [&](const TracedField& field, const RaysOfPacket& packet, uint32_t i, const RayInBrick& r) {
            if (!stops(field, packet, i, r, *args)) return false;
            packet.ray(8, i) = -__builtin_inff();
            return true;
        });
}

}  // namespace edgegrad::EDGEGRAD_ISA
