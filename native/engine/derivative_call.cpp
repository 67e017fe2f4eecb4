#include "engine/derivative_call.h"

#include <algorithm>
#include <iterator>

#include "boundary/curves/texture_borders.h"
#include "boundary/fields/field_curves.h"
#include "boundary/meshes/solids.h"
#include "engine/decisions/followed_lobes_rule.h"
#include "engine/decisions/interior_rules.h"
#include "engine/decisions/missing/missing_parts.h"
#include "engine/decisions/transparent_closures.h"
#include "engine/terms/outline_cells.h"
#include "scene/contact_meshes.h"
#include "scene/sharp_lobes.h"
#include "tasks/block_sizes.h"
#include "tasks/boundary_kind.h"
#include "tasks/dropped_samples.h"

namespace edgegrad {

namespace {

// If scan lines have more segments per sample of the picture than this, the interior term of motions takes
// half of its samples. Mirrors and glass then fill so much of the picture that sweeps take twice as long as
// tracing, and the scan lines equally long.
constexpr double kManySegments = 0.25;

// A light's strength has a derivative even where it is zero.
bool requests_dark_lights(const Requested& requested) {
    constexpr uint64_t emission = Requested::columns(kEmission, kEmission + 3);
    return requested.any(FloatTable::kLights) ||
           (requested.any(FloatTable::kClosures) &&
            (requested.span(FloatTable::kClosures).columns & emission) != 0);
}

// If only strengths of lights of the table and of the environment are requested, light of all other sources
// has no derivative. Returns the requested rows, on which all samples are spent; else nothing.
std::vector<uint8_t> lights_alone(const SceneTables& tables, const Requested& requested) {
    const auto& spans = requested.spans();
    const bool alone = requested.any(FloatTable::kLights) && !requested.moves_lights() &&
                       spans.size() == 1 + static_cast<size_t>(requested.any(FloatTable::kEnvironment));
    std::vector<uint8_t> rows(alone ? tables.lights.kind.size() : 0);
    for (size_t k = 0; k < rows.size(); ++k)
        rows[k] = requested.any(FloatTable::kLights, k * kLightParams, (k + 1) * kLightParams);
    return rows;
}

// The requested motion, as boundary terms read it.
RequestedMotion requested_motion(const CameraView& camera, const Requested& requested, FieldEdges edges) {
    const bool own = moves_rays(camera, requested.floats()), warped = edges == FieldEdges::kReparameterised;
    return {requested.moving(),
            own || warped,
            requested.any(FloatTable::kInstances),
            requested.moves_lights(),
            requested.any(FloatTable::kEnvironmentRotation),
            requested.any(FloatTable::kEnvironment) || requested.any(FloatTable::kEnvironmentPixels),
            requested.moving_fields(),
            warped,
            own};
}

// The options with the number of samples per pixel of one term.
RenderOptions of_term(const RenderOptions& options, const LearnedSampling* learned, DerivativeTerm term) {
    return learned ? options.part(learned->share[term]) : options;
}

PathRecording path_recording(const SceneView& scene, const SceneTables& tables, const Requested& requested,
                             bool geometry) {
    std::vector<int32_t> passed = transparent_closures(scene, tables, requested, geometry);
    const RequestedSurfaces surfaces = requested_surfaces(scene, tables, requested, passed);
    return {requested, geometry, std::move(passed), surfaces};
}

}  // namespace

Engine::DerivativeCall::DerivativeCall(const Engine& e, const RenderOptions& options,
                                       const Requested& requested_of, LearnedSampling* learned,
                                       bool decide_alone)
    : engine(e),
      requested(requested_of),
      sides(solid_sides(*e.bodies(), e.tables_.camera)),
      decided(options.force, decide_alone),
      field_edges(used_field_edges(e.tables_, options, requested)),
      motion(requested_motion(e.tables_.camera, requested, field_edges)),
      chains(moves_chains(e.tables_, requested)),
      geometry(requested.geometry() || chains),
      lights(e.lights_for(requested)),
      prepared(e.api_, decide_alone ? nullptr : &e.bvh(), e.tables_, &motion, e.hides_no_light(), lights,
               options.filter_glossy,
               options.max_depth > 1 ? e.follow(motion, sides, lights) : FollowedAlpha{}, &e.kept_,
               field_bands(e.tables_, field_edges, e.threads_)),
      scene(prepared.view()),
      tables(differentiable_tables(scene, e.tables_)),
      recording(path_recording(scene, e.tables_, requested, geometry)),
      shading(scene, e.tables_, options.max_depth),
      rims_turn(options.terms[kInteriorTerm] && rims_move(scene, e.tables_, requested)),
      learns(learned) {
    if (options.terms[kInteriorTerm]) begin_interior(options, of_term(options, learned, kInteriorTerm));
    const bool between = options.terms[kIndirectTerm] && options.max_depth >= 3;
    const BoundaryFacts facts{scene,     e.tables_,
                              options,   motion,
                              chains,    bends_chains(e.tables_, requested),
                              rims_turn, between && e.hides_no_surface(),
                              e.kept_};
    decide_boundaries(facts, decided);
    note_missing(facts, requested, e.closed_, e.threads_, decided);
    if (std::any_of(std::begin(kBoundaryTable), std::end(kBoundaryTable),
                    [&](const BoundaryKindRow& kind) { return decided.computes(kind.part); })) {
        const auto normals = e.normals();
        const std::vector<uint8_t> clear = e.clear_emitters(*lights);
        boundaries =
            boundary_terms(scene,
                           {e.tables_, sides.data(), e.closed_, clear, normals->data(), e.kernels_,
                            e.threads_, lights, e.kept_, decided.alone() && !e.tables_.instance_mesh.empty(),
                            edge_windows(e.tables_, options.most_placed_edges), options.seed},
                           options, motion, learned, decided);
    }
    // One sweep over paths estimates both kinds of horizons.
    for (const Part part : {Part::kHorizons, Part::kIndirectHorizons})
        if (!horizon && decided.computes(part))
            horizon =
                std::make_unique<HorizonTerm>(scene.camera, of_term(options, learned, kShadowTerm), part);
    specular = SpecularTerm::of(scene, e.tables_, of_term(options, learned, kPrimaryTerm), e.kept_, decided);
    if (specular && interior && !learns && requests_motion_alone() &&
        static_cast<double>(specular->all_samples()) >
            kManySegments * static_cast<double>(interior->plan().pixels) * options.samples)
        divide_interior(2);
    sample_edge_on_faces();
    add_samples_on_outlines(options.seed);
    e.kept_.trees.clear();  // they are large, and what they have found is kept
}

void Engine::DerivativeCall::begin_interior(const RenderOptions& options, const RenderOptions& own) {
    const SceneTables& t = engine.tables_;
    if (decided.decide(Part::kInterior, shading.constant(requested.floats())))
        interior =
            std::make_unique<InteriorTerm>(interior_plan(own), recording, requested.values_alone(scene));
    decided.decide(Part::kFavouredLobes,
                   interior && recording.surfaces.lobes != 0 ? Reason::kNeeded : Reason::kNone);
    if (interior && !recording.surfaces.everywhere) list_requested_surfaces(decided[Part::kInterior]);
    const Rims found = rims_that_count(scene, t);
    Reason reason = interior && rims_turn ? Reason::kNeeded : Reason::kStill;
    if (found == Rims::kNone) reason = Reason::kNone;
    if (decided.decide(Part::kRims, options.max_depth < 2 ? Reason::kNotRendered : reason)) {
        rims = std::make_unique<RimTerm>(scene.camera, own, found, recording);
        decided[Part::kRims].materials = used_materials(
            t, [&](size_t closure) { return may_have_rim(t, closure, scene.least_alpha > 0.0f); });
    }
    decided.decide(Part::kContact, interior && scene.mesh_contact ? Reason::kNeeded : Reason::kNone);
    if (interior && options.max_depth > 2)
        decided[Part::kContact].materials = noisy_contact_materials(
            t, motion,
            engine.kept_.contact_materials
                .get(true, [&] { return contact_materials(t, *kept_jumps(t, engine.kept_)); })
                ->bits);
    // Samples of their derivative are as much larger than the light as the lobes are narrow.
    constexpr float kNarrow = 0.03f;
    const std::vector<int32_t> narrow =
        interior && options.max_depth > 2
            ? used_materials(t,
                             [&](size_t closure) {
                                 return has_sharp_lobe(t, closure, kNarrow) &&
                                        (geometry || shapes_lobes(requested, closure));
                             })
            : std::vector<int32_t>();
    decided.decide(Part::kSharpReflections, narrow.empty() ? Reason::kNone : Reason::kNeeded);
    decided[Part::kSharpReflections].materials = narrow;
    const std::vector<int32_t>& passed = recording.passed;
    decided.decide(Part::kTransparency, interior && !passed.empty() ? Reason::kNeeded : Reason::kNone);
    if (!passed.empty())
        decided[Part::kTransparency].materials =
            used_materials(t, [&](size_t closure) { return passed[closure] != 0; });
}

void Engine::DerivativeCall::list_requested_surfaces(Decision& shading) const {
    for (size_t mesh = 0; recording.surfaces.moving && mesh < requested.moving().size(); ++mesh)
        if (requested.moving()[mesh]) shading.meshes.push_back(static_cast<int32_t>(mesh));
    for (size_t k = 0; recording.surfaces.moving && k < requested.moving_fields().size(); ++k)
        if (requested.moving_fields()[k])
            shading.meshes.push_back(engine.tables_.first_field() + static_cast<int32_t>(k));
    shading.materials = used_materials(engine.tables_, [&](size_t closure) {
        const auto k = static_cast<int32_t>(closure);
        return recording.surfaces.first_closure <= k && k < recording.surfaces.last_closure;
    });
}

void Engine::DerivativeCall::sample_edge_on_faces() {
    if (!interior || !geometry) return;
    const SceneTables& t = engine.tables_;
    const RenderOptions& options = interior->plan().options;
    if (!decided.alone()) {
        edge_on = EdgeOnTerm::of(scene, t, sides, options, motion, recording, engine.threads_);
        interior->weigh_beside(edge_on.get());
    }
    // Decisions alone need no list of these faces, and no search if a call has known before whether there are
    // any
    const auto exist = [&] {
        return decided.alone() ? any_edge_on_face(scene, t, sides, motion, engine.threads_)
                               : edge_on != nullptr;
    };
    const bool found =
        edge_on_matters(scene, options) && *engine.kept_.edge_on.get({CameraKey{t.camera}, motion}, exist);
    decided.decide(Part::kEdgeOn, found ? Reason::kNeeded : Reason::kNone);
}

void Engine::DerivativeCall::add_samples_on_outlines(uint32_t seed) {
    const CameraView& camera = scene.camera;
    const bool blurs = camera.aperture_radius > 0.0f || is_panorama(camera.kind);
    if (!interior || decided.alone() || motion.warped || blurs || reuses_picture()) return;
    const SceneTables& t = engine.tables_;
    std::vector<int32_t> moving;
    for (size_t k = 0; k < t.fields.size(); ++k) {
        const int32_t mesh = t.first_field() + static_cast<int32_t>(k);
        if (motion.fields[k] && (t.mesh_mask[static_cast<size_t>(mesh)] & 1 << kCameraRay))
            moving.push_back(mesh);
    }
    if (moving.empty()) return;
    const std::vector<uint8_t> none;
    const EdgeList edges{engine.tables_,  sides.data(),    engine.closed_, none,        nullptr,
                         engine.kernels_, engine.threads_, lights,         engine.kept_};
    interior->set_plan(
        interior->plan().with_dense(outline_pixels(camera, *seen_outlines(scene, edges, moving, seed))));
}

// The order of passes determines the rounding of sums. Each mode keeps its own order, so that results keep
// their bits.
std::vector<TermPass> Engine::DerivativeCall::first_passes(DerivativeMode mode) const {
    std::vector<TermPass> out;
    if (specular && mode == DerivativeMode::kForward) out.push_back({specular.get(), 0});
    for (const auto& term : boundaries) out.push_back({term.get(), 0});
    if (specular && mode == DerivativeMode::kReverse) out.push_back({specular.get(), 0});
    return out;
}

std::vector<TermPass> Engine::DerivativeCall::later_passes(DerivativeMode mode) const {
    std::vector<TermPass> out;
    const auto add = [&](Term* term, int pass) {
        if (term && pass < term->passes()) out.push_back({term, pass});
    };
    add(interior.get(), 0), add(horizon.get(), 0), add(rims.get(), 0);
    if (mode == DerivativeMode::kReverse) add(edge_on.get(), 0);
    add(specular.get(), 1);
    for (const auto& term : boundaries) add(term.get(), 1);
    if (mode == DerivativeMode::kForward) add(edge_on.get(), 0);
    return out;
}

std::vector<Term*> Engine::DerivativeCall::terms() const {
    std::vector<Term*> out = {interior.get(), rims.get(), edge_on.get(), horizon.get()};
    for (const auto& term : boundaries) out.push_back(term.get());
    out.push_back(specular.get());
    std::erase(out, nullptr);
    return out;
}

int64_t Engine::DerivativeCall::chunks() const {
    int64_t all = 0;
    for (const Term* term : terms()) all += term->all_chunks();
    return all;
}

void Engine::DerivativeCall::note_effort() {
    for (const Term* term : terms()) {
        Decision& d = decided[term->part];
        d.samples += static_cast<double>(term->all_samples());
        d.seconds = clock.seconds(term->part);
    }
}

void Engine::DerivativeCall::count_samples(LearnedSampling& learned) const {
    std::fill_n(learned.taken, kDerivativeTerms, 0.0);
    for (const Term* term : terms()) learned.taken[term->name] += static_cast<double>(term->all_samples());
}

Dropped Engine::DerivativeCall::all_dropped() const {
    Dropped out;
    DropCount by_pixel[kDerivativeTerms];
    for (const Term* term : terms())
        if (term->drops_by_pixel()) by_pixel[term->name].add(term->dropped());
    for (int32_t name = 0; name < kDerivativeTerms; ++name)
        if (const DroppedSamples& d = by_pixel[name].sum(); d.count > 0)
            out.push_back({kTermNames[name], d.count, d.first, {-1, -1}, {d.place, -1}});
    for (const Term* term : terms()) {
        const DroppedSamples& d = term->dropped();
        if (d.count == 0 || term->drops_by_pixel()) continue;
        DroppedTerm t{kTermNames[term->name], d.count, -1, {-1, -1}, {-1, -1}};
        if (d.place >= 0) {  // else the outline of a light
            const SceneView view = term->view(scene);
            const bool intersection = view.is_intersection(d.place);
            for (int k = 0; k < 2; ++k)
                if (!intersection) t.vertices[k] = static_cast<int32_t>(view.edge_vertices[2 * d.place + k]);
            t.faces[0] = view.surface_of_line(d.place, 0).face();
            if (intersection && !view.surface_of_line(d.place, 1).is_light())
                t.faces[1] = view.surface_of_line(d.place, 1).face();
        }
        out.push_back(t);
    }
    return out;
}

bool Engine::DerivativeCall::reuses_picture() const {
    constexpr uint64_t values =
        Requested::columns(kBaseColor, kBaseColor + 3) | Requested::columns(kEmission, kEmission + 3);
    return requested.any(FloatTable::kLights) || requested.any(FloatTable::kEnvironment) ||
           (requested.any(FloatTable::kClosures) &&
            (requested.span(FloatTable::kClosures).columns & values) != 0);
}

ImagePlan Engine::DerivativeCall::interior_plan(const RenderOptions& options) const {
    const ImagePlan own(scene.camera, options, kRecordedPaths);
    const ImagePlan all = reuses_picture() ? own : own.sharing();
    // Only the motion of a sharp lobe has a derivative that is odd about its middle.
    return geometry && any_sharp_material() ? all.in_pairs() : all;
}

// Pairs see half as many places of a pixel, which costs more than it gains where all lobes are wider.
constexpr float kMirroredAlpha = 0.1f;

bool Engine::DerivativeCall::any_sharp_material() const {
    const SceneTables& t = engine.tables_;
    return !used_materials(t, [&](size_t closure) {
                return has_sharp_lobe(t, closure, kMirroredAlpha);
            }).empty();
}

Decisions Engine::decide(const RenderOptions& options, const Requested& requested,
                         const ParameterFloats& parameters) const {
    require_settled();
    DerivativeCall call(*this, options, requested, nullptr, true);
    if (!call.decided.at(Part::kInterior)) return call.decided;
    const bool boundaries = call.decided.any_boundary();
    std::vector<FloatSpan> own;
    auto next = parameters.spans.begin();
    for (const size_t last : parameters.last) {
        own.assign(next, parameters.spans.begin() + static_cast<std::ptrdiff_t>(last));
        next += static_cast<std::ptrdiff_t>(own.size());
        unite(own);
        const FloatSpans floats(tables_, own);
        const Reason shading = call.shading.constant(floats);
        const bool stays = shading != Reason::kNeeded && !(boundaries && moves_anything(tables_, floats));
        call.decided[Part::kInterior].by_parameter.push_back({shading, stays});
    }
    return call.decided;
}

FollowedAlpha Engine::follow(const RequestedMotion& motion, const std::vector<int8_t>& sides,
                             const std::shared_ptr<const LightList>& lights) const {
    const auto faces = normals();
    const std::vector<uint8_t> clear(closed_.size(), 0);  // only weights of edges depend on it
    return followed_alpha(
        {tables_, sides.data(), closed_, clear, faces->data(), kernels_, threads_, lights, kept_}, motion);
}

std::shared_ptr<const LightList> Engine::lights_for(const Requested& requested) const {
    const std::vector<uint8_t> rows = lights_alone(tables_, requested);
    return rows.empty() ? lights(requests_dark_lights(requested))
                        : std::make_shared<const LightList>(tables_, rows);
}

}  // namespace edgegrad
