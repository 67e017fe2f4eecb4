#include "engine/terms/boundary_terms.h"

#include <algorithm>

#include "engine/terms/curve_terms.h"
#include "scene/sharp_lobes.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"
#include "util/parallel.h"

namespace edgegrad {

namespace {

// Shadow samples per pixel and sample of the picture, for lights and for the sky. Guided samples along edges
// gain more than in proportion to their number: 2 instead of 0.5 have 1/7 of the variance (of 8 x 8 blocks)
// in shadow_occluder and shadow_light, 1/14 in point_shadow, 1/8 in blob_flat, for 2.2 to 4.1 times the
// seconds.
constexpr double kShadowShare = 2.0;
// Indirect ones, each of which costs a path: 1.5 instead of 1 take 1.08 times the seconds and 0.79 times
// seconds x variance in the mean of 23 scenes. And pieces of edges with cells of directions, by sample.
constexpr double kIndirectShare = 1.5, kDirectionSegments = 0.03;
// Of outlines of emissive meshes.
constexpr double kOutlineShare = 1.0;
// Cells of the picture, by sample that starts at the camera.
constexpr double kPictureSegments = 0.1;

// Cells that samples are learned of, by sample, and most.
double learned_cells(double samples) { return std::min(0.06 * samples, 262'144.0); }

// Samples of the primary term per pixel and sample of the picture, least and most. Along few edges,
// systematic samples get better much faster than they get more: 0.15 instead of 0.1 have half the variance in
// crease, tri_black and sphere_env, for 1.0 to 1.2 times the seconds; where edges are so many that samples
// hit them at random they don't. The most is met by flat-shaded meshes, whose edges all count: with 0.27
// instead of 0.45 blob_flat's interior and primary terms take 2.4 instead of 3.1 pictures, with the same
// seconds x variance of the gradient (of the derivative picture, 1.9 times that).
constexpr double kLeastPrimary = 0.15, kMostPrimary = 0.27, kLeastScattered = 0.09;

// Where samples are fewer than pieces (of directions towards light: than a few on each), they hit them at
// random: seconds x variance then is about the same for any number of them, where along few pieces it falls
// with their number. The part that is taken then, at least a quarter: in dense_200k, of 300,000 edges, a
// gradient of 64 samples takes 6.3 instead of 8.5 times a picture's seconds, with the same variance, which is
// that of the primary and interior terms.
constexpr double kSamplesTowardsLight = 32.0, kLeastPart = 0.25;
double scattered(const Candidates& pieces, double each, double samples) {
    return std::clamp(samples / (each * static_cast<double>(std::max<int64_t>(1, pieces.size()))), kLeastPart,
                      1.0);
}

using SharedCandidates = std::shared_ptr<const Candidates>;
SharedCandidates shared(SharedCandidates known) { return known; }
SharedCandidates shared(Candidates made) { return std::make_shared<const Candidates>(std::move(made)); }

// The materials that may have lobes that samples from the camera take (camera_sampled_kinds of
// boundary/terms/camera_sampled_lobes.h).
std::vector<int32_t> camera_sampled(const SceneView& scene, const SceneTables& tables, float aimed) {
    const auto takes = [&](size_t closure) {
        const bool glossy = tables.closure_flags[closure] & (kHasGlossy | kHasRefraction);
        const bool textured = scene.textures.closure_program && scene.textures.closure_program[closure] >= 0;
        return aimed >= kAimAtAll || has_sharp_lobe(tables, closure, aimed) ||
               (aimed > 0.0f && glossy && textured && tables.closure_kind[closure] != kSheen);
    };
    return used_materials(tables, takes);
}

}  // namespace

std::vector<BoundaryTerm> boundary_terms(const SceneView& scene, const EdgeList& edges,
                                         const RenderOptions& options, const RequestedMotion& motion,
                                         bool guided, float aimed, LearnedSampling* learned,
                                         Decisions& decided) {
    std::vector<BoundaryTerm> terms;
    const int64_t pixels = static_cast<int64_t>(scene.camera.width) * scene.camera.height;
    const double picture = static_cast<double>(pixels) * options.samples;
    // Samples of candidates by what is known of them, or of `pieces`, from which about `cells` are learned.
    const auto add = [&](BoundaryKind kind, const Candidates& found, const auto& pieces, bool chains,
                         double cells, double samples, double most,
                         std::shared_ptr<const EdgesAndIntersections> lines = nullptr,
                         std::shared_ptr<const EdgeTree> tree = nullptr) {
        LearnedWeights* masses = learned ? &learned->masses[kind] : nullptr;
        const bool known = masses && masses->knows(edges, found);
        auto sampled = known ? shared(masses->pieces(found)) : shared(pieces());
        if (masses && !known) masses->begin(edges, found, sampled->direction_cells, chains, cells);
        const double share = learned ? learned->share[kTermOf[kind]] : 1.0;
        SamplePlan plan(std::move(sampled), share * samples, share * most * picture, options, kind,
                        guided && !known);
        if (plan.total(0) > 0)
            terms.push_back({std::move(plan), std::move(lines), std::make_unique<DropCount>(),
                             std::move(tree), aimed, masses});
    };
    std::shared_ptr<const Intersections> seen;
    const EdgeCache::Sides sides(edges.solid_side, edges.solid_side + edges.tables.visible_meshes);
    const auto silhouettes = [&] {
        return edges.kept.silhouettes.get(sides, [&] { return shadow_candidates(scene, edges, true); });
    };
    // Where a part that is zero is computed to see that, edges of all meshes are looked for.
    const auto swept = [&](Part part) {
        RequestedMotion all = motion;
        all.camera |= decided.forces(part);
        return all;
    };
    // Whether a search for a part's edges has found some, of which the decision is told.
    const auto has_edges = [&](Part part, const Candidates& found) {
        Decision& d = decided[part];
        const int64_t still = d.edges.still;
        d.edges = found.counts, d.edges.still = still;
        if (found.size() == 0)
            decided.none(part, part == Part::kPrimaryEdges && found.counts.kept > 0 ? Reason::kOutOfView
                                                                                    : Reason::kFlat);
        return found.size() > 0;
    };
    if (decided.computes(Part::kPrimaryEdges)) {
        // Where light is held (scene/contact.h) it moves over all of them: they are searched once for both.
        RequestedMotion wider = motion;
        wider.camera |= scene.mesh_contact != nullptr || decided.forces(Part::kPrimaryEdges);
        seen = edges.kept.intersections.get({wider.camera, wider.instances, wider.moving}, [&] {
            return find_intersections(edges, wider, 1 << kCameraRay);
        });
        const RequestedMotion moving = swept(Part::kPrimaryEdges);
        Intersections crossing = moving_intersections(edges.tables, moving, *seen);
        decided.found(Part::kSeenIntersections, edges.tables, crossing);
        auto lines = std::make_shared<EdgesAndIntersections>(edges.tables, std::move(crossing));
        const auto found = edges.kept.primary.get({{scene.camera}, moving}, [&] {
            Candidates all = primary_candidates(scene, edges, moving);
            lines->add_candidates(scene.camera, all);
            return all;
        });
        const Candidates& candidates = *found;
        has_edges(Part::kPrimaryEdges, candidates);
        // As many samples per pixel of edge as the picture has per pixel.
        const double all = std::min(candidates.mass() * options.samples, kMostPrimary * picture);
        const double part = scattered(candidates, 1.0, all);
        const double samples = std::max(part * all, (part < 1.0 ? kLeastScattered : kLeastPrimary) * picture);
        add(
            kPrimaryBoundary, candidates, [&] { return found; }, false, learned_cells(samples), samples,
            kMostPrimary, std::move(lines));
    }
    if (decided.computes(Part::kLightShadows) || decided.computes(Part::kEnvironmentShadows)) {
        const double samples = kShadowShare * picture;
        const bool chains = options.max_depth > 2;
        // Along edges, `directions` of them in cells of their own.
        const auto add_shadows = [&](BoundaryKind kind, double directions) {
            const auto kept = kind == kEnvironmentShadow ? silhouettes()
                                                         : edges.kept.shadow.get({edges.lights, sides}, [&] {
                                                               return shadow_candidates(scene, edges, false);
                                                           });
            const Candidates& found = *kept;
            if (!has_edges(kPartOf[kind], found)) return;
            const double part = scattered(found, kSamplesTowardsLight, samples);
            add(
                kind, found, [&] { return over_directions(found, part * directions, chains); }, chains,
                learned_cells(part * samples), part * samples, kShadowShare);
        };
        if (decided.computes(Part::kLightShadows)) add_shadows(kShadowBoundary, 0.0);
        // Directions to an image are its own samples', in no cell.
        if (decided.computes(Part::kEnvironmentShadows))
            add_shadows(kEnvironmentShadow, scene.sky.sampled ? 0.0 : kDirectionSegments * samples);
    }
    if (decided.computes(Part::kEmitterOutlines) && scene.face_held) {
        const double samples = kOutlineShare * picture;
        const bool chains = options.max_depth > 2;
        const Candidates outlines = emitter_candidates(scene, edges);
        if (has_edges(Part::kEmitterOutlines, outlines))
            add(
                kEmitterOutline, whole_picture(),
                [&] { return over_picture(kPictureSegments * samples, chains); }, chains, 0.0, samples,
                kOutlineShare, nullptr, std::make_shared<EdgeTree>(scene, edges.tables, outlines, true));
    }
    if (decided.computes(Part::kIndirectEdges)) {
        const double samples = kIndirectShare * picture;
        const bool chains = options.max_depth > 3;
        const auto kept = silhouettes();
        const Candidates& found = *kept;
        const bool any = has_edges(Part::kIndirectEdges, found);
        if (!any) decided.none(Part::kCameraSampledIndirect, decided[Part::kIndirectEdges].reason);
        if (any && decided.computes(Part::kCameraSampledIndirect) &&
            decided.lists_materials(Part::kCameraSampledIndirect, camera_sampled(scene, edges.tables, aimed)))
            add(
                kCameraSampledIndirect, whole_picture(),
                [&] { return over_picture(kPictureSegments * samples, chains); }, chains, 0.0, samples,
                kIndirectShare, nullptr,
                edges.kept.tree.get(sides, [&] { return EdgeTree(scene, edges.tables, found); }));
        if (any && aimed < kAimAtAll)
            add(
                kIndirectBoundary, found,
                [&] { return over_directions(found, kDirectionSegments * samples, chains); }, chains,
                learned_cells(samples), samples, kIndirectShare);
    }
    for (CurveTerm& curve :
         curve_terms(scene, edges, options, motion,
                     decided.forces(Part::kPrimaryEdges) ? nullptr : seen.get(), decided)) {
        const double samples = (learned ? learned->share[kTermOf[curve.kind]] : 1.0) * curve.share * picture;
        SamplePlan plan(shared(std::move(curve.candidates)), samples, samples, options, curve.kind, guided);
        // What surfaces hide of others by passing through them has no aimed estimator.
        const float lobes = curve.kind == kSurfaceIntersection ? 0.0f : aimed;
        if (plan.total(0) > 0)
            terms.push_back({std::move(plan), std::move(curve.lines), std::make_unique<DropCount>(), nullptr,
                             lobes, nullptr});
    }
    return terms;
}

// Where one term is much noisier than another, samples of the
// other are worth little: for the least variance of the sum their numbers go with the noise of a sample
// (Neyman 1934). Errors of systematic samples fall faster than that, so that some slack is left: with none
// gradients of camera_move and two_triangles have three times the variance, with 3 instead of 2 all take up
// to a tenth more seconds for the same.
double guide_second_passes(std::vector<BoundaryTerm>& terms) {
    constexpr double kLeast = 0.02, kSlack = 2.0;
    std::vector<double> noise;
    double most = 0.0;
    for (BoundaryTerm& term : terms) {
        if (term.plan.passes() < 2) continue;
        may_cancel();
        term.plan.guide();
        noise.push_back(term.plan.noise());
        most = std::max(most, noise.back() / static_cast<double>(term.plan.total(1)));
    }
    if (!(most > 0.0)) return 0.0;
    double variance = 0.0;
    size_t k = 0;
    for (BoundaryTerm& term : terms) {
        if (term.plan.passes() < 2) continue;
        const double sample = noise[k++];
        const double requested = sample / static_cast<double>(term.plan.total(1));
        term.plan.thin(std::clamp(kSlack * requested / most, kLeast, 1.0));
        variance += sample * sample / static_cast<double>(term.plan.total(1));
    }
    return variance;
}

}  // namespace edgegrad
