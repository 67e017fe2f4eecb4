#include "engine/terms/boundary_terms.h"

#include <algorithm>
#include <optional>
#include <type_traits>

#include "boundary/curves/segment_cells.h"
#include "engine/terms/curve_terms.h"
#include "engine/terms/warp_term.h"
#include "scene/sharp_lobes.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"
#include "tasks/seed_tags.h"
#include "util/parallel.h"

namespace edgegrad {

namespace {

// Number of cells with learned sample weights: per sample, and at most.
double learned_cells(double samples) { return std::min(0.06 * samples, 262'144.0); }

// Fewest samples of the primary term per pixel and sample of the picture: in general, and for so many edges
// that samples hit them at random. Along few edges, the error of systematic samples falls faster than that of
// random ones.
constexpr double kLeastPrimary = 0.15, kLeastScattered = 0.09;

// The fraction of the samples that is taken if there are fewer samples than segments (for directions towards
// light: fewer than a few per segment). Samples then hit segments at random, and seconds x variance hardly
// depends on their number. With few segments it falls with the number of samples.
constexpr double kSamplesTowardsLight = 32.0, kLeastPart = 0.25;
double scattered(int64_t segments, double each, double samples) {
    return std::clamp(samples / (each * static_cast<double>(std::max<int64_t>(1, segments))), kLeastPart,
                      1.0);
}

using SharedCandidates = std::shared_ptr<const Candidates>;
SharedCandidates shared(SharedCandidates known) { return known; }
SharedCandidates shared(Candidates made) { return std::make_shared<const Candidates>(std::move(made)); }

// The candidates of a search. Those of instances of very many edges are listed by themselves
// (EdgeList::windows).
struct Found {
    SharedCandidates whole, windows;  // `windows` may be null
    double factor = 1.0;              // of estimates from `windows`

    double mass_of_windows() const { return windows ? factor * windows->mass() : 0.0; }
    double mass() const { return whole->mass() + mass_of_windows(); }
    int64_t size() const { return whole->size() + (windows ? windows->size() : 0); }
    EdgeCounts counts() const {
        EdgeCounts out = whole->counts;
        if (windows) out.add(windows->counts);
        return out;
    }
    // Calls visit(candidates, their part of the samples, factor) for each list.
    template <typename Visit>
    void each(const Visit& visit) const {
        if (!windows) return visit(whole, 1.0, 1.0);
        const double part = mass() > 0.0 ? mass_of_windows() / mass() : 0.0;
        if (part < 1.0) visit(whole, 1.0 - part, 1.0);
        if (part > 0.0) visit(windows, part, factor);
    }
};

// The candidates that search(edges) finds, which are kept if they are complete.
template <typename Key, typename Search>
Found searched(const EdgeList& edges, bool in_windows, Kept<Key, Candidates>& kept,
               const std::type_identity_t<Key>& key, const Search& search) {
    if (in_windows) {
        EdgeList part = edges;
        part.part = EdgeList::kWhole;
        SharedCandidates whole = shared(search(part));
        part.part = EdgeList::kWindows;
        return {std::move(whole), shared(search(part)), static_cast<double>(edges.windows)};
    }
    if (!edges.counts_alone) return {kept.get(key, [&] { return search(edges); }), nullptr};
    const SharedCandidates known = kept.find(key);
    return {known ? known : shared(search(edges)), nullptr};
}

// Materials that may have camera-sampled lobes (boundary/segment/camera_sampled_lobes.h).
std::vector<int32_t> camera_sampled(const SceneView& scene, const SceneTables& tables, float alpha) {
    return used_materials(tables, [&](size_t closure) {
        const bool glossy = tables.closure_flags[closure] & (kHasGlossy | kHasRefraction);
        const bool textured = scene.textures.closure_program && scene.textures.closure_program[closure] >= 0;
        return has_sharp_lobe(tables, closure, alpha) ||
               (alpha > 0.0f && glossy && textured && tables.closure_kind[closure] != kSheen &&
                tables.closure_kind[closure] != kVelvet);
    });
}

}  // namespace

void BoundaryTerm::run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) {
    BoundaryTask task = plan_.task(pass, first, count);
    task.dropped = &lost;
    task.camera_sampled_alpha = camera_sampled_alpha_;
    if (lines_.tree) task.tree = lines_.tree->view();
    const BoundaryKernels& kernels = run.kernels.boundary[task.kind];
    if (run.is_forward())
        kernels.forward(view(run.scene), task, run.work(), run.view, run.splats);
    else
        kernels.backward(view(run.scene), task, run.work(), run.adjoint, run.view);
}

BoundaryTerms boundary_terms(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                             const RequestedMotion& motion, LearnedSampling* learned, Decisions& decided) {
    BoundaryTerms terms;
    const int64_t pixels = static_cast<int64_t>(scene.camera.width) * scene.camera.height;
    const double picture = static_cast<double>(pixels) * options.samples;
    const float alpha = options.camera_sampled_alpha;
    const auto share_of = [&](BoundaryKind kind) {
        return learned ? learned->share[kBoundaryTable[kind].term()] : 1.0;
    };
    const auto keep = [&](SamplePlan plan, BoundaryTerm::Lines lines, float lobes, LearnedWeights* weights) {
        if (plan.total(0) > 0)
            terms.push_back(
                std::make_unique<BoundaryTerm>(std::move(plan), std::move(lines), lobes, weights));
    };
    // Samples of candidates by their learned weights, or of `segments`, from which about `cells` cells are
    // learned. `factor` multiplies the estimate from the candidates.
    const auto add = [&](BoundaryKind kind, const Candidates& found, const auto& segments, double cells,
                         double samples, BoundaryTerm::Lines lines = {}, double factor = 1.0) {
        if (decided.alone()) return;
        const BoundaryKindRow& row = kBoundaryTable[kind];
        // Each call lists other edges of instances, of which nothing can be learned.
        LearnedWeights* weights = learned && factor == 1.0 ? &learned->weights[kind] : nullptr;
        const bool known = weights && weights->knows(edges, found);
        auto sampled = known ? shared(weights->pieces(found)) : shared(segments());
        if (weights && !known)
            weights->begin(edges, found, sampled->direction_cells,
                           row.domain != kPictureLines && row.chains(options.max_depth), cells);
        const double share = share_of(kind);
        RenderOptions own = options;
        if (factor != 1.0) own.seed ^= kWindowSeed;
        keep(SamplePlan(std::move(sampled), share * samples, share * row.share * picture, own, kind,
                        options.two_passes && !known, static_cast<float>(factor)),
             std::move(lines), alpha, weights);
    };
    // The same for kinds whose samples start at the camera.
    const auto add_whole_picture = [&](BoundaryKind kind, const auto& tree) {
        if (decided.alone()) return;
        const double samples = kBoundaryTable[kind].share * picture;
        const bool chains = kBoundaryTable[kind].chains(options.max_depth);
        add(kind, whole_picture(), [&] { return over_picture(kPictureSegments * samples, chains); }, 0.0,
            samples, {nullptr, tree()});
    };
    std::shared_ptr<const Intersections> seen;
    const EdgeCache::Sides sides(edges.solid_side, edges.solid_side + edges.tables.visible_meshes);
    // Samples that start at the camera look for edges in a tree, which needs all of them.
    const bool needs_all =
        decided.computes(Part::kCameraSampledIndirect) && !camera_sampled(scene, edges.tables, alpha).empty();
    const bool in_windows = edges.windows > 1 && !decided.alone() && !needs_all;
    std::optional<Found> outlines_of_all;
    const auto silhouettes = [&]() -> const Found& {
        if (!outlines_of_all)
            outlines_of_all =
                searched(edges, in_windows, edges.kept.silhouettes, sides,
                         [&](const EdgeList& part) { return shadow_candidates(scene, part, true); });
        return *outlines_of_all;
    };
    // Whether the search for a part's edges has found any. Adds their counts to the decision.
    const auto has_edges = [&](Part part, int64_t size, const EdgeCounts& counts) {
        Decision& d = decided[part];
        const int64_t still = d.edges.still;
        d.edges = counts, d.edges.still = still;
        if (size == 0)
            decided.none(part,
                         part == Part::kPrimaryEdges && counts.kept > 0 ? Reason::kOutOfView : Reason::kFlat);
        return size > 0;
    };
    if (decided.computes(Part::kPrimaryEdges)) {
        // Light of a fixed direction near contact (scene/contact.h) moves over all intersections. One search
        // then serves both parts.
        RequestedMotion wider = motion;
        // If the part is forced, edges of all meshes are candidates.
        const bool forced = decided.forces(Part::kPrimaryEdges);
        wider.camera |= scene.mesh_contact != nullptr || forced;
        RequestedMotion moving = motion;
        moving.camera |= forced;
        seen = edges.kept.intersections.get({wider.camera, wider.instances, wider.moving}, [&] {
            return find_intersections(edges, wider, 1 << kCameraRay);
        });
        Intersections shown = moving_intersections(edges.tables, moving, *seen);
        decided.found(Part::kSeenIntersections, edges.tables, shown);
        decided.found_coincident(edges.tables, shown, motion.moving);
        auto lines = std::make_shared<EdgesAndIntersections>(edges.tables, std::move(shown));
        const Found found = searched(edges, in_windows, edges.kept.primary, {{scene.camera}, moving},
                                     [&](const EdgeList& part) {
                                         Candidates all = primary_candidates(scene, part, moving);
                                         if (part.part != EdgeList::kWindows)
                                             lines->add_candidates(scene.camera, all);
                                         return all;
                                     });
        has_edges(Part::kPrimaryEdges, found.size(), found.counts());
        // As many samples per pixel of an edge's length as the picture has per pixel
        const double all =
            std::min(found.mass() * options.samples, kBoundaryTable[kPrimaryBoundary].share * picture);
        const double part = scattered(found.size(), 1.0, all);
        const double samples = std::max(part * all, (part < 1.0 ? kLeastScattered : kLeastPrimary) * picture);
        found.each([&](const SharedCandidates& list, double of_samples, double factor) {
            add(
                kPrimaryBoundary, *list, [&] { return list; }, learned_cells(samples), of_samples * samples,
                {lines, nullptr}, factor);
        });
    }
    // Samples along edges, `directions` of them in learned cells.
    const auto add_shadows = [&](BoundaryKind kind, const Found& found, double directions) {
        if (!has_edges(kBoundaryTable[kind].part, found.size(), found.counts())) return;
        const BoundaryKindRow& row = kBoundaryTable[kind];
        const double all = row.share * picture, part = scattered(found.size(), kSamplesTowardsLight, all);
        found.each([&](const SharedCandidates& list, double of_samples, double factor) {
            const double own = of_samples * part;
            add(
                kind, *list,
                [&] { return over_directions(*list, own * directions, row.chains(options.max_depth)); },
                learned_cells(own * all), own * all, {}, factor);
        });
    };
    if (decided.computes(Part::kLightShadows))
        add_shadows(kShadowBoundary,
                    searched(edges, in_windows, edges.kept.shadow, {edges.lights, sides},
                             [&](const EdgeList& part) { return shadow_candidates(scene, part, false); }),
                    0.0);
    if (decided.computes(Part::kEnvironmentShadows))
        // Directions to an environment image are sampled by the image, not in cells.
        add_shadows(kEnvironmentShadow, silhouettes(),
                    scene.environment_image.sampled
                        ? 0.0
                        : kDirectionSegments * (kBoundaryTable[kEnvironmentShadow].share * picture));
    if (decided.computes(Part::kEmitterOutlines) && scene.face_fixed_direction) {
        const Candidates outlines = emitter_candidates(scene, edges);
        if (has_edges(Part::kEmitterOutlines, outlines.size(), outlines.counts))
            add_whole_picture(kEmitterOutline, [&] {
                return std::make_shared<EdgeTree>(scene, edges.tables, outlines, true);
            });
    }
    if (decided.computes(Part::kIndirectEdges)) {
        const Found& found = silhouettes();
        const bool any = has_edges(Part::kIndirectEdges, found.size(), found.counts());
        if (!any) decided.none(Part::kCameraSampledIndirect, decided[Part::kIndirectEdges].reason);
        if (any && decided.computes(Part::kCameraSampledIndirect) &&
            decided.lists_materials(Part::kCameraSampledIndirect, camera_sampled(scene, edges.tables, alpha)))
            add_whole_picture(kCameraSampledIndirect, [&] {
                return edges.kept.tree.get(sides,
                                           [&] { return EdgeTree(scene, edges.tables, *found.whole); });
            });
        const BoundaryKindRow& row = kBoundaryTable[kIndirectBoundary];
        found.each([&](const SharedCandidates& list, double of_samples, double factor) {
            const double samples = of_samples * row.share * picture;
            add(
                kIndirectBoundary, *list,
                [&] {
                    return over_directions(*list, kDirectionSegments * samples,
                                           row.chains(options.max_depth));
                },
                learned_cells(samples), samples, {}, factor);
        });
    }
    for (CurveTerm& curve :
         curve_terms(scene, edges, options, motion,
                     decided.forces(Part::kPrimaryEdges) ? nullptr : seen.get(), decided)) {
        const double samples = share_of(curve.kind) * kBoundaryTable[curve.kind].share * picture;
        SamplePlan plan(std::move(curve.candidates), samples, samples, options, curve.kind,
                        options.two_passes);
        if (curve.kind == kWarpedPicture) {
            if (plan.total(0) > 0)
                terms.push_back(std::make_unique<WarpTerm>(
                    std::move(plan), BoundaryTerm::Lines{std::move(curve.lines), nullptr}, options,
                    scene.camera));
            continue;
        }
        // Intersections of surfaces and curves on fields are not camera-sampled.
        keep(std::move(plan), {std::move(curve.lines), nullptr},
             kBoundaryTable[curve.kind].least_depth > 2 ? 0.0f : alpha, nullptr);
    }
    return terms;
}

// The sum has the least variance if the number of samples of each term is proportional to the standard
// deviation of one sample (Neyman 1934). The error of systematic samples falls faster than that of random
// ones, so terms keep somewhat more samples than this rule says.
double guide_second_passes(const BoundaryTerms& terms) {
    constexpr double kLeast = 0.02, kSlack = 2.0;
    std::vector<double> noise;
    double most = 0.0;
    for (const auto& term : terms) {
        SamplePlan& plan = term->plan();
        if (plan.passes() < 2) continue;
        may_cancel();
        plan.guide();
        noise.push_back(plan.noise());
        most = std::max(most, noise.back() / static_cast<double>(plan.total(1)));
    }
    if (!(most > 0.0)) return 0.0;
    double variance = 0.0;
    size_t k = 0;
    for (const auto& term : terms) {
        SamplePlan& plan = term->plan();
        if (plan.passes() < 2) continue;
        const double sample = noise[k++];
        const double needed = sample / static_cast<double>(plan.total(1));
        plan.thin(std::clamp(kSlack * needed / most, kLeast, 1.0));
        variance += sample * sample / static_cast<double>(plan.total(1));
    }
    return variance;
}

}  // namespace edgegrad
