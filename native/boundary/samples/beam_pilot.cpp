#include "boundary/samples/beam_pilot.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "boundary/meshes/trees/placement.h"
#include "boundary/samples/sample_plan.h"
#include "tasks/block_sizes.h"
#include "tasks/seed_tags.h"
#include "util/double_vector.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Appends the beams of a pilot with samples on these faces.
void trace_beams(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                 const std::shared_ptr<const Candidates>& faces, double samples, std::vector<Beam>& out) {
    if (faces->size() == 0) return;
    SamplePlan plan(faces, samples, samples, options, kCausticOutline, false);
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

// The ends of a candidate's part of its edge.
EdgeEnds ends_of(const SceneView& scene, const Candidates& edges, size_t i) {
    const Placement place = Placement::of(scene, edges.instance.empty() ? -1 : edges.instance[i]);
    const auto [a, b] = EdgeEnds::of(scene, place, edges.edge[i]);
    const Vector way = b - a;
    return {a + way * static_cast<double>(edges.u0[i]), a + way * static_cast<double>(edges.u1[i])};
}

// Whether all faces of an edge may have perfect lobes. Beams that pass it on their way begin or end at its
// own faces mostly, which it does not hide.
bool is_of_mirror(const SceneView& scene, const std::vector<uint8_t>& bends, int32_t edge) {
    for (uint32_t k = scene.edge_face_first[edge]; k < scene.edge_face_first[edge + 1]; ++k)
        if (!bends[static_cast<size_t>(scene.face_material[scene.edge_faces[k]])]) return false;
    return true;
}

}  // namespace

Candidates LightBeams::weighted(const BeamGrid& grid, double by_flux, const SceneView& scene,
                                const Candidates& edges) const {
    constexpr double kMostParts = 64.0;
    Candidates out;
    std::vector<double> mass, flux;
    double all_flux = 0.0;
    for (size_t i = 0; i < edges.edge.size(); ++i) {
        if (i % 4096 == 0) may_cancel();
        const EdgeEnds ends = ends_of(scene, edges, i);
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
                                                   const RenderOptions& options,
                                                   const std::array<SharedCandidates, 2>& mirrors,
                                                   const std::vector<SharedCandidates>& found,
                                                   std::vector<uint8_t> bends, double samples) {
    RenderOptions own = options;
    std::vector<Beam> beams;
    for (uint32_t k = 0; k < mirrors.size(); ++k) {
        own.seed = options.seed ^ kBeamSeed ^ (k << 31);
        trace_beams(scene, edges, own, mirrors[k], 0.5 * samples, beams);
    }
    if (beams.empty()) return nullptr;
    BeamGridBuilder builder(beams, edges.threads);
    for (const auto& list : found) {
        for (size_t i = 0; i < list->edge.size(); ++i) {
            if (i % 4096 == 0) may_cancel();
            if (is_of_mirror(scene, bends, list->edge[i])) continue;
            const EdgeEnds ends = ends_of(scene, *list, i);
            builder.mark(ends.a, ends.b);
        }
    }
    BeamGrid towards_lights =
        builder.fill([](const Beam& b) { return b.last; }, [](const Beam& b) { return b.light; },
                     [](const Beam& b) { return std::array<Vector, 3>{b.light, b.last, b.last}; });
    // What flat mirrors show is as far behind them as it is before them
    BeamGrid towards_mirrors = builder.fill(
        [](const Beam& b) { return b.first; }, [](const Beam& b) { return b.end; },
        [](const Beam& b) {
            const Vector ray = b.first - b.end, back = ray * (1.0 / std::max(length(ray), 1e-30));
            const double whole = length(b.light - b.last) + length(b.first - b.last);
            return std::array<Vector, 3>{b.first, b.first + back * (0.3 * whole), b.first + back * whole};
        });
    return std::shared_ptr<const LightBeams>(
        new LightBeams(std::move(towards_lights), std::move(towards_mirrors), std::move(bends)));
}

}  // namespace edgegrad
