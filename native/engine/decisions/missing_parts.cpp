#include "engine/decisions/missing_parts.h"

#include <algorithm>

#include "boundary/curves/edge_cache.h"
#include "boundary/curves/light_intersections.h"
#include "boundary/curves/texture_borders.h"
#include "boundary/fields/field_curves.h"
#include "boundary/fields/field_lights.h"
#include "boundary/meshes/normals_below.h"
#include "boundary/meshes/star_shaped.h"
#include "boundary/meshes/trees/face_tree.h"
#include "engine/decisions/clip_borders.h"
#include "engine/decisions/decisions.h"
#include "engine/decisions/interior_rules.h"
#include "engine/decisions/mirrored_edges.h"
#include "engine/decisions/value_sources.h"
#include "scene/closure_programs.h"
#include "scene/lights/light_params.h"
#include "scene/mesh_instances.h"
#include "scene/sharp_lobes.h"
#include "scene/textures/jumps.h"
#include "sdf/carrier/carrier.h"
#include "tasks/scan_task.h"

namespace edgegrad {
namespace {

// Whether a closure's textures jump within faces.
bool jumps_within_faces(const SceneTables& tables, size_t closure) {
    return texture_jumps(tables, closure).any();
}

class Search {
 public:
    Search(const BoundaryFacts& facts, const Requested& requested, const std::vector<uint8_t>& closed,
           int threads, Decisions& decided)
        : f_(facts),
          tables_(facts.tables),
          motion_(facts.motion),
          requested_(requested),
          closed_(closed),
          threads_(threads),
          kept_(facts.kept),
          decided_(decided),
          moving_(moving_meshes(facts.tables, facts.motion)),
          surface_moves_(moving_surfaces(facts.tables, facts.motion)) {
        any_moves_ = motion_.camera || motion_.lights || motion_.rotation || motion_.any_mesh_moves() ||
                     motion_.any_field_moves();
        chains_turn_ = mirrors_turn(facts);
    }

    void seen_by_the_camera() {
        const CameraView& camera = f_.scene.camera;
        const auto boxes = kept_.boxes.get(true, [&] { return MeshBoxes(tables_); });
        std::vector<int32_t> large, closed, cut;
        const auto instances = mesh_instances(tables_);
        for (int32_t mesh = 0; mesh < tables_.visible_meshes; ++mesh) {
            const auto m = static_cast<size_t>(mesh);
            if (!motion_.camera && !moving_[m]) continue;
            const int32_t first = tables_.mesh_first_face[m], last = tables_.mesh_first_face[m + 1];
            if (last - first > kSelfIntersectionFaces) (closed_[m] ? closed : large).push_back(mesh);
            if (mesh < tables_.first_field() && !is_placed(instances[m]) &&
                may_be_cut(camera, boxes->of[m]) && is_cut(camera, tables_, m))
                cut.push_back(mesh);
        }
        if (!closed.empty()) {
            const auto others = kept_.not_star_shaped.get(closed, [&] { return not_star_shaped(closed); });
            large.insert(large.end(), others->begin(), others->end());
            std::sort(large.begin(), large.end());
        }
        meshes(Part::kSelfIntersections, std::move(large), kSelfIntersectionFaces);
        meshes(Part::kClipBorders, std::move(cut));
        wide_lens();
        meshes(Part::kTexelBorders, jumping_meshes(tables_, motion_, kept_)->left_out);
        if (any_moves_)
            materials(Part::kRayHistories, used_materials(tables_, [&](size_t k) {
                          return any_step(tables_, k, reads_ray_history<TextureInstruction>);
                      }));
        slid_textures();
        lights_by_parallel_rays();
    }

    // The ways between transparent surfaces are constants in sweeps.
    void absorbing_surfaces() {
        materials(Part::kClearAbsorption, used_materials(tables_, [&](size_t k) {
                      const size_t values = kMaterialParams * k + kAbsorption;
                      const int32_t flags = tables_.closure_flags[k];
                      return (flags & kHasAbsorption) && (flags & kHasTransparency) &&
                             (any_moves_ || requested_.any("closure_params", values, values + 3));
                  }));
    }

    void lit_surfaces() {
        if (f_.options.max_depth < 2 || all_black(f_.scene, tables_)) return;
        const LightView& lights = f_.scene.lights;
        const bool sized = lights.face_light || lights.all_sized() > 0;
        if ((sized || f_.scene.has_environment) && (any_moves_ || changes_densities(requested_)))
            meshes(Part::kPartlySeenShadows, partly_met_meshes(tables_, kScatteredRays | 1 << kShadowRay));
        if (!any_moves_) return;
        light_jumps();
        face_flips();
        materials(Part::kSteppedShadows, used_materials(tables_, [&](size_t k) {
                      return (tables_.closure_flags[k] & kHasTransparency) && jumps_within_faces(tables_, k);
                  }));
    }

    // What fields lack.
    void fields() {
        if (tables_.fields.empty() || !any_moves_) return;
        const auto carriers = field_carriers(tables_, kept_, threads_);
        std::vector<int32_t> ended, thin;
        for (int32_t mesh = tables_.first_field(); mesh < tables_.visible_meshes; ++mesh) {
            const auto k = static_cast<size_t>(mesh - tables_.first_field());
            if (may_end_at_its_box(tables_.fields[k].view())) ended.push_back(mesh);
            if (!(*carriers)[k].complete) thin.push_back(mesh);
        }
        if (motion_.camera || motion_.any_mesh_moves() || motion_.any_field_moves())
            meshes(Part::kFieldBorders, std::move(ended));
        meshes(Part::kThinFields, std::move(thin));
        lights_in_fields();
        narrow_lobes();
    }

    void mirrored() {
        if (f_.options.max_depth < 2) return;
        if (any_moves_ || normals_turn()) {
            const auto below =
                kept_.normals_below.get(true, [&] { return normals_below(tables_, threads_); });
            materials(Part::kTurnedNormals, used_materials(tables_, [&](size_t k, size_t m) {
                          return may_end_at_its_normal(tables_, k, (*below)[m] != 0);
                      }));
        }
        const std::vector<int32_t> smooth =
            used_materials(tables_, [&](size_t k) { return may_be_specular(tables_, k); });
        rim_lines();
        if (smooth.empty()) return;
        if (chains_turn_)
            materials(Part::kTotalReflection, used_materials(tables_, [&](size_t k) {
                          return tables_.closure_kind[k] == kRefraction && may_be_specular(tables_, k);
                      }));
        if (f_.chains && f_.options.max_depth > kMostChain) materials(Part::kLongChains, smooth, kMostChain);
        pierced(Part::kMirroredLines, [&](size_t row, size_t mesh) {
            return is_sized(tables_.lights.kind[row]) &&
                   (chains_turn_ || moving_[mesh] || light_moves(static_cast<int32_t>(row))) &&
                   (tables_.lights.visible_to[row] & tables_.mesh_mask[mesh] & kBentRays) != 0;
        });
        const auto& caustics = decided_.at(Part::kCausticEdges);
        const bool none = caustics && caustics->reason == Reason::kUnshaded;
        if (f_.options.max_depth > 2 && (any_moves_ || f_.chains) && !none)
            materials(Part::kCaustics, smooth);
        if ((any_moves_ || f_.chains) && f_.options.terms[kShadowTerm] &&
            f_.options.max_depth >= kShadowSegments) {
            FurtherShadows left = missing_further_shadows(f_.scene, tables_);
            if (!left.lights.empty() || !left.meshes.empty()) materials(Part::kFurtherShadows, smooth);
            lights(Part::kFurtherShadows, std::move(left.lights));
            meshes(Part::kFurtherShadows, std::move(left.meshes));
        }
    }

 private:
    // Whether shading normals may turn, or the normals of faces.
    bool normals_turn() const {
        return requested_.any("normals") || requested_.textures() ||
               (requested_.span("closure_params").columns &
                Requested::columns(kNormalMap, kNormalStrength + 1)) != 0;
    }

    Decision& miss(Part part, int64_t limit = 0) {
        Decision& found = decided_.missing(part);
        found.limit = limit;
        return found;
    }
    void meshes(Part part, std::vector<int32_t> found, int64_t limit = 0) {
        if (!found.empty()) miss(part, limit).meshes = std::move(found);
    }
    void lights(Part part, std::vector<int32_t> found) {
        if (!found.empty()) miss(part).lights = std::move(found);
    }
    void materials(Part part, std::vector<int32_t> found, int64_t limit = 0) {
        if (!found.empty()) miss(part, limit).materials = std::move(found);
    }

    std::vector<int32_t> sized_lights(int32_t seen_by) const {
        std::vector<int32_t> out;
        for (size_t row = 0; row < tables_.lights.kind.size(); ++row)
            if (is_sized(tables_.lights.kind[row]) && (tables_.lights.visible_to[row] & seen_by))
                out.push_back(static_cast<int32_t>(row));
        return out;
    }

    // Whether anything but the strength of a light is requested.
    bool light_moves(int32_t row) const {
        const size_t first = kLightParams * static_cast<size_t>(row);
        return requested_.any("light_params", first + kLightPosition, first + kLightParams);
    }

    std::vector<int32_t> not_star_shaped(std::vector<int32_t> closed) const {
        std::erase_if(closed, [&](int32_t mesh) {
            return is_star_shaped(tables_, static_cast<size_t>(mesh), threads_);
        });
        return closed;
    }

    // An edge's samples draw the point of the lens. If the blurred edge covers very many pictures, nearly all
    // of them miss this one.
    void wide_lens() {
        const CameraView& c = f_.scene.camera;
        if (c.kind != kPerspective || !(c.aperture_radius > 0.0f)) return;
        constexpr double kMostPictures = 30.0;
        const double blur = double{c.focal} * c.aperture_radius / c.focus_distance;
        const double picture = double(c.full_width) * c.full_height;
        if (any_moves_ && blur * blur > kMostPictures * picture) miss(Part::kWideLens);
    }

    // Textures with jumps that move over static meshes. Pixels of images move those that depend on their
    // values.
    void slid_textures() {
        const bool moves = requested_.any("texture_attributes") || requested_.any("texture_lookups") ||
                           requested_.any("texture_constants");
        if (!moves && !requested_.any("texture_pixels")) return;
        const auto reads = [&](const TextureInstruction& step) {
            return reads_requested(f_.scene.textures, requested_, step);
        };
        materials(Part::kSlidTextures, used_materials(tables_, [&](size_t k) {
                      const TextureJumps jumps = texture_jumps(tables_, k);
                      return moves ? jumps.any() : jumps.by_images && any_step(tables_, k, reads);
                  }));
    }

    // Lights whose outlines or intersections depend on the origin of parallel rays.
    void lights_by_parallel_rays() {
        const CameraView& c = f_.scene.camera;
        if (c.kind != kOrthographic) return;
        const SceneTables::LightRows& rows = tables_.lights;
        if (c.aperture_radius > 0.0f && (motion_.camera || motion_.lights)) {
            std::vector<int32_t> blurred = sized_lights(1 << kCameraRay);
            std::erase_if(blurred, [&](int32_t row) {
                const int32_t kind = rows.kind[static_cast<size_t>(row)];
                return (kind != kDiskLight && kind != kConeLight) || !(motion_.camera || light_moves(row));
            });
            lights(Part::kBlurredOutlines, std::move(blurred));
        }
        if (f_.options.max_depth > 1) suns_in_flat_mirrors();
        if (std::find(rows.kind.begin(), rows.kind.end(), kDiskLight) == rows.kind.end()) return;
        pierced(Part::kParallelDisks, [&](size_t row, size_t mesh) {
            return rows.kind[row] == kDiskLight && (motion_.camera || motion_.lights || moving_[mesh]) &&
                   (rows.visible_to[row] & tables_.mesh_mask[mesh] & (1 << kCameraRay)) != 0;
        });
    }

    // A flat face turns parallel rays into one direction, in which a sun is or is not. It appears on all of
    // the face at once, at a single value of the parameters.
    void suns_in_flat_mirrors() {
        bool any_sun = false, moves = motion_.camera;
        for (const int32_t row : sized_lights(kBentRays)) {
            if (tables_.lights.kind[static_cast<size_t>(row)] != kConeLight) continue;
            any_sun = true;
            moves = moves || light_moves(row);
        }
        if (!any_sun) return;
        const std::vector<uint8_t> smooth = throwing_materials(tables_, 0.0f);
        std::vector<int32_t> flat;
        for (int32_t mesh = 0; mesh < tables_.first_field(); ++mesh) {
            const auto m = static_cast<size_t>(mesh);
            const auto is_flat = [&](size_t face) {
                const auto material = static_cast<size_t>(tables_.face_material[face]);
                return smooth[material] &&
                       (tables_.corner_normal.empty() || tables_.corner_normal[3 * face] < 0);
            };
            if (!moves && !moving_[m]) continue;
            bool found = false;
            for (int32_t f = tables_.mesh_first_face[m]; f < tables_.mesh_first_face[m + 1] && !found; ++f)
                found = is_flat(static_cast<size_t>(f));
            if (found) flat.push_back(mesh);
        }
        meshes(Part::kParallelMirrors, std::move(flat));
    }

    // Light of the table jumps on a surface that passes through its source, and where its source lies in a
    // surface, which hides it or not.
    void light_jumps() {
        if (f_.scene.lights.sized_count == 0) return;
        auto on_faces = lights_on_faces(
            tables_,
            [&](size_t row, size_t mesh) { return moving_[mesh] || light_moves(static_cast<int32_t>(row)); },
            threads_);
        if (!on_faces.empty()) miss(Part::kCoincidentFaces).pierced = std::move(on_faces);
        std::vector<uint8_t> lit(static_cast<size_t>(tables_.visible_meshes), 0);
        for (size_t m = 0; m < lit.size(); ++m)
            for (int32_t f = tables_.mesh_first_face[m]; f < tables_.mesh_first_face[m + 1] && !lit[m]; ++f)
                lit[m] = !is_black(f_.scene, f_.scene.face_material[f]);
        pierced(Part::kLightJumps, [&](size_t row, size_t mesh) {
            return tables_.lights.kind[row] != kDiskLight && lit[mesh] &&
                   (motion_.camera || motion_.lights || moving_[mesh]);
        });
    }

    // A light without size reaches all of a face or none of it. As it passes the plane of a face that is
    // shaded with other normals than its own, the face's radiance jumps at a single value of the parameters,
    // of which no derivative at other values has a part. Meshes with a terminator offset are lit from below
    // the planes of their faces, too: there the edges of shadows, also of their own, are not sampled.
    void face_flips() {
        std::vector<int32_t> smooth, lifted;
        if (!decided_.at(Part::kHorizons)) return;  // the shadow term is not requested
        for (const int32_t mesh : decided_[Part::kHorizons].meshes) {
            const bool below =
                f_.scene.any_terminator && tables_.mesh_terminator[static_cast<size_t>(mesh)] > 0;
            (below ? lifted : smooth).push_back(mesh);
        }
        if (f_.scene.lights.count > 0 || f_.scene.environment_image.sampled)
            meshes(Part::kLitFromBelow, std::move(lifted));
        const bool any_moves = std::any_of(smooth.begin(), smooth.end(), [&](int32_t mesh) {
            return moving_[static_cast<size_t>(mesh)] != 0;
        });
        std::vector<int32_t> found;
        for (size_t row = 0; !smooth.empty() && row < tables_.lights.kind.size(); ++row) {
            const auto light = static_cast<int32_t>(row);
            if (!is_sized(tables_.lights.kind[row]) && (any_moves || light_moves(light)))
                found.push_back(light);
        }
        if (found.empty()) return;
        lights(Part::kFaceFlips, std::move(found));
        decided_[Part::kFaceFlips].meshes = smooth;
    }

    // What fields hide of the light of narrow lobes that are not followed, which few samples find.
    void narrow_lobes() {
        // Alpha; in wider lobes more of them do. Light passes two lobes of a body of rough glass.
        constexpr float kFound = 0.05f, kFoundThrough = 0.5f;
        if (f_.options.max_depth < 2) return;
        materials(Part::kNarrowFieldLobes, used_materials(tables_, [&](size_t k) {
                      const bool through = tables_.closure_flags[k] & kHasRefraction;
                      return has_sharp_lobe(tables_, k, through ? kFoundThrough : kFound) &&
                             !may_be_specular(tables_, k, f_.scene.followed_alpha);
                  }));
    }

    // Lights that fields pass through, where the curve moves over the light or in the picture.
    void lights_in_fields() {
        auto found = fields_through_lights(tables_, kept_, threads_, [&](size_t row, size_t mesh) {
            const auto light = static_cast<int32_t>(row);
            const int32_t seen = tables_.lights.visible_to[row] & tables_.mesh_mask[mesh];
            // The part of these lights that a point sees turns with the point
            const int32_t kind = tables_.lights.kind[row];
            const bool turns = kind == kSphereLight || kind == kDiskLight;
            return surface_moves_[mesh] || light_moves(light) ||
                   (motion_.camera && (turns || (seen & (1 << kCameraRay)))) ||
                   (turns && (motion_.any_mesh_moves() || motion_.any_field_moves())) ||
                   (chains_turn_ && (seen & kBentRays));
        });
        if (!found.empty()) miss(Part::kFieldLines).pierced = std::move(found);
    }

    template <typename Wanted>
    void pierced(Part part, const Wanted& wanted) {
        const Intersections lines = lines_through_lights(tables_, wanted, threads_);
        if (lines.size() == 0) return;
        miss(part);
        decided_.found(part, tables_, lines);
    }

    // For lights without size, rims of lobes are lines on the surface.
    void rim_lines() {
        constexpr int32_t kSeen = 1 << kTransmissionRay | 1 << kDiffuseRay | 1 << kGlossyRay;
        std::vector<int32_t> found = lights_without_size(tables_, kSeen);
        if (found.empty() || !f_.options.terms[kInteriorTerm] || !rims_move(f_.scene, tables_, requested_))
            return;
        lights(Part::kRimLines, std::move(found));
        decided_[Part::kRimLines].materials = used_materials(
            tables_, [&](size_t k) { return may_have_rim(tables_, k, f_.scene.least_alpha > 0.0f); });
    }

    const BoundaryFacts& f_;
    const SceneTables& tables_;
    const RequestedMotion& motion_;
    const Requested& requested_;
    const std::vector<uint8_t>& closed_;
    const int threads_;
    EdgeCache& kept_;
    Decisions& decided_;
    const std::vector<uint8_t> moving_;         // by mesh
    const std::vector<uint8_t> surface_moves_;  // by mesh and field
    bool any_moves_, chains_turn_;
};

}  // namespace

void note_missing(const BoundaryFacts& facts, const Requested& requested, const std::vector<uint8_t>& closed,
                  int threads, Decisions& decided) {
    Search search(facts, requested, closed, threads, decided);
    search.seen_by_the_camera();
    decided.found_parting(facts, requested, threads);
    search.lit_surfaces();
    search.absorbing_surfaces();
    search.fields();
    search.mirrored();
}

}  // namespace edgegrad
