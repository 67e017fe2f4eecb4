#include "engine/terms/specular_term.h"

#include <algorithm>

#include "engine/chain_sweeps.h"
#include "scene/camera_row.h"
#include "scene/sharp_lobes.h"
#include "tasks/boundary_task.h"
#include "tasks/dropped_samples.h"
#include "tasks/seed_tags.h"
#include "tasks/splats.h"

namespace edgegrad {
namespace {

// Lines of each direction per pixel and sample of the picture. A segment costs about as much as a sample.
constexpr double kLines = 0.14;

}  // namespace

bool moves_chains(const SceneTables& t, const Requested& requested) {
    return requested.any(FloatTable::kVertices) || requested.any(FloatTable::kCamera) ||
           requested.any(FloatTable::kInstances) || requested.moves_fields() || bends_chains(t, requested);
}

bool bends_chains(const SceneTables& t, const Requested& requested) {
    if (requested.any(FloatTable::kNormals)) return true;
    // Of a closure's floats, the index and the normal map change the directions of rays.
    constexpr uint64_t bending =
        Requested::columns(kIor, kIor + 1) | Requested::columns(kNormalMap, kNormalStrength + 1);
    const Requested::Span rows = requested.span(FloatTable::kClosures);
    const bool bends = (rows.columns & bending) != 0;
    const bool textures = requested.textures();
    for (size_t closure = 0; closure < t.closure_flags.size(); ++closure) {
        if (!may_be_specular(t, closure)) continue;
        if (bends && rows.first < (closure + 1) * kMaterialParams && rows.last > closure * kMaterialParams)
            return true;
        if (textures && closure < t.textures.closure_program.size() &&
            t.textures.closure_program[closure] >= 0)
            return true;
    }
    return false;
}

std::unique_ptr<SpecularTerm> SpecularTerm::of(const SceneView& scene, const SceneTables& tables,
                                               const RenderOptions& options, EdgeCache& kept,
                                               Decisions& decided) {
    constexpr Part kAll[] = {Part::kMirroredEdges, Part::kMirroredShadows, Part::kMirroredLight,
                             Part::kMirroredOutlines};
    const Parts parts{decided.computes(kAll[0]), decided.computes(kAll[1]), decided.computes(kAll[2]),
                      decided.computes(kAll[3])};
    if (!(parts.edges || parts.lights || parts.surfaces || parts.outlines)) return nullptr;
    const FilmRectangle film = specular_bounds(scene, tables);
    if (film.empty()) {
        for (const Part part : kAll)
            if (decided.computes(part)) decided.none(part, Reason::kOutOfView);
        return nullptr;
    }
    if (decided.alone()) return nullptr;
    return std::unique_ptr<SpecularTerm>(new SpecularTerm(
        scene, options, kept.regions.get(true, [&] { return surface_regions(tables); }), film, parts));
}

SpecularTerm::SpecularTerm(const SceneView& scene, const RenderOptions& options,
                           std::shared_ptr<const SurfaceRegions> regions, const FilmRectangle& film,
                           Parts parts)
    : SampledTerm(kPrimaryTerm, parts.edges      ? Part::kMirroredEdges
                                : parts.lights   ? Part::kMirroredShadows
                                : parts.surfaces ? Part::kMirroredLight
                                                 : Part::kMirroredOutlines),
      options_(options),
      regions_(std::move(regions)),
      parts_(parts),
      plan_(film, kLines * options.samples, options.two_passes, options.seed ^ kScanLineSeed),
      sizes_(static_cast<size_t>(plan_.passes() > 1 ? chunks(0) : 0)) {
    const CameraView& c = scene.camera;
    if (c.kind == kEquirectangular) {
        for (int k = 0; k < 2; ++k) {
            shift_[0][kCameraPanorama + k] = (c.panorama[1] - c.panorama[0]) / c.full_width;
            shift_[1][kCameraPanorama + 2 + k] = (c.panorama[3] - c.panorama[2]) / c.full_height;
        }
    } else {
        shift_[0][kCameraPrincipal] = shift_[1][kCameraPrincipal + 1] = 1.0;
    }
}

void SpecularTerm::run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) {
    if (run.is_forward()) std::fill_n(run.splats.x, count, kNowhere);
    // Find intersections of scan lines with the images of edges
    ScanTask scan = plan_.task(pass, first, count);
    scan.region = regions_->region.data(), scan.face_edge = regions_->face_edge.data();
    scan.next_on_side = regions_->next_on_side.empty() ? nullptr : regions_->next_on_side.data();
    scan.edges = parts_.edges, scan.lights = parts_.lights, scan.surfaces = parts_.surfaces;
    scan.outlines = parts_.outlines;
    scan.limits = options_.limits, scan.max_depth = options_.max_depth;
    ChainSweeps sweeps(run);
    ChainCrossings& c = sweeps.crossings();
    const int found = run.kernels.scan(run.scene, scan, c);
    if (found == 0) return;
    // Evaluate the jumps of radiance there
    sweeps.set_count(found);
    BoundaryTask sides{};
    sides.first = first, sides.count = found;
    sides.max_depth = options_.max_depth;
    sides.seed = scan.seed;
    sides.limits = options_.limits;
    sides.dropped = &lost;
    run.kernels.chain_sides(run.scene, sides, run.work(), sweeps.vertices(), c, found);
    for (int k = 0; k < 2; ++k) sweeps.differentiate_by_place(shift_[k], c.by_screen[k]);
    run.kernels.chain_sweeps(sides, c, found);
    scan.guides ? note_sizes(first, sweeps) : sweeps.differentiate();
}

// Of the first pass: each chunk writes to its own entry of sizes_, by which the second pass is distributed.
void SpecularTerm::note_sizes(int64_t first, const ChainSweeps& sweeps) {
    std::vector<IntersectionSize>& sizes = sizes_[static_cast<size_t>(first / kBoundaryChunk)];
    for (int i = 0; i < sweeps.count(); ++i)
        if (const float size = sweeps.size(i); size > 0.0f)
            sizes.push_back({(first + sweeps.crossings().segment[i]) / plan_.line_segments(), size});
}

}  // namespace edgegrad
