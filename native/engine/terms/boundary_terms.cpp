#include "engine/terms/boundary_terms.h"

#include <algorithm>
#include <optional>
#include <type_traits>

#include "boundary/curves/mirror_faces.h"
#include "boundary/curves/segment_cells.h"
#include "engine/decisions/mirrored_edges.h"
#include "engine/terms/caustic_term.h"
#include "engine/terms/curve_terms.h"
#include "engine/terms/found_edges.h"
#include "engine/terms/warp_term.h"
#include "scene/lights/light_list.h"
#include "scene/sharp_lobes.h"
#include "tasks/boundary_kind.h"
#include "tasks/seed_tags.h"

namespace edgegrad {
namespace {

// Up to so many edges, shadows of the environment are sampled from the camera even if no lobe needs a tree of
// the edges. A larger tree takes more time than the samples are worth.
constexpr int64_t kMostTreeEdges = 16384;

// Collects the terms of a call, one method for each group of boundary kinds.
class TermBuilder {
 public:
    TermBuilder(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                const RequestedMotion& motion, LearnedSampling* learned, Decisions& decided)
        : scene_(scene),
          edges_(edges),
          options_(options),
          motion_(motion),
          learned_(learned),
          decided_(decided),
          picture_(static_cast<double>(scene.camera.width) * scene.camera.height * options.samples),
          mesh_sides_(edges.solid_side, edges.solid_side + edges.tables.visible_meshes) {
        // Samples that start at the camera look for edges in a tree, which needs all of them.
        const bool needs_all = (decided.computes(Part::kCameraSampledIndirect) ||
                                decided.computes(Part::kCameraSampledShadows)) &&
                               !camera_sampled_materials(kShadowSegments).empty();
        in_windows_ = edges.windows > 1 && !decided.alone() && !needs_all;
    }

    void add_primary_edges();
    void add_camera_sampled_shadows();
    void add_light_shadows();
    void add_environment_shadows();
    void add_emitter_outlines();
    void add_indirect_edges();
    void add_contact_borders();
    // Intersections of surfaces and curves on distance fields
    void add_curves();
    void add_caustics();
    BoundaryTerms take() { return std::move(terms_); }

 private:
    double most_samples(BoundaryKind kind) const { return kBoundaryTable[kind].share * picture_; }
    double learned_share(BoundaryKind kind) const {
        return learned_ ? learned_->share[kBoundaryTable[kind].term()] : 1.0;
    }
    bool chains(BoundaryKind kind) const { return kBoundaryTable[kind].chains(options_.max_depth); }
    // `segments`: of the shortest paths with a perfect and another bounce before the segment. `part`: of the
    // widest alpha, that of lobes that reflect.
    std::vector<int32_t> camera_sampled_materials(int segments, float part = 1.0f) const {
        const float widest = options_.camera_sampled_alpha;
        if (!(widest > 0.0f)) return {};
        return edgegrad::camera_sampled_materials(scene_, edges_.tables, part * widest,
                                                  kCameraSampledThrough * widest,
                                                  options_.max_depth >= segments);
    }
    template <typename Key, typename Search>
    FoundEdges search(Kept<Key, Candidates>& kept, const std::type_identity_t<Key>& key, const Search& find) {
        return searched(edges_, in_windows_, kept, key, find);
    }
    const FoundEdges& silhouettes();
    FoundEdges by_reach(const FoundEdges& found, bool of_lights = false);
    const FoundEdges& reaching();  // the silhouettes, by their reach
    const SharedCandidates& mirrors(bool lit);
    std::vector<uint8_t> throwing() const { return throwing_materials(edges_.tables, scene_.thrown_alpha); }
    std::shared_ptr<const LightBeams> light_beams();
    bool has_edges(Part part, int64_t size, const EdgeCounts& counts);
    void keep(SamplePlan plan, BoundaryTerm::Lines lines, LearnedWeights* weights);
    template <typename Segments>
    void add(BoundaryKind kind, const Candidates& found, const Segments& segments, double cells,
             double samples, BoundaryTerm::Lines lines = {}, double factor = 1.0);
    void add_from_camera(BoundaryKind kind, const BoundaryTerm::Lines& lines, bool further = true,
                         double share = 1.0);
    void add_shadows(BoundaryKind kind, const FoundEdges& found, double directions,
                     BoundaryTerm::Lines lines = {});
    void add_between(BoundaryKind kind, const FoundEdges& found);
    std::shared_ptr<const EdgeTree> edge_tree(const FoundEdges& found) const;

    const SceneView& scene_;
    const EdgeList& edges_;
    const RenderOptions& options_;
    const RequestedMotion& motion_;
    LearnedSampling* const learned_;  // null: nothing is learned
    Decisions& decided_;
    const double picture_;  // samples of the picture
    const EdgeCache::Sides mesh_sides_;
    bool in_windows_;
    std::optional<FoundEdges> silhouettes_, reaching_;
    std::optional<std::shared_ptr<const EdgeReach>> reach_;
    SharedCandidates mirrors_[2];  // null: not listed yet
    std::optional<std::shared_ptr<const LightBeams>> beams_;
    std::shared_ptr<const Intersections> seen_;
    // Of shadows of the environment and of emissive meshes, if they are sampled from the camera, too
    BoundaryTerm::Lines shared_;
    BoundaryTerms terms_;
};

void TermBuilder::keep(SamplePlan plan, BoundaryTerm::Lines lines, LearnedWeights* weights) {
    if (plan.total(0) > 0)
        terms_.push_back(
            std::make_unique<BoundaryTerm>(std::move(plan), std::move(lines), weights,
                                           plan.kind() == kIndirectBoundary ? light_beams() : nullptr));
}

// Adds samples of candidates by their learned weights, or of `segments()`, from which about `cells` cells are
// learned. `factor` multiplies the estimate from the candidates.
template <typename Segments>
void TermBuilder::add(BoundaryKind kind, const Candidates& found, const Segments& segments, double cells,
                      double samples, BoundaryTerm::Lines lines, double factor) {
    if (decided_.alone()) return;
    // Each call lists other edges of instances, of which nothing can be learned.
    LearnedWeights* weights = learned_ && factor == 1.0 ? &learned_->weights[kind] : nullptr;
    const bool known = weights && weights->knows(edges_, found);
    auto sampled = known ? shared(weights->pieces(found)) : shared(segments());
    if (weights && !known) weights->begin(edges_, found, sampled->direction_cells, sampled->chained(), cells);
    const double share = learned_share(kind);
    RenderOptions own = options_;
    if (factor != 1.0) own.seed ^= kWindowSeed;
    keep(SamplePlan(std::move(sampled), share * samples, share * most_samples(kind), own, kind,
                    options_.two_passes && !known, static_cast<float>(factor)),
         std::move(lines), weights);
}

// The same for kinds whose samples start at the camera, with a `share` of the samples. `further`: also at
// surfaces behind the first, which sharp lobes show.
void TermBuilder::add_from_camera(BoundaryKind kind, const BoundaryTerm::Lines& lines, bool further,
                                  double share) {
    const double samples = share * most_samples(kind);
    const auto cells = [&] { return over_picture(kPictureSegments * samples, further && chains(kind)); };
    add(kind, whole_picture(), cells, 0.0, samples, lines);
}

// Edges that are silhouettes from some point. Several parts share one search.
const FoundEdges& TermBuilder::silhouettes() {
    if (!silhouettes_)
        silhouettes_ = search(edges_.kept.silhouettes, mesh_sides_,
                              [&](const EdgeList& part) { return shadow_candidates(scene_, part, true); });
    return *silhouettes_;
}

// Edges weighted by their reach, for which several parts share the places that are seen.
FoundEdges TermBuilder::by_reach(const FoundEdges& found, bool of_lights) {
    if (decided_.alone() || (of_lights && !EdgeReach::serves(edges_.lights->view()))) return found;
    if (!reach_) reach_ = EdgeReach::find(scene_, edges_, options_);
    return *reach_ ? weighted(**reach_, scene_, edges_, found, of_lights) : found;
}

const FoundEdges& TermBuilder::reaching() {
    if (!reaching_) reaching_ = by_reach(silhouettes());
    return *reaching_;
}

// Faces of mirrors and smooth glass (boundary/curves/mirror_faces.h), which outlines, edges and beams share.
const SharedCandidates& TermBuilder::mirrors(bool lit) {
    SharedCandidates& list = mirrors_[lit];
    if (!list) list = shared(mirror_faces(scene_, edges_.tables, throwing(), lit));
    return list;
}

// Beams over mirrors and smooth glass. Two kinds share one pilot.
std::shared_ptr<const LightBeams> TermBuilder::light_beams() {
    constexpr double kPart = 0.0625, kFewest = 1024.0, kMost = 4096.0;
    if (beams_) return *beams_;
    beams_ = nullptr;
    const bool listed = decided_[Part::kCausticEdges].reason != Reason::kNotEstimated;
    const std::vector<uint8_t> throws = throwing();
    if (!listed || std::find(throws.begin(), throws.end(), 1) == throws.end()) return nullptr;
    std::vector<SharedCandidates> found;
    silhouettes().each([&](const SharedCandidates& list, double, double) { found.push_back(list); });
    beams_ = LightBeams::find(scene_, edges_, options_, {mirrors(false), mirrors(true)}, found, throws,
                              std::clamp(kPart * picture_, kFewest, kMost));
    return *beams_;
}

// Whether the search for a part's edges has found any. Adds their counts to the decision.
bool TermBuilder::has_edges(Part part, int64_t size, const EdgeCounts& counts) {
    Decision& d = decided_[part];
    const int64_t still = d.edges.still;
    d.edges = counts, d.edges.still = still;
    if (size == 0)
        decided_.none(part,
                      part == Part::kPrimaryEdges && counts.kept > 0 ? Reason::kOutOfView : Reason::kFlat);
    return size > 0;
}

void TermBuilder::add_primary_edges() {
    if (!decided_.computes(Part::kPrimaryEdges)) return;
    // Light of a fixed direction near contact (scene/contact.h) moves over all intersections. One search
    // then serves both parts.
    RequestedMotion wider = motion_;
    // If the part is forced, edges of all meshes are candidates.
    const bool forced = decided_.forces(Part::kPrimaryEdges);
    wider.camera |= scene_.mesh_contact != nullptr || forced;
    RequestedMotion moving = motion_;
    moving.camera |= forced;
    seen_ = edges_.kept.intersections.get({wider.camera, wider.instances, wider.moving},
                                          [&] { return find_intersections(edges_, wider, 1 << kCameraRay); });
    Intersections shown = moving_intersections(edges_.tables, moving, *seen_);
    decided_.found(Part::kSeenIntersections, edges_.tables, shown);
    decided_.found_coincident(edges_.tables, shown, motion_);
    auto lines = std::make_shared<EdgesAndIntersections>(edges_.tables, std::move(shown));
    const FoundEdges found =
        search(edges_.kept.primary, {{scene_.camera}, moving}, [&](const EdgeList& part) {
            Candidates all = primary_candidates(scene_, part, moving);
            if (part.part != EdgeList::kWindows) lines->add_candidates(scene_.camera, all);
            return all;
        });
    has_edges(Part::kPrimaryEdges, found.size(), found.counts());
    // As many samples per pixel of an edge's length as the picture has per pixel
    const double all = std::min(found.mass() * options_.samples, most_samples(kPrimaryBoundary));
    const double part = scattered(found.size(), 1.0, all);
    const double samples = std::max(part * all, (part < 1.0 ? kLeastScattered : kLeastPrimary) * picture_);
    found.each([&](const SharedCandidates& list, double of_samples, double factor) {
        add(
            kPrimaryBoundary, *list, [&] { return list; }, learned_cells(samples), of_samples * samples,
            {lines, nullptr}, factor);
    });
}

// Samples along edges, `directions` of them in learned cells.
void TermBuilder::add_shadows(BoundaryKind kind, const FoundEdges& found, double directions,
                              BoundaryTerm::Lines lines) {
    if (!has_edges(kBoundaryTable[kind].part, found.size(), found.counts())) return;
    const double all = (found.by_reach ? kReachingShadows : 1.0) * most_samples(kind);
    const double part = scattered(found.size(), kSamplesTowardsLight, all);
    found.each([&](const SharedCandidates& list, double of_samples, double factor) {
        const double own = of_samples * part;
        add(
            kind, *list, [&] { return over_directions(*list, own * directions, chains(kind)); },
            learned_cells(own * all), own * all, lines, factor);
    });
}

// The tree of all edges, in which samples that start at the camera look for edges; null if none are taken.
std::shared_ptr<const EdgeTree> TermBuilder::edge_tree(const FoundEdges& found) const {
    if (decided_.alone()) return nullptr;
    return edges_.kept.tree.get(mesh_sides_, [&] { return EdgeTree(scene_, edges_.tables, *found.whole); });
}

void TermBuilder::add_camera_sampled_shadows() {
    constexpr Part kPart = Part::kCameraSampledShadows;
    if (!decided_.computes(kPart)) return;
    auto lobes = camera_sampled_materials(kShadowSegments);
    std::vector<int32_t> faces;
    if (!lobes.empty() && decided_.computes(Part::kLightShadows))
        faces = camera_sampled_emitters(scene_, edges_.tables);
    if (!scene_.has_environment && faces.empty())
        lobes = camera_sampled_materials(kShadowSegments, kReflectedShadows);
    const bool behind = !lobes.empty(), table = scene_.lights.all_sized() > 0;
    const bool lit = !faces.empty() || (table && options_.max_depth > 2);
    if (!scene_.has_environment && !(behind && lit)) return decided_.none(kPart, Reason::kNone);
    const FoundEdges& found = silhouettes();
    if (!has_edges(kPart, found.size(), found.counts())) return;
    // Shadows of the environment are sampled on all materials
    const bool few = edges_.windows == 1 && found.counts().kept <= kMostTreeEdges;
    if (!behind && !few) return decided_.none(kPart, Reason::kNone);
    decided_[kPart].materials = std::move(lobes);
    const bool shares_faces = !faces.empty();
    if (shares_faces) decided_[kPart].meshes = std::move(faces);
    const double share = behind ? 1.0 : kWithoutSharpLobes;
    const auto from_camera = static_cast<float>(share * kBoundaryTable[kCameraSampledShadow].share);
    const BoundaryTerm::Lines lines{nullptr, edge_tree(found), from_camera, shares_faces};
    if (scene_.has_environment || shares_faces) shared_ = lines;
    add_from_camera(kCameraSampledShadow, lines, behind, share);
}

void TermBuilder::add_light_shadows() {
    if (!decided_.computes(Part::kLightShadows)) return;
    const auto search_edges = [&](const EdgeList& part) { return shadow_candidates(scene_, part, false); };
    const FoundEdges found = search(edges_.kept.shadow, {edges_.lights, mesh_sides_}, search_edges);
    add_shadows(kShadowBoundary, by_reach(found, true), 0.0,
                shared_.shares_faces ? shared_ : BoundaryTerm::Lines{});
}

void TermBuilder::add_environment_shadows() {
    if (!decided_.computes(Part::kEnvironmentShadows)) return;
    // Directions to an environment image are sampled by the image, not in cells.
    const double directions =
        scene_.environment_image.sampled ? 0.0 : kDirectionSegments * most_samples(kEnvironmentShadow);
    add_shadows(kEnvironmentShadow, reaching(), directions, shared_);
}

void TermBuilder::add_emitter_outlines() {
    if (!decided_.computes(Part::kEmitterOutlines) || !scene_.face_fixed_direction) return;
    const Candidates outlines = emitter_candidates(scene_, edges_);
    if (has_edges(Part::kEmitterOutlines, outlines.size(), outlines.counts) && !decided_.alone())
        add_from_camera(kEmitterOutline,
                        {nullptr, std::make_shared<EdgeTree>(scene_, edges_.tables, outlines, true)});
}

// Samples along edges between surfaces, in directions of learned cells.
void TermBuilder::add_between(BoundaryKind kind, const FoundEdges& found) {
    found.each([&](const SharedCandidates& list, double of_samples, double factor) {
        const double samples = of_samples * (found.by_reach ? kReachingLight : 1.0) * most_samples(kind);
        const auto cells = [&](const Candidates& edges) {
            return over_directions(edges, kDirectionSegments * samples, chains(kind));
        };
        const auto segments = [&] {
            const auto beams = kind == kIndirectBoundary ? light_beams() : nullptr;
            return cells(beams ? beams->behind_mirrors(scene_, *list) : *list);
        };
        add(kind, *list, segments, learned_cells(samples), samples, {}, factor);
    });
}

void TermBuilder::add_indirect_edges() {
    if (!decided_.computes(Part::kIndirectEdges)) return;
    const FoundEdges& found = silhouettes();
    const bool any = has_edges(Part::kIndirectEdges, found.size(), found.counts());
    if (!any) decided_.none(Part::kCameraSampledIndirect, decided_[Part::kIndirectEdges].reason);
    if (any && decided_.computes(Part::kCameraSampledIndirect) &&
        decided_.lists_materials(Part::kCameraSampledIndirect, camera_sampled_materials(kShadowSegments + 1)))
        add_from_camera(kCameraSampledIndirect, {nullptr, edge_tree(found)});
    add_between(kIndirectBoundary, reaching());
}

void TermBuilder::add_contact_borders() {
    if (!decided_.computes(Part::kContactBorders) || !scene_.sampled_borders) return;
    const FoundEdges found = search(edges_.kept.borders, mesh_sides_,
                                    [&](const EdgeList& part) { return border_candidates(scene_, part); });
    if (!has_edges(Part::kContactBorders, found.size(), found.counts())) return;
    add_between(kContactBorder, by_reach(found));
}

void TermBuilder::add_curves() {
    const Intersections* seen = decided_.forces(Part::kPrimaryEdges) ? nullptr : seen_.get();
    for (CurveTerm& curve : curve_terms(scene_, edges_, options_, motion_, seen, decided_)) {
        const double samples = learned_share(curve.kind) * most_samples(curve.kind);
        SamplePlan plan(std::move(curve.candidates), samples, samples, options_, curve.kind,
                        options_.two_passes);
        BoundaryTerm::Lines lines{std::move(curve.lines), nullptr};
        if (curve.kind == kWarpedPicture) {
            if (plan.total(0) > 0)
                terms_.push_back(
                    std::make_unique<WarpTerm>(std::move(plan), std::move(lines), options_, scene_.camera));
            continue;
        }
        keep(std::move(plan), std::move(lines), nullptr);
    }
}

void TermBuilder::add_caustics() {
    const auto samples = [&](BoundaryKind kind) { return learned_share(kind) * most_samples(kind); };
    if (decided_.computes(Part::kCausticOutlines) && !decided_.alone())
        add_caustic_outlines(terms_, options_, *mirrors(true), samples(kCausticOutline));
    if (!decided_.computes(Part::kCausticEdges)) return;
    const FoundEdges& found = silhouettes();
    if (has_edges(Part::kCausticEdges, found.size(), found.counts()) && !decided_.alone())
        add_caustic_edges(terms_, scene_, edges_, options_, found, samples(kCausticEdge), mirrors(false),
                          light_beams());
}

}  // namespace

void BoundaryTerm::run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) {
    BoundaryTask task = plan_.task(pass, first, count);
    task.dropped = &lost;
    if (lines_.tree) task.tree = lines_.tree->view();
    task.from_camera = lines_.from_camera;
    task.shares_faces = lines_.shares_faces;
    if (beams_) task.beams = beams_->towards_mirrors();
    const BoundaryKernels& kernels = run.kernels.boundary[task.kind];
    if (run.is_forward())
        kernels.forward(view(run.scene), task, run.work(), run.view, run.splats);
    else
        kernels.backward(view(run.scene), task, run.work(), run.adjoint, run.view);
}

BoundaryTerms boundary_terms(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                             const RequestedMotion& motion, LearnedSampling* learned, Decisions& decided) {
    TermBuilder builder(scene, edges, options, motion, learned, decided);
    builder.add_primary_edges();
    builder.add_camera_sampled_shadows();
    builder.add_light_shadows();
    builder.add_environment_shadows();
    builder.add_emitter_outlines();
    builder.add_indirect_edges();
    builder.add_contact_borders();
    builder.add_curves();
    builder.add_caustics();
    return builder.take();
}

}  // namespace edgegrad
