#include "engine/derivative_call.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "boundary/meshes/solids.h"
#include "engine/followed_lobes_rule.h"
#include "engine/interior_rules.h"
#include "engine/missing_parts.h"
#include "engine/terms/curve_terms.h"
#include "engine/transparent_closures.h"
#include "scene/sharp_lobes.h"
#include "tasks/adjoint_task.h"
#include "tasks/block_sizes.h"
#include "tasks/boundary_kind.h"
#include "tasks/dropped_samples.h"
#include "tasks/horizon_task.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad {

namespace {

// Horizon samples per pixel and sample of the picture. As many as the picture's have 1/20 of the noise of the
// interior term under a rectangle or a sphere, 1/12 under an emissive mesh, 1/6 under the sky, and cost twice
// its time.
constexpr double kHorizonShare = 0.125;

// Paths that look for rims, per pixel and sample of the picture: at equal numbers they cost as much as the
// interior term's, and have less noise.
constexpr double kRimShare = 0.5;

// Segments of scan lines, by sample of the picture, beyond which the interior term of motions takes half of
// the samples. Where mirrors and glass fill so much of the picture, its paths take twice as long to derive as
// to follow, and the lines as long again: glass_sphere's interior and primary terms took 4.2 pictures, and
// take 2.4. With twice the samples the noise is what it was, and so are the seconds.
constexpr double kManySegments = 0.25;

// A light's strength has a derivative even where it is zero.
bool requests_dark_lights(const Requested& requested) {
    constexpr uint64_t emission = Requested::columns(kEmission, kEmission + 3);
    return requested.any("light_params") ||
           (requested.any("closure_params") && (requested.span("closure_params").columns & emission) != 0);
}

// Where nothing but strengths of lights of the table is asked for, and of the environment, light of all
// others has no derivative: the rows that samples are to be spent on. Else none.
std::vector<uint8_t> lights_alone(const SceneTables& tables, const Requested& requested) {
    const auto& spans = requested.spans();
    const bool alone = requested.any("light_params") && !requested.moves_lights() &&
                       spans.size() == 1 + static_cast<size_t>(requested.any("environment"));
    std::vector<uint8_t> rows(alone ? tables.lights.kind.size() : 0);
    for (size_t k = 0; k < rows.size(); ++k)
        rows[k] = requested.any("light_params", k * kLightParams, (k + 1) * kLightParams);
    return rows;
}

// What boundary terms see of the tables' derivatives.
RequestedMotion requested_motion(const CameraView& camera, const Requested& requested) {
    return {requested.moving(),
            moves_rays(camera, requested),
            requested.any("instance_to_world"),
            requested.moves_lights(),
            requested.any("environment_rotation"),
            requested.any("environment") || requested.any("environment_pixels")};
}

// The options with a term's samples per pixel, of those that are counted by pixel.
RenderOptions of_term(RenderOptions options, const LearnedSampling* learned, DerivativeTerm term) {
    if (learned)
        options.samples =
            std::max(1, static_cast<int32_t>(std::lround(learned->share[term] * options.samples)));
    return options;
}

RenderOptions horizon_options(RenderOptions options) {
    options.samples = std::max(1, static_cast<int>(std::lround(kHorizonShare * options.samples)));
    options.seed ^= 0x1f83d9abu;
    return options;
}

RenderOptions rim_options(RenderOptions options) {
    options.samples = std::max(1, static_cast<int>(std::lround(kRimShare * options.samples)));
    options.seed ^= 0x9b05688cu;
    return options;
}

}  // namespace

Engine::DerivativeCall::DerivativeCall(const Engine& e, const RenderOptions& options,
                                       const Requested& requested_of, LearnedSampling* learned)
    : engine(e),
      requested(requested_of),
      sides(solid_sides(*e.bodies(), e.tables_.camera)),
      decided(options.force),
      motion(requested_motion(e.tables_.camera, requested)),
      geometry(requested.geometry() || moves_chains(e.tables_, requested)),
      lights(e.lights_for(requested)),
      prepared(e.api_, *e.bvh_, e.tables_, &motion, e.hides_no_light(), lights,
               options.max_depth > 1 ? e.follow(motion, sides, lights) : 0.0f),
      scene(prepared.view()),
      plan(interior_plan(of_term(options, learned, kInteriorTerm))),
      horizon(scene.camera, horizon_options(of_term(options, learned, kShadowTerm)), kHorizonPaths),
      rims(ImagePlan(scene.camera, rim_options(of_term(options, learned, kInteriorTerm)), kRecordedPaths)
               .sharing()),
      tables(differentiable_tables(scene, e.tables_)),
      passed(transparent_closures(scene, e.tables_, requested, geometry)),
      surfaces(requested_surfaces(scene, e.tables_, requested, passed)),
      values_alone(requested.values_alone(scene)),
      learns(learned) {
    if (options.interior) decide_interior(options);
    const bool nothing_between = options.indirect && options.max_depth >= 3 && e.hides_no_surface();
    const BoundaryFacts facts{scene,          e.tables_, options, motion, moves_chains(e.tables_, requested),
                              nothing_between};
    decide_boundaries(facts, decided);
    note_missing(facts, requested, e.closed_, e.threads_, decided);
    if (std::any_of(std::begin(kPartOf), std::end(kPartOf), [&](Part p) { return decided.computes(p); })) {
        const auto normals = e.normals();
        const std::vector<uint8_t> clear = e.clear_emitters(*lights);
        terms = boundary_terms(scene,
                               {e.tables_, sides.data(), e.closed_, clear, normals->data(), e.kernels_,
                                e.threads_, lights, e.kept_},
                               options, motion, e.guided_, e.aimed_, learned, decided);
    }
    if (decided.computes(Part::kHorizons) || decided.computes(Part::kIndirectHorizons))
        horizon_chunks = horizon.chunks;
    specular = SpecularTerm::of(scene, e.tables_, of_term(options, learned, kPrimaryTerm), e.guided_, e.kept_,
                                decided);
    for (int pass = 0; specular && pass < specular->passes(); ++pass)
        boundary_chunks += specular->chunks(pass);
    if (specular && image_chunks > 0 && !learns && requests_motion_alone() &&
        static_cast<double>(specular->total()) >
            kManySegments * static_cast<double>(plan.pixels) * options.samples)
        divide_interior(2);
    if (image_chunks > 0 && geometry) {
        edge_on = EdgeOnTerm::of(scene, e.tables_, sides, plan.options, motion, e.threads_);
        decided.decide(Part::kEdgeOn, edge_on ? Reason::kNeeded : Reason::kNone);
    }
    if (edge_on) boundary_chunks += edge_on->chunks();
    for (const BoundaryTerm& term : terms)
        for (int pass = 0; pass < term.plan.passes(); ++pass) boundary_chunks += term.plan.chunks(pass);
}

void Engine::DerivativeCall::decide_interior(const RenderOptions& options) {
    if (decided.decide(Part::kInterior,
                       constant_shading(scene, engine.tables_, requested, options.max_depth)))
        image_chunks = plan.chunks;
    const bool shaded = image_chunks > 0;
    const Reason rims_needed = options.max_depth < 2                          ? Reason::kNotRendered
                               : !shaded                                      ? Reason::kStill
                               : !rims_move(scene, engine.tables_, requested) ? Reason::kStill
                                                                              : Reason::kNeeded;
    if (decided.decide(Part::kRims, rims_needed)) {
        rim_chunks = rims.chunks;
        decided[Part::kRims].materials = used_materials(
            engine.tables_, [&](size_t closure) { return may_refract_roughly(engine.tables_, closure); });
    }
    decided.decide(Part::kContact, scene.mesh_contact && shaded ? Reason::kNeeded : Reason::kNone);
    decided.decide(Part::kTransparency, passed.empty() || !shaded ? Reason::kNone : Reason::kNeeded);
    if (!passed.empty())
        decided[Part::kTransparency].materials =
            used_materials(engine.tables_, [&](size_t closure) { return passed[closure] != 0; });
}

AdjointTask Engine::DerivativeCall::recording(const ImageTask& task, Workspace& work,
                                              AdjointWorkspace& adjoint,
                                              const DifferentiableTables& of) const {
    AdjointTask sweep = adjoint.task(task, work);
    sweep.tables = &of;
    sweep.geometry = geometry;
    sweep.camera_moves = requested.any("camera");
    work.vertices->geometry = sweep.geometry;
    work.vertices->misses = misses_change();
    work.vertices->requested = surfaces;
    work.vertices->passed.closures = passed.empty() ? nullptr : passed.data();
    return sweep;
}

AdjointTask Engine::DerivativeCall::record(const ImageTask& task, Workspace& work, AdjointWorkspace& adjoint,
                                           const DifferentiableTables& of) const {
    const AdjointTask sweep = recording(task, work, adjoint, of);
    engine.kernels_.record(scene, task, work);
    const int32_t paths = task.pixel_count * task.samples;
    if (edge_on) edge_on->weigh(engine.kernels_, scene, paths, work);
    engine.kernels_.close_up(work, paths);
    AdjointWorkspace::release(work);
    return sweep;
}

AdjointTask Engine::DerivativeCall::record_rims(const ImageTask& task, Workspace& work,
                                                AdjointWorkspace& adjoint,
                                                const DifferentiableTables& of) const {
    const AdjointTask sweep = recording(task, work, adjoint, of);
    work.vertices->rims = true;
    engine.kernels_.record(scene, task, work);
    engine.kernels_.close_up(work, task.pixel_count * task.samples);
    AdjointWorkspace::release(work);
    return sweep;
}

ValueTask Engine::DerivativeCall::record_values(const ImageTask& task, Workspace& work,
                                                AdjointWorkspace& adjoint,
                                                const DifferentiableTables& of) const {
    ValueTask sweep = adjoint.value_task(task, work);
    sweep.tables = &of;
    ValueMemory& values = *sweep.values;
    constexpr uint64_t emission = Requested::columns(kEmission, kEmission + 3);
    const uint64_t columns = requested.any("closure_params") ? requested.span("closure_params").columns : 0;
    values.emission = (columns & emission) != 0;
    values.colors = (columns & ~emission) != 0;
    values.rows = requested.any("light_params");
    values.environment = requested.any("environment");
    values.requested = surfaces;
    values.requested.everywhere = values.emission || values.rows || values.environment;
    engine.kernels_.record_values(scene, task, work);
    AdjointWorkspace::release(work);
    return sweep;
}

bool Engine::DerivativeCall::misses_change() const {
    return scene.lights.sized_count + scene.lights.sized_distant > 0 || scene.sky.pixels ||
           requested.any("environment");
}

HorizonTask Engine::DerivativeCall::horizon_task(const ImageTask& image, DroppedSamples& lost) const {
    const RenderOptions& options = horizon.options;
    return {image, options.shadow, options.indirect && options.max_depth > 2, &lost};
}

void Engine::DerivativeCall::note_effort() {
    const auto note = [&](Part part, double samples) {
        if (decided.at(part)) decided[part].samples += samples;
    };
    const auto of_picture = [](const ImagePlan& p) {
        return static_cast<double>(p.pixels) * p.options.samples;
    };
    if (image_chunks > 0) note(Part::kInterior, of_picture(plan));
    if (rim_chunks > 0) note(Part::kRims, of_picture(rims));
    if (edge_on) note(Part::kEdgeOn, static_cast<double>(edge_on->total()));
    if (horizon_chunks > 0)
        note(decided.computes(Part::kHorizons) ? Part::kHorizons : Part::kIndirectHorizons,
             of_picture(horizon));
    for (int pass = 0; specular && pass < specular->passes(); ++pass)
        note(specular_part(), static_cast<double>(specular->total(pass)));
    for (const BoundaryTerm& term : terms)
        for (int pass = 0; pass < term.plan.passes(); ++pass)
            note(kPartOf[term.plan.kind()], static_cast<double>(term.plan.total(pass)));
    for (int part = 0; part < static_cast<int>(Part::kParts); ++part)
        if (decided.at(static_cast<Part>(part)))
            decided[static_cast<Part>(part)].seconds = clock.seconds(static_cast<Part>(part));
}

void Engine::DerivativeCall::count_samples(LearnedSampling& learned) const {
    std::fill_n(learned.taken, kDerivativeTerms, 0.0);
    if (image_chunks > 0)
        learned.taken[kInteriorTerm] = static_cast<double>(plan.pixels) * plan.options.samples;
    if (rim_chunks > 0)
        learned.taken[kInteriorTerm] += static_cast<double>(rims.pixels) * rims.options.samples;
    if (edge_on) learned.taken[kInteriorTerm] += static_cast<double>(edge_on->total());
    if (horizon_chunks > 0)
        learned.taken[kShadowTerm] = static_cast<double>(horizon.pixels) * horizon.options.samples;
    for (int pass = 0; specular && pass < specular->passes(); ++pass)
        learned.taken[kPrimaryTerm] += static_cast<double>(specular->total(pass));
    for (const BoundaryTerm& term : terms)
        for (int pass = 0; pass < term.plan.passes(); ++pass)
            learned.taken[kTermOf[term.plan.kind()]] += static_cast<double>(term.plan.total(pass));
}

Dropped Engine::DerivativeCall::all_dropped() const {
    Dropped out;
    const auto add_pixels = [&out](const char* name, const DroppedSamples& d) {
        if (d.count > 0) out.push_back({name, d.count, d.first, {-1, -1}, {d.place, -1}});
    };
    add_pixels("interior", dropped.sum());
    add_pixels("shadow", dropped_horizons.sum());
    const auto add = [&out](const char* name, const DroppedSamples& d, const SceneView& view) {
        if (d.count == 0) return;
        DroppedTerm t{name, d.count, -1, {-1, -1}, {-1, -1}};
        if (d.place < 0) return out.push_back(t);  // the border of a light
        const uint32_t* face = view.edge_faces + view.edge_face_first[d.place];
        const bool intersection = d.place >= view.edge_count;
        for (int k = 0; k < 2; ++k)
            if (!intersection) t.vertices[k] = static_cast<int32_t>(view.edge_vertices[2 * d.place + k]);
        t.faces[0] = static_cast<int32_t>(face[0]);
        if (intersection && !(face[1] & kLightOfTable)) t.faces[1] = static_cast<int32_t>(face[1]);
        out.push_back(t);
    };
    for (const BoundaryTerm& term : terms)
        add(kBoundaryTerms[term.plan.kind()], term.dropped->sum(), term.view(scene));
    add(kBoundaryTerms[kPrimaryBoundary], dropped_chains.sum(), scene);
    return out;
}

ImagePlan Engine::DerivativeCall::interior_plan(const RenderOptions& options) const {
    constexpr uint64_t values =
        Requested::columns(kBaseColor, kBaseColor + 3) | Requested::columns(kEmission, kEmission + 3);
    const bool pictures =
        requested.any("light_params") || requested.any("environment") ||
        (requested.any("closure_params") && (requested.span("closure_params").columns & values) != 0);
    const ImagePlan own(scene.camera, options, kRecordedPaths);
    return pictures ? own : own.sharing();
}

Decisions Engine::decide(const RenderOptions& options, const Requested& requested) const {
    require_settled();
    return DerivativeCall(*this, options, requested, nullptr).decided;
}

float Engine::follow(const RequestedMotion& motion, const std::vector<int8_t>& sides,
                     const std::shared_ptr<const LightList>& lights) const {
    const auto faces = normals();
    const std::vector<uint8_t> clear(closed_.size(), 0);  // matters to edges' masses alone
    return followed_alpha(
        {tables_, sides.data(), closed_, clear, faces->data(), kernels_, threads_, lights, kept_}, motion);
}

std::shared_ptr<const LightList> Engine::lights_for(const Requested& requested) const {
    const std::vector<uint8_t> rows = lights_alone(tables_, requested);
    return rows.empty() ? lights(requests_dark_lights(requested))
                        : std::make_shared<const LightList>(tables_, rows);
}

}  // namespace edgegrad
