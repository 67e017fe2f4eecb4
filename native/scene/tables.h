// The scene's tables by value (same names as in core/tables/tables.py), and the requested motion.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "scene/lights/environment_map.h"
#include "scene/textures/texture_tables.h"
#include "scene/view.h"
#include "sdf/field_view.h"

namespace edgegrad {

// A distance field (core/tables/fields.py).
struct FieldTable {
    const float* given;          // the caller's coefficients, until the engine has taken them
    std::vector<float> values;   // the engine's
    std::vector<uint8_t> signs;  // of blocks of the engine's coefficients (sdf/bricks/coefficient_blocks.h)
    int32_t size[3];
    double to_world[12];  // rows, from grid coordinates (sdf/field_view.h)

    size_t value_count() const {
        return static_cast<size_t>(size[0]) * static_cast<size_t>(size[1]) * static_cast<size_t>(size[2]);
    }
    FieldView view() const {
        FieldView out = field_view(values.data(), size, to_world);
        out.signs = signs.empty() ? nullptr : signs.data();
        return out;
    }
};

// Meshes and their instances, and fields: the input of BVHs.
struct GeometryTables {
    std::vector<float> vertices;
    std::vector<int32_t> faces, face_material, mesh_first_vertex, mesh_first_face;
    int32_t visible_meshes = 0;  // the first meshes; the others are area lights
    // The last of the visible meshes stand for fields, in this order: each has one face without an area.
    std::vector<FieldTable> fields;
    std::vector<int32_t> mesh_mask, mesh_receivers;
    std::vector<float> mesh_terminator, mesh_dimming;
    std::vector<int32_t> corner_normal, mesh_first_normal;
    std::vector<uint8_t> mesh_custom;
    std::vector<float> custom_normals;
    std::vector<float> normals;  // all shading normals (scene/corners/shading_normals.h)
    std::vector<int32_t> instance_mesh;
    std::vector<float> instance_to_world;
    std::vector<uint32_t> edge_vertices, edge_face_first, edge_faces, edge_opposite;
    std::vector<uint8_t> edge_sharing;  // of each edge: number of edges in its place; empty: one
    std::vector<std::array<int32_t, 2>> touching_meshes;  // pairs whose edges lie on each other
    std::vector<uint8_t> face_collinear;  // of each face: its corners lie on one line; empty: none do
    std::vector<uint8_t> material_used;   // whether visible faces have the material

    // The first of the meshes that stand for fields, and their first face.
    int32_t first_field() const { return visible_meshes - static_cast<int32_t>(fields.size()); }
    int32_t first_field_face() const { return mesh_first_face[static_cast<size_t>(first_field())]; }
};

// Materials, lights, environment and camera.
struct ValueTables {
    std::vector<int32_t> material_first_closure, closure_kind, closure_flags;
    std::vector<float> closure_params;
    struct LightRows {  // core/tables/lights.py
        std::vector<float> params;
        std::vector<int32_t> kind, flags, visible_to, receivers, blockers, max_bounces;
    } lights;
    std::vector<float> media;  // by material (MediumFloat)
    float world_medium[kMediumFloats] = {};
    float environment_rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    int32_t environment_mask = 0;
    int32_t filter_kind = 0;
    float filter_width = 1.0f;  // pixels
    std::vector<float> filter;  // film/pixel_filter.h
    std::vector<float> emission;
    std::vector<int32_t> emission_two_sided;
    float environment[3] = {0, 0, 0};
    CameraView camera{};
};

struct SceneTables : GeometryTables, ValueTables {
    TextureTables textures;
    std::vector<float> least_roughness;  // by closure, and of its coat (scene/textures/value_bounds.h)
    std::shared_ptr<const EnvironmentMap> environment_map;  // null: the environment is constant
};

// Whether `is` holds for a closure of a material of the tables or of their view.
template <typename Tables, typename Is>
bool any_closure(const Tables& tables, size_t material, const Is& is) {
    const auto last = static_cast<size_t>(tables.material_first_closure[material + 1]);
    for (auto k = static_cast<size_t>(tables.material_first_closure[material]); k < last; ++k)
        if (is(k)) return true;
    return false;
}

// Whether a closure of a material has one of these flags.
template <typename Tables>
bool has_flags(const Tables& tables, size_t material, int32_t flags) {
    return any_closure(tables, material, [&](size_t k) { return (tables.closure_flags[k] & flags) != 0; });
}

// Whether visible faces have the material, and it has a medium.
inline bool has_medium(const SceneTables& tables, size_t material) {
    return tables.material_used[material] && is_medium(tables.media.data() + kMediumFloats * material);
}

// Whether any visible mesh, or the world, has a medium.
inline bool any_medium(const SceneTables& tables) {
    bool any = is_medium(tables.world_medium);
    for (size_t m = 0; m < tables.material_used.size(); ++m) any |= has_medium(tables, m);
    return any;
}

// The motion that the requested derivatives need.
struct RequestedMotion {
    std::vector<uint8_t> moving;  // by mesh: its vertices move
    bool camera = false;          // any float of the camera
    bool instances = false;       // any instance's transform
    bool lights = false;          // any row of the light table
    bool rotation = false;        // of the environment
    bool environment = false;     // light of the environment, even if it is dark
    std::vector<uint8_t> fields;  // by distance field: its coefficients or its place
    // Camera rays move with outlines of fields (reparameterisation/picture_warp.h), so that `camera` holds.
    bool warped = false;
    bool own_camera = false;  // any float of the camera itself

    // Returns whether vertices or instances of any mesh are requested.
    bool any_mesh_moves() const {
        return instances || std::any_of(moving.begin(), moving.end(), [](uint8_t m) { return m != 0; });
    }
    bool any_field_moves() const {
        return std::any_of(fields.begin(), fields.end(), [](uint8_t m) { return m != 0; });
    }
    // Returns whether anything moves.
    bool any() const { return any_mesh_moves() || any_field_moves() || camera || lights || rotation; }
    bool operator==(const RequestedMotion&) const = default;
};

}  // namespace edgegrad
