// What derivatives have computed about edges, kept for later calls with other views, seeds or sample counts
// of the same scene.
#pragma once

#include <cstring>
#include <memory>
#include <mutex>
#include <tuple>
#include <utility>
#include <vector>

#include "boundary/meshes/touching_meshes.h"
#include "scene/tables.h"
#include "scene/view.h"
#include "util/object_pool.h"

namespace edgegrad {

struct CandidateParts;
struct Candidates;
struct ContactMaterials;
struct CoplanarPolygons;
struct FieldCarrier;
struct FieldLines;
struct Intersections;
struct JumpingMeshes;
struct MaterialJumps;
struct MeshBoxes;
class EdgeTree;
class LightList;
class MeshTrees;
struct SurfaceRegions;

// The most recent value, with the key from which it was made.
template <typename Key, typename Value>
class Kept {
 public:
    // The value for `key`, made by make() unless it is stored.
    template <typename Make>
    std::shared_ptr<const Value> get(const Key& key, const Make& make) {
        const std::lock_guard<std::mutex> lock(lock_);
        if (!value_ || !(key_ == key)) {
            value_ = nullptr;  // keep nothing if make() throws
            Key made_of = key;
            value_ = std::make_shared<Value>(make());
            key_ = std::move(made_of);
        }
        return value_;
    }
    // The value for `key` if it is stored, else null.
    std::shared_ptr<const Value> find(const Key& key) {
        const std::lock_guard<std::mutex> lock(lock_);
        return value_ && key_ == key ? value_ : nullptr;
    }
    // Forgets the value and returns it.
    std::shared_ptr<Value> clear() {
        const std::lock_guard<std::mutex> lock(lock_);
        return std::move(value_);
    }

 private:
    std::mutex lock_;
    Key key_{};
    std::shared_ptr<Value> value_;
};

struct CameraKey {
    CameraView view;
    bool operator==(const CameraKey& other) const {
        return std::memcmp(&view, &other.view, sizeof view) == 0;
    }
};

struct EdgeCache {
    // The side from which the camera sees each solid body (boundary/meshes/solids.h).
    using Sides = std::vector<int8_t>;
    // Key: whether the camera moves, whether instances move, which meshes move.
    Kept<std::tuple<bool, bool, std::vector<uint8_t>>, Intersections> intersections;
    Kept<std::pair<CameraKey, RequestedMotion>, Candidates> primary;
    Kept<std::pair<CameraKey, RequestedMotion>, bool> edge_on;  // whether there is any face seen edge-on
    Kept<std::pair<std::shared_ptr<const LightList>, Sides>, Candidates> shadow;
    Kept<Sides, Candidates> silhouettes;  // for the environment and for light between surfaces
    Kept<Sides, Candidates> borders;      // of faces near contact
    Kept<Sides, EdgeTree> tree;
    Kept<bool, SurfaceRegions> regions;
    Kept<bool, CoplanarPolygons> polygons;
    Kept<bool, ContactMaterials> contact_materials;                // scene/contact_meshes.h
    Kept<bool, std::vector<int32_t>> contact_meshes;               // the same
    Kept<bool, MaterialJumps> jumps;                               // scene/textures/jumps.h
    Kept<RequestedMotion, JumpingMeshes> jumping_meshes;           // boundary/curves/texture_borders.h
    Kept<bool, std::vector<float>> mesh_sizes, transparent_boxes;  // the same
    Kept<bool, std::vector<uint8_t>> normals_below;                // boundary/meshes/normals_below.h
    Kept<bool, bool> cross;  // whether any surface intersects another surface or a light
    Kept<bool, MeshBoxes> boxes;
    Kept<bool, MeshTrees> trees;                     // for the searches of one call
    Kept<MovingMeshes, MeshPairs> touching;          // boundary/meshes/touching_meshes.h
    Kept<bool, std::vector<FieldCarrier>> carriers;  // by field (sdf/carrier/carrier.h)
    Kept<bool, std::vector<uint8_t>> open_fields;    // the same (boundary/fields/field_insides.h)
    // Outlines and patches of some fields (boundary/fields/field_curves.cpp, field_key): as the camera sees
    // them, with the seed of the points of a lens; and as lights do, or (null) lines in all directions.
    using OfLights = std::pair<std::vector<int32_t>, std::shared_ptr<const LightList>>;
    Kept<std::tuple<CameraKey, std::vector<int32_t>, uint32_t>, Intersections> seen_outlines;
    Kept<OfLights, FieldLines> lit_outlines, lit_patches, patches;
    // Curves where fields pass through surfaces that rays of a mask see (boundary/fields/field_crossings.h).
    using OfSeers = std::pair<RequestedMotion, int32_t>;
    Kept<OfSeers, Intersections> seen_crossings, lit_crossings;
    // Of some closed meshes, those that are not certainly star-shaped (boundary/meshes/star_shaped.h).
    Kept<std::vector<int32_t>, std::vector<int32_t>> not_star_shaped;
    // Reusable memory for the candidates of the primary term.
    ObjectPool<Candidates> spare_candidates;
    ObjectPool<CandidateParts> spare_parts;

    // Call after vertices have changed.
    void clear() {
        mesh_sizes.clear(), intersections.clear(), boxes.clear(), not_star_shaped.clear(), carriers.clear();
        touching.clear(), trees.clear(), seen_outlines.clear(), patches.clear(), edge_on.clear();
        clear_values();
    }
    // Call after other values have changed. What depends on vertices alone stays valid.
    void clear_values() {
        spare_candidates.give(primary.clear());
        shadow.clear(), silhouettes.clear(), borders.clear();
        lit_outlines.clear(), lit_patches.clear(), seen_crossings.clear(), lit_crossings.clear();
        tree.clear(), regions.clear(), polygons.clear(), cross.clear();
        contact_materials.clear(), contact_meshes.clear(), transparent_boxes.clear();
        jumps.clear(), jumping_meshes.clear(), open_fields.clear(), normals_below.clear();
    }
};

}  // namespace edgegrad
