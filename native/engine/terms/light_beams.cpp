#include "engine/terms/light_beams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "boundary/meshes/placed_vertex.h"
#include "boundary/samples/sample_plan.h"
#include "engine/decisions/decisions.h"
#include "engine/terms/found_edges.h"
#include "engine/terms/mirror_faces.h"
#include "scene/sharp_lobes.h"
#include "tasks/block_sizes.h"
#include "tasks/kernel_table.h"
#include "tasks/seed_tags.h"
#include "util/double_vector.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Cells along the longest side of the grid.
constexpr double kCells = 32.0;
// The least width of directions to a target, 1 - cos.
constexpr double kLeastWidth = 1e-7;
// Directions of beams are sampled in cells where they fill a smaller solid angle.
constexpr double kWide = 0.3;

struct Beam {
    Vector light, last, first, end;
    double weight, distance;  // as in BeamPaths

    bool is_distant() const { return !(distance < std::numeric_limits<double>::infinity()); }
};

// Appends the beams of a pilot with samples on these faces.
void trace_beams(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                 Candidates faces, double samples, std::vector<Beam>& out) {
    if (faces.size() == 0) return;
    SamplePlan plan(shared(std::move(faces)), samples, samples, options, kCausticOutline, false);
    const int64_t count = plan.total(0), chunks = (count + kBoundaryChunk - 1) / kBoundaryChunk;
    std::vector<float> columns[14];
    for (auto& c : columns) c.resize(static_cast<size_t>(chunks * kBoundaryChunk));
    parallel_for(edges.threads, chunks, {}, [&](int, int64_t chunk) {
        const int64_t first = chunk * kBoundaryChunk;
        const auto at = [&](size_t k) { return columns[k].data() + first; };
        BeamPaths paths{{at(0), at(1), at(2)},
                        {at(3), at(4), at(5)},
                        {at(6), at(7), at(8)},
                        {at(9), at(10), at(11)},
                        at(12),
                        at(13)};
        const BoundaryTask task = plan.task(0, first, std::min(kBoundaryChunk, count - first));
        edges.kernels.light_beams(scene, task, paths);
    });
    for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
        const auto point = [&](size_t k) {
            return Vector{columns[k][i], columns[k + 1][i], columns[k + 2][i]};
        };
        const Beam b{point(0), point(3), point(6), point(9), columns[12][i], columns[13][i]};
        const Vector all = b.light + b.last + b.first + b.end;
        if (b.weight > 0.0 && std::isfinite(b.weight + all.x + all.y + all.z)) out.push_back(b);
    }
}

// A number in (0, 1) for each beam and cell, by a hash (lowbias32).
double random_number(size_t beam, size_t cell) {
    auto x = static_cast<uint32_t>(beam * 0x9e3779b9u + cell * 0x85ebca6bu);
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return (static_cast<double>(x ^ (x >> 16)) + 0.5) * 0x1p-32;
}

// 1 - cos of the angle between two unit vectors.
double apart(Vector a, Vector b) {
    const Vector d = a - b;
    return 0.5 * dot(d, d);
}

// The ends of a candidate's part of its edge.
struct Ends {
    Vector a, b;
};
Ends ends_of(const SceneView& scene, const Candidates& edges, size_t i) {
    const Placement place = Placement::of(scene, edges.instance.empty() ? -1 : edges.instance[i]);
    const auto end = [&](int64_t k) {
        return place(
            vertex(scene, static_cast<int64_t>(scene.edge_vertices[2 * int64_t{edges.edge[i]} + k])));
    };
    const Vector a = end(0), way = end(1) - a;
    return {a + way * static_cast<double>(edges.u0[i]), a + way * static_cast<double>(edges.u1[i])};
}

// Whether all faces of an edge may have perfect lobes. Beams that pass it on their way begin or end at its
// own faces mostly, which it does not hide.
bool is_of_mirror(const SceneView& scene, const std::vector<uint8_t>& bends, int32_t edge) {
    for (uint32_t k = scene.edge_face_first[edge]; k < scene.edge_face_first[edge + 1]; ++k)
        if (!bends[static_cast<size_t>(scene.face_material[scene.edge_faces[k]])]) return false;
    return true;
}

Vector direction(Vector from, Vector to) {
    const Vector way = to - from;
    return way * (1.0 / std::max(length(way), 1e-30));
}

}  // namespace

// Fills the cells of a grid with the beams that pass through them.
class BeamGridBuilder {
 public:
    BeamGridBuilder(const SceneView& scene, const FoundEdges& found, const std::vector<uint8_t>& bends,
                    const std::vector<Beam>& beams, int threads)
        : beams_(beams), threads_(threads) {
        place();
        mark(scene, *found.whole, bends);
        if (found.windows) mark(scene, *found.windows, bends);
    }

    // Beams pass from `from(beam)` to `to(beam)`. `candidates(beam)` are points at which directions may be
    // aimed from the cells that it passes; those about which the directions of a cell vary least are taken.
    template <typename From, typename To, typename Points>
    BeamGrid fill(const From& from, const To& to, const Points& candidates);

 private:
    struct Kept {
        size_t at = 0;  // cell
        double flux = 0.0;
        double key[kBeamTargets];
        int32_t beam[kBeamTargets];
        int32_t count = 0;
    };

    void place();
    void mark(const SceneView& scene, const Candidates& edges, const std::vector<uint8_t>& bends);
    void keep(Kept& cell, double key, int32_t beam) const;
    template <typename Visit>
    void visit_cells(Vector a, Vector b, const Visit& visit) const;
    Vector middle(size_t cell) const;
    bool aim(Vector middle, const std::vector<std::vector<Vector>>& choices, float* targets) const;

    const std::vector<Beam>& beams_;
    const int threads_;
    BeamGrid grid_;
    std::vector<uint8_t> marked_;  // cells with edges
};

// Places the grid about most ends of beams.
void BeamGridBuilder::place() {
    constexpr double kOutside = 0.02, kMargin = 0.25;
    std::array<double, 3> size{};
    double longest = 0.0;
    for (size_t axis = 0; axis < 3; ++axis) {
        std::vector<double> x;
        const auto add = [&](Vector p) { x.push_back(axis == 0 ? p.x : axis == 1 ? p.y : p.z); };
        for (const Beam& b : beams_) {
            add(b.last), add(b.first), add(b.end);
            if (!b.is_distant()) add(b.light);
        }
        const auto outside = static_cast<ptrdiff_t>(kOutside * static_cast<double>(x.size() - 1));
        const auto nth = [&](ptrdiff_t n) {
            std::nth_element(x.begin(), x.begin() + n, x.end());
            return x[static_cast<size_t>(n)];
        };
        const double low = nth(outside), high = nth(static_cast<ptrdiff_t>(x.size()) - 1 - outside);
        grid_.low_[axis] = low - kMargin * (high - low);
        size[axis] = (1.0 + 2.0 * kMargin) * (high - low);
        longest = std::max(longest, size[axis]);
    }
    grid_.side_ = std::max(longest, 1e-30) / kCells;
    for (size_t axis = 0; axis < 3; ++axis) {
        grid_.count_[axis] = std::max(1, static_cast<int32_t>(std::ceil(size[axis] / grid_.side_)));
        grid_.low_[axis] -= 0.5 * (grid_.count_[axis] * grid_.side_ - size[axis]);
    }
    const auto cells = static_cast<size_t>(grid_.count_[0]) * static_cast<size_t>(grid_.count_[1]) *
                       static_cast<size_t>(grid_.count_[2]);
    grid_.slot_.assign(cells, -1);
    marked_.assign(cells, 0);
}

void BeamGridBuilder::mark(const SceneView& scene, const Candidates& edges,
                           const std::vector<uint8_t>& bends) {
    for (size_t i = 0; i < edges.edge.size(); ++i) {
        if (i % 4096 == 0) may_cancel();
        if (is_of_mirror(scene, bends, edges.edge[i])) continue;
        const Ends ends = ends_of(scene, edges, i);
        visit_cells(ends.a, ends.b, [&](size_t cell) { marked_[cell] = 1; });
    }
}

Vector BeamGridBuilder::middle(size_t cell) const {
    double at[3];
    for (size_t k = 0; k < 3; ++k) {
        const auto along = static_cast<size_t>(grid_.count_[k]);
        at[k] = grid_.low_[k] + (static_cast<double>(cell % along) + 0.5) * grid_.side_;
        cell /= along;
    }
    return {at[0], at[1], at[2]};
}

// Calls visit(cell) for each cell that the segment from a to b passes, but for corners that it clips.
template <typename Visit>
void BeamGridBuilder::visit_cells(Vector a, Vector b, const Visit& visit) const {
    const double start[3] = {a.x, a.y, a.z}, way[3] = {b.x - a.x, b.y - a.y, b.z - a.z};
    double near = 0.0, far = 1.0, longest = 0.0;
    for (size_t k = 0; k < 3; ++k) {
        const double high = grid_.low_[k] + grid_.count_[k] * grid_.side_;
        longest = std::max(longest, std::abs(way[k]));
        if (std::abs(way[k]) < 1e-30) {
            if (start[k] < grid_.low_[k] || start[k] > high) return;
            continue;
        }
        const double p = (grid_.low_[k] - start[k]) / way[k], q = (high - start[k]) / way[k];
        near = std::max(near, std::min(p, q)), far = std::min(far, std::max(p, q));
    }
    if (!(near < far)) return;
    const double step = 0.5 * grid_.side_ / std::max(longest, 1e-30);
    int64_t before = -1;
    for (double t = near + 0.5 * std::min(step, far - near); t < far; t += step) {
        int64_t cell = 0;
        for (size_t k = 3; k-- > 0;) {
            const auto i = static_cast<int64_t>((start[k] + t * way[k] - grid_.low_[k]) / grid_.side_);
            cell = cell * grid_.count_[k] + std::clamp<int64_t>(i, 0, grid_.count_[k] - 1);
        }
        if (cell != before) visit(static_cast<size_t>(cell));
        before = cell;
    }
}

// Keeps the beams with the smallest keys: a random choice by weight (Efraimidis and Spirakis 2006).
void BeamGridBuilder::keep(Kept& cell, double key, int32_t beam) const {
    if (cell.count < kBeamTargets) {
        cell.key[cell.count] = key, cell.beam[cell.count++] = beam;
        return;
    }
    double* last = std::max_element(cell.key, cell.key + kBeamTargets);
    if (key < *last) cell.beam[last - cell.key] = beam, *last = key;
}

// Writes the targets of a cell. choices[c][k]: candidate c of beam k. Returns whether directions are aimed.
bool BeamGridBuilder::aim(Vector middle, const std::vector<std::vector<Vector>>& choices,
                          float* targets) const {
    const size_t n = choices.front().size();
    const std::vector<Vector>* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    std::vector<Vector> ways(n);
    // Choose the points that lie closest together. Near points show the cell's size alone.
    for (const auto& points : choices) {
        double sum = 0.0;
        for (size_t i = 0; i < n; ++i) ways[i] = direction(middle, points[i]);
        for (size_t i = 0; i < n; ++i) {
            const double distance = length(points[i] - middle);
            double nearest = 2.0;
            for (size_t j = 0; j < n; ++j)
                if (j != i) nearest = std::min(nearest, apart(ways[i], ways[j]));
            if (distance < 2.0 * grid_.side_) nearest = 2.0;
            sum += std::log(nearest + kLeastWidth);
        }
        if (!best || sum < least) best = &points, least = sum;
    }
    for (size_t i = 0; i < n; ++i) ways[i] = direction(middle, (*best)[i]);
    // A peak reaches to its third neighbour
    constexpr size_t kReach = 3;
    std::vector<double> off;
    double solid_angle = 0.0;
    for (size_t i = 0; i < static_cast<size_t>(kBeamTargets); ++i) {
        const size_t k = i % n;
        off.clear();
        for (size_t j = 0; j < n; ++j)
            if (j != k) off.push_back(apart(ways[k], ways[j]));
        std::sort(off.begin(), off.end());
        const double cell = grid_.side_ / std::max(length((*best)[k] - middle), grid_.side_);
        const double width = off.size() < kReach ? 0.1 * cell * cell : off[kReach - 1];
        if (off.size() >= kReach && i < n) solid_angle += 6.2831853 / kReach * width;
        const Vector p = (*best)[k];
        const double row[4] = {p.x, p.y, p.z, std::clamp(width, kLeastWidth, 1.0)};
        for (size_t c = 0; c < 4; ++c) targets[4 * i + c] = static_cast<float>(row[c]);
    }
    return solid_angle < kWide;
}

template <typename From, typename To, typename Points>
BeamGrid BeamGridBuilder::fill(const From& from, const To& to, const Points& candidates) {
    BeamGrid out = grid_;
    std::vector<Kept> cells;
    for (size_t b = 0; b < beams_.size(); ++b) {
        if (b % 256 == 0) may_cancel();
        const Beam& beam = beams_[b];
        visit_cells(from(beam), to(beam), [&](size_t at) {
            if (!marked_[at]) return;
            int32_t& slot = out.slot_[at];
            if (slot < 0) slot = static_cast<int32_t>(cells.size()), cells.emplace_back().at = at;
            Kept& cell = cells[static_cast<size_t>(slot)];
            cell.flux += beam.weight;
            keep(cell, -std::log(random_number(b, at)) / beam.weight, static_cast<int32_t>(b));
        });
    }
    constexpr size_t kRow = size_t{4} * kBeamTargets, kBlock = 64;
    out.targets_.resize(cells.size() * kRow), out.flux_.resize(cells.size());
    std::vector<uint8_t> aims(cells.size());
    parallel_for(threads_, static_cast<int64_t>((cells.size() + kBlock - 1) / kBlock), {},
                 [&](int, int64_t block) {
                     const size_t first = static_cast<size_t>(block) * kBlock;
                     std::vector<std::vector<Vector>> choices;
                     for (size_t slot = first; slot < std::min(first + kBlock, cells.size()); ++slot) {
                         const Kept& cell = cells[slot];
                         choices.clear();
                         for (int32_t k = 0; k < cell.count; ++k) {
                             const auto points = candidates(beams_[static_cast<size_t>(cell.beam[k])]);
                             choices.resize(points.size());
                             for (size_t c = 0; c < points.size(); ++c) choices[c].push_back(points[c]);
                         }
                         out.flux_[slot] = cell.flux;
                         aims[slot] = aim(middle(cell.at), choices, out.targets_.data() + slot * kRow);
                     }
                 });
    // Slots of cells that aim nowhere keep their flux alone
    for (size_t slot = 0; slot < cells.size(); ++slot)
        if (!aims[slot]) out.targets_[slot * kRow + 3] = 0.0f;
    return out;
}

BeamGridView BeamGrid::view() const {
    BeamGridView v{};
    if (targets_.empty()) return v;
    v.slot = slot_.data(), v.targets = targets_.data();
    v.inverse = static_cast<float>(1.0 / side_);
    for (size_t k = 0; k < 3; ++k) v.low[k] = static_cast<float>(low_[k]), v.count[k] = count_[k];
    return v;
}

int64_t BeamGrid::cell_of(Vector p) const {
    const double at[3] = {p.x, p.y, p.z};
    int64_t cell = 0;
    for (size_t k = 3; k-- > 0;) {
        const double i = std::floor((at[k] - low_[k]) / side_);
        if (!(i >= 0.0 && i < count_[k])) return -1;
        cell = cell * count_[k] + static_cast<int64_t>(i);
    }
    return cell;
}

double BeamGrid::flux(Vector p) const {
    const int64_t cell = cell_of(p);
    const int32_t slot = cell < 0 ? -1 : slot_[static_cast<size_t>(cell)];
    return slot < 0 ? 0.0 : flux_[static_cast<size_t>(slot)];
}

Candidates LightBeams::weighted(const BeamGrid& grid, double by_flux, const SceneView& scene,
                                const Candidates& edges) const {
    constexpr double kMostParts = 64.0;
    Candidates out;
    std::vector<double> mass, flux;
    double all_flux = 0.0;
    for (size_t i = 0; i < edges.edge.size(); ++i) {
        if (i % 4096 == 0) may_cancel();
        const Ends ends = ends_of(scene, edges, i);
        const bool of_mirror = is_of_mirror(scene, bends_, edges.edge[i]);
        const double own = edges.cumulative[i + 1] - edges.cumulative[i];
        const double size = of_mirror ? 0.0 : length(ends.b - ends.a);
        const int parts = static_cast<int>(std::clamp(std::ceil(size / grid.side()), 1.0, kMostParts));
        const auto place = [&](double at) {
            return at == parts ? edges.u1[i]
                               : edges.u0[i] + (edges.u1[i] - edges.u0[i]) * static_cast<float>(at / parts);
        };
        double before = -1.0;
        for (int part = 0; part < parts; ++part) {
            const double here =
                of_mirror ? 0.0 : grid.flux(ends.a + (ends.b - ends.a) * ((part + 0.5) / parts));
            if (part == 0 || here != before) {
                out.edge.push_back(edges.edge[i]);
                if (!edges.instance.empty()) out.instance.push_back(edges.instance[i]);
                out.u0.push_back(place(part)), out.u1.push_back(place(part));
                mass.push_back(0.0), flux.push_back(0.0);
            }
            before = here;
            out.u1.back() = place(part + 1.0);
            mass.back() += own / parts, flux.back() += here * own / parts;
            all_flux += here * own / parts;
        }
    }
    if (all_flux == 0.0) by_flux = 0.0;
    const double unit = all_flux > 0.0 ? by_flux * edges.mass() / all_flux : 0.0;
    for (size_t i = 0; i < mass.size(); ++i)
        out.cumulative.push_back(out.cumulative.back() + (1.0 - by_flux) * mass[i] + unit * flux[i]);
    return out;
}

std::shared_ptr<const LightBeams> LightBeams::find(const SceneView& scene, const EdgeList& edges,
                                                   const RenderOptions& options, const FoundEdges& found,
                                                   double samples) {
    RenderOptions own = options;
    own.seed ^= kBeamSeed;
    std::vector<uint8_t> bends =
        marked_materials(edges.tables, [&](size_t k) { return may_be_specular(edges.tables, k); });
    std::vector<Beam> beams;
    for (const bool lit : {false, true}) {
        own.seed ^= static_cast<uint32_t>(lit) << 31;
        trace_beams(scene, edges, own, mirror_faces(scene, edges.tables, lit), 0.5 * samples, beams);
    }
    if (beams.empty()) return nullptr;
    BeamGridBuilder builder(scene, found, bends, beams, edges.threads);
    BeamGrid lights =
        builder.fill([](const Beam& b) { return b.last; }, [](const Beam& b) { return b.light; },
                     [](const Beam& b) { return std::array<Vector, 2>{b.light, b.last}; });
    // What flat mirrors show is as far behind them as it is before them
    BeamGrid mirrors = builder.fill(
        [](const Beam& b) { return b.first; }, [](const Beam& b) { return b.end; },
        [](const Beam& b) {
            const Vector back = direction(b.end, b.first);
            const double whole = length(b.light - b.last) + length(b.first - b.last);
            return std::array<Vector, 3>{b.first, b.first + back * (0.3 * whole), b.first + back * whole};
        });
    return std::shared_ptr<const LightBeams>(
        new LightBeams(std::move(lights), std::move(mirrors), std::move(bends)));
}

}  // namespace edgegrad
