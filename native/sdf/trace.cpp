// Rays against the bricks of fields. A hit is where the spline changes its sign along the ray, never where it
// is merely small: grazing misses that count as hits would ruin derivatives.
//
// Within a brick the second derivative along a ray is bounded. The parabola of the least curvature through a
// point of the ray therefore lies below the spline up to its first root, and no crossing is skipped by going
// there. Where the parabola of the largest curvature has a root too, exactly one crossing lies between both,
// and the spline is monotone up to it.
//
// Most often a brick is asked about many rays of a packet at once. Their steps are then taken together: the
// processor works on all their splines at the same time, while those of one ray wait for each other.
#include "sdf/trace.h"

#include "sdf/bricks/bricks.h"
#include "sdf/place_code.h"
#include "sdf/spline.h"
#include "simd/ray_lanes.h"

namespace edgegrad::EDGEGRAD_ISA {
namespace {

// Least step in cells: crossings nearer to each other may be missed. They are only so near where a ray grazes
// the surface.
constexpr float kLeastStep = 1.0f / 128.0f;
// A crossing is refined to this many cells, the rounding of places in a brick.
constexpr float kResolved = 3e-7f;
constexpr float kMostRefinements = 24.0f;
// The search goes on so many cells behind a crossing.
constexpr float kBehind = 1e-5f;
// Fewer rays than this are traced one by one.
constexpr int kLeastTogether = 3;

// Embree's packets of n rays: arrays of n values each (embree/api.h, Ray and Hit).
struct RaysOfPacket {
    float* rays;
    uint32_t n;

    float& ray(uint32_t field, uint32_t i) const { return rays[field * n + i]; }
    void put(float* hit, uint32_t stride, uint32_t field, uint32_t i, uint32_t value) const {
        __builtin_memcpy(hit + field * stride + i, &value, 4);
    }
    // Writes a hit at a place of the grid; `stride` is the hits' number of rays.
    void write(float* hit, uint32_t stride, uint32_t at, const TracedField& field, const double (&grid)[3],
               const embree::UserArguments& args) const {
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

// The parts of rays within a brick, in grid coordinates relative to it.
template <typename L>
class RaysInBrick {
    using Real = typename L::Real;
    using Which = typename L::Which;

 public:
    // The rays from `first` on of a packet.
    RaysInBrick(const TracedField& field, const FieldBrick& brick, const RaysOfPacket& rays, uint32_t first,
                Which valid)
        : field_(field.view), brick_(brick) {
        enter(field, rays, first);
        alive_ = valid & (load(length_) > 0.0f);
        if (L::bits(alive_)) cut_by_plane();
    }

    // Calls ends(lane) with each crossing of each ray, in the order along the ray, until it returns true.
    //
    // All rays step at the same time. A ray searches until a crossing lies between two of its points, and
    // then refines it.
    template <typename Ends>
    void search(const Ends& ends) {
        if (!L::bits(alive_)) return;
        const Real length = load(length_);
        Real at = load(at_), before = at, low = at, high = at, refined = at;
        Real least, most;
        bound_curvature(least, most);
        const Real bend = larger(size_of(least), size_of(most));
        const Real cell = 1.0f / L::root(along(0, 0) + along(1, 1) + along(2, 2));
        const Real least_step = kLeastStep * cell, resolved = kResolved * cell, behind = kBehind * cell;
        Which first = alive_, inside = L::none(), refines = L::none(), bracketed = L::none();
        while (const uint32_t lanes = L::bits(alive_)) {
            Real value, slope;
            evaluate(lanes, at, value, slope);
            const Which below_zero = value < 0.0f;
            // Newton's method within the bracket of a crossing
            Which found = L::none();
            if (L::bits(alive_ & refines)) {
                const Which near = (below_zero == inside) & (value != 0.0f);
                low = refines & near ? at : low;
                high = refines & L::negated(near) ? at : high;
                const Real step = value / slope, size = size_of(step), next = at - step;
                const Which newtons = (next > low) & (next < high);
                const Which exact = size <= resolved;
                refined = refined + 1.0f;
                // The last condition but two is the error that Newton's method leaves
                const Which enough = exact | (newtons & (bend * size * size <= resolved * size_of(slope))) |
                                     (high - low <= resolved) | (refined >= kMostRefinements);
                at = refines & L::negated(exact) ? (newtons ? next : 0.5f * (low + high)) : at;
                found = alive_ & refines & enough;
            }
            // The next point of the search, or the bracket of a crossing
            const Which searches = alive_ & L::negated(refines);
            if (L::bits(searches)) {
                inside = searches & first ? below_zero : inside;
                const Which crossed = searches & L::negated(first) & (below_zero != inside);
                const Real v = size_of(value), s = inside ? -slope : slope;
                const Real least_here = inside ? -most : least, most_here = inside ? -least : most;
                // No root of the lower parabola: none of the spline
                const Real below = s * s - 2.0f * least_here * v;
                const Real safe = at + first_root(v, s, below);
                const Which over = ((least_here >= 0.0f) & (s >= 0.0f)) | (below < 0.0f) | (safe >= length) |
                                   (L::negated(first) & (at >= length));
                const Which ended = searches & L::negated(crossed) & over;
                // A root of the upper parabola: a single crossing
                const Real above = s * s - 2.0f * most_here * v;
                const Real end = at + first_root(v, s, above);
                const Which single = searches & L::negated(crossed) & L::negated(over) & (s < 0.0f) &
                                     (above > 0.0f) & (end <= length);
                const Which steps = searches & L::negated(crossed) & L::negated(over) & L::negated(single);
                low = single ? safe : crossed ? before : low;
                high = single ? end : crossed ? at : high;
                const Real next = smaller(larger(safe, at + least_step), length);
                before = steps ? at : before;
                at = single ? safe : crossed ? 0.5f * (low + high) : steps ? next : at;
                bracketed = (bracketed & L::negated(searches)) | crossed;
                refines = refines | single | crossed;
                refined = single | crossed ? Real{} : refined;
                first = first & L::negated(searches);
                alive_ = alive_ & L::negated(ended);
            }
            if (const uint32_t hits = L::bits(found)) {
                store(found_, at);
                const Real next = bracketed ? larger(at + behind, high) : at + behind;
                uint32_t left = ~0u;
                for (int i = 0; i < L::kCount; ++i)
                    if ((hits >> i & 1u) && owns(i) && ends(i)) left &= ~(1u << i);
                at = found ? next : at;
                refines = refines & L::negated(found);
                first = first | found;
                L::only(alive_, left);
                alive_ = alive_ & L::negated(found & (at >= length));
            }
        }
    }

    // The crossing that was found: its distance, and its place in the grid.
    double distance(int i) const { return start_[i] + static_cast<double>(found_[i]); }
    void place(int i, double (&grid)[3]) const {
        for (int a = 0; a < 3; ++a)
            grid[a] = static_cast<double>(from_[a][i]) +
                      static_cast<double>(found_[i]) * static_cast<double>(direction_[a][i]) +
                      brick_.first[a];
    }

 private:
    typedef float Lanes[L::kCount];

    static Real load(const Lanes& p) {
        Real r;
        __builtin_memcpy(&r, p, sizeof r);
        return r;
    }
    static void store(Lanes& p, Real a) { __builtin_memcpy(p, &a, sizeof a); }
    Real along(int a, int b) const { return load(direction_[a]) * load(direction_[b]); }

    // The smallest positive root of value + slope t + c t^2/2, with `square` = slope^2 - 2 c value >= 0.
    static Real first_root(Real value, Real slope, Real square) {
        const Real down = L::root(square) - slope;
        return down > 0.0f ? 2.0f * value / down : Real{} + 3e38f;
    }

    // Whether the place is in the brick itself, up to rounding, and not in its overlap.
    bool owns(int i) const {
        constexpr double kSlack = 4e-6;
        double grid[3];
        place(i, grid);
        bool within = true;
        for (int a = 0; a < 3; ++a)
            within = within && grid[a] >= brick_.first[a] - kSlack && grid[a] <= brick_.last[a] + kSlack;
        return within;
    }

    // Cuts the rays to the brick's box, in double precision. Rays beside it get the length 0.
    void enter(const TracedField& field, const RaysOfPacket& rays, uint32_t first_ray) {
        using Part = typename L::Part;
        constexpr int kSize = L::kCount / L::kParts;
        for (int part = 0; part < L::kParts; ++part) {
            const uint32_t lane = first_ray + static_cast<uint32_t>(part * kSize);
            const auto read = [&](uint32_t column) { return L::widen(&rays.ray(column, lane)); };
            Part origin[3], direction[3], o[3], d[3];
            for (uint32_t c = 0; c < 3; ++c) origin[c] = read(c), direction[c] = read(4 + c);
            Part first = read(3), last = read(8);
            for (int a = 0; a < 3; ++a) {
                const auto& m = field.to_grid;
                o[a] = m[0][a] * origin[0] + m[1][a] * origin[1] + (m[2][a] * origin[2] + m[3][a]);
                const Part exact = m[0][a] * direction[0] + m[1][a] * direction[1] + m[2][a] * direction[2];
                // A ray along a face of the box, whose distance to it would be 0/0, is within the box
                d[a] = exact == 0.0 ? Part{} + 1e-300 : exact;
                const Part inverse = 1.0 / d[a], t0 = (static_cast<double>(brick_.lower[a]) - o[a]) * inverse,
                           t1 = (static_cast<double>(brick_.upper[a]) - o[a]) * inverse;
                first = larger(smaller(t0, t1), first);
                last = smaller(larger(t0, t1), last);
            }
            const Part square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            const Part length = last - first;
            const int at = part * kSize;
            L::narrow((length > 0.0) & (square > 0.0) & (length < 1e30) ? length : Part{}, length_ + at);
            __builtin_memcpy(start_ + at, &first, sizeof first);
            for (int a = 0; a < 3; ++a) {
                L::narrow(o[a] + d[a] * first - static_cast<double>(brick_.first[a]), from_[a] + at);
                L::narrow(d[a], direction_[a] + at);
            }
        }
    }

    // Keeps the parts of the rays where the brick's affine function is near zero.
    void cut_by_plane() {
        Real value = Real{} + brick_.value, slope{}, length = load(length_);
        for (int a = 0; a < 3; ++a) {
            value += brick_.slope[a] * load(from_[a]);
            slope += brick_.slope[a] * load(direction_[a]);
        }
        // In the overlap the bound holds nearly.
        const float error = 1.01f * brick_.error;
        const Real size = size_of(value);
        // Rays that start outside of the slab may enter it
        const Which outside = size > error;
        const Real towards = value < 0.0f ? slope : -slope;
        const Which misses = outside & L::negated(towards * length > size - error);
        store(at_, outside ? (size - error) / towards : Real{});
        const Real leaves = (error + (slope > 0.0f ? -value : value)) / size_of(slope);
        const Real behind = outside ? (size + error) / towards : leaves;
        store(length_, behind < length ? behind : length);
        alive_ = alive_ & L::negated(misses);
    }

    void bound_curvature(Real& least, Real& most) const {
        const Real weight[6] = {along(0, 0),        along(1, 1),        along(2, 2),
                                2.0f * along(1, 2), 2.0f * along(0, 2), 2.0f * along(0, 1)};
        least = most = Real{};
        for (int n = 0; n < 6; ++n) {
            const Real low = Real{} + brick_.low[n], high = Real{} + brick_.high[n];
            least += weight[n] * (weight[n] > 0.0f ? low : high);
            most += weight[n] * (weight[n] > 0.0f ? high : low);
        }
    }

    // The spline at the distances `at`, and its slope along the rays.
    void evaluate(uint32_t lanes, Real at, Real& value, Real& slope) const {
        int32_t cell[3][L::kCount];
        Lanes place[3], values = {}, slopes = {};
        for (int a = 0; a < 3; ++a) {
            const Real p = load(from_[a]) + at * load(direction_[a]);
            const int32_t last = brick_.last[a] - brick_.first[a];
            // In the overlap the neighbouring cell is another polynomial.
            const int32_t least = brick_.first[a] > 0 ? -1 : 0;
            const int32_t most = brick_.last[a] < field_.cells(a) ? last : last - 1;
            const typename L::Index c = L::to_index(p + 2.0f, least + 2, most + 2) - 2;
            store(place[a], p - L::to_real(c));
            const typename L::Index number = c + brick_.first[a];
            __builtin_memcpy(cell[a], &number, sizeof number);
        }
        for (int i = 0; i < L::kCount; ++i) {
            if (!(lanes >> i & 1u)) continue;
            const FieldPoint f =
                spline(field_, {cell[0][i], cell[1][i], cell[2][i]}, {place[0][i], place[1][i], place[2][i]});
            values[i] = f.value;
            slopes[i] = f.gradient[0] * direction_[0][i] + f.gradient[1] * direction_[1][i] +
                        f.gradient[2] * direction_[2][i];
        }
        value = load(values), slope = load(slopes);
    }

    const FieldView& field_;
    const FieldBrick& brick_;
    double start_[L::kCount];
    Lanes from_[3], direction_[3];
    Lanes length_;  // in units of the direction's length
    Lanes at_ = {}, found_ = {};
    Which alive_;  // rays that may meet the surface
};

// Whether the surface stops a ray; the query's filter may let it pass.
bool stops(const TracedField& field, const RaysOfPacket& packet, uint32_t i, double distance,
           const double (&grid)[3], const embree::UserArguments& args) {
    const auto* context = reinterpret_cast<const BrickContext*>(args.context);
    if (!context->filter) return true;
    float ray[kRayFields], hit[kHitFields];
    for (uint32_t k = 0; k < kRayFields; ++k) ray[k] = packet.ray(k, i);
    ray[8] = static_cast<float>(distance);
    packet.write(hit, 1, 0, field, grid, args);
    int32_t valid = -1;
    const embree::FilterArguments filter{&valid, args.user, args.context, ray, hit, 1};
    context->filter(&filter);
    return valid != 0;
}

// Calls ends(field, packet, ray's number, distance, place) at the crossings of each valid ray, until it
// returns true.
//
// Two bricks round a crossing in their overlap differently. So it counts in its own brick, and once: the
// order in which Embree visits bricks does not matter.
template <typename Ends>
void for_each_crossing(const embree::UserArguments& args, const Ends& ends) {
    const auto& field = *static_cast<const TracedField*>(args.user);
    const FieldBrick& brick = field.bricks[args.primitive];
    const RaysOfPacket packet{static_cast<float*>(args.rays), args.n};
    const auto search = [&](auto& rays, uint32_t first) {
        rays.search([&](int lane) {
            double grid[3];
            rays.place(lane, grid);
            return ends(field, packet, first + static_cast<uint32_t>(lane), rays.distance(lane), grid);
        });
    };
#if EDGEGRAD_WIDTH > 1
    if (args.n == W) {
        const Mask valid = EDGEGRAD_ISA::load(args.valid) != 0;
        if (__builtin_popcount(lane_bits(valid)) >= kLeastTogether) {
            RaysInBrick<RayPacket> rays(field, brick, packet, 0, valid);
            return search(rays, 0);
        }
    }
#endif
    for (uint32_t i = 0; i < args.n; ++i) {
        if (!args.valid[i]) continue;
        RaysInBrick<OneRay> ray(field, brick, packet, i, true);
        search(ray, i);
    }
}

}  // namespace

void intersect_brick(const embree::UserArguments* args) {
    for_each_crossing(*args, [&](const TracedField& field, const RaysOfPacket& packet, uint32_t i,
                                 double exact, const double (&grid)[3]) {
        const auto distance = static_cast<float>(exact);
        if (!(distance > packet.ray(3, i))) return false;
        if (!(distance < packet.ray(8, i))) return true;
        packet.ray(8, i) = distance;
        packet.write(packet.rays + kRayFields * args->n, args->n, i, field, grid, *args);
        return true;
    });
}

void occlude_brick(const embree::UserArguments* args) {
    for_each_crossing(*args, [&](const TracedField& field, const RaysOfPacket& packet, uint32_t i,
                                 double distance, const double (&grid)[3]) {
        if (!stops(field, packet, i, distance, grid, *args)) return false;
        packet.ray(8, i) = -__builtin_inff();
        return true;
    });
}

}  // namespace edgegrad::EDGEGRAD_ISA
