#include "scene/contact_meshes.h"

#include <algorithm>
#include <limits>

#include "scene/face_vectors.h"
#include "scene/mesh_edges.h"
#include "scene/mesh_instances.h"
#include "scene/sharp_lobes.h"
#include "scene/textures/jumps.h"

namespace edgegrad {
namespace {

// Transparent faces of all instances of a mesh that have a box each.
constexpr size_t kMostTransparent = size_t{1} << 20;

// Samples along edges find lobes of x up to this alpha so rarely that the noise of their borders would be
// larger than what is gained.
constexpr float kWide = 0.2f;

// Whether a texture may make a closure's lobes narrow.
bool may_be_sharp(const SceneTables& tables, size_t closure) {
    return (tables.closure_flags[closure] & (kHasGlossy | kHasRefraction)) &&
           (is_textured(tables, closure, kRoughness) || is_textured(tables, closure, kCoatWeight) ||
            is_textured(tables, closure, kCoatRoughness));
}

// Grids of one material beyond this number do not count.
constexpr size_t kMostGrids = 4;

int32_t flags_of(const SceneTables& tables, size_t material, const TextureJumps& jumps) {
    int32_t flags = kContactFrom | kContactTo | kContactWide;
    if (jumps.elsewhere || jumps.grids.size() > kMostGrids) flags &= ~kContactTo;
    if (!jumps.grids.empty()) flags |= kContactCells;
    const auto first = static_cast<size_t>(tables.material_first_closure[material]),
               last = static_cast<size_t>(tables.material_first_closure[material + 1]);
    for (size_t closure = first; closure < last; ++closure) {
        if (tables.closure_flags[closure] & kHasNormalMap) flags |= kContactBent | kContactMapped;
        if (tables.closure_flags[closure] & kHasEmission) flags |= kContactEmits;
        if (scatters_through(tables, closure)) flags |= kContactThrough;
        if (has_sharp_lobe(tables, closure, kWide) || may_be_sharp(tables, closure)) flags &= ~kContactWide;
        if (may_be_specular(tables, closure) || (tables.closure_flags[closure] & kHasTransparency)) return 0;
    }
    return flags;
}

// Returns whether the normals of a face's corners equal its own.
bool is_flat(const SceneTables& tables, size_t face) {
    if (!is_smooth(tables, face)) return true;
    const int32_t* corners = &tables.corner_normal[3 * face];
    const Vector m = area_normal(tables, face);
    return std::all_of(corners, corners + 3, [&](int32_t c) {
        const float* p = &tables.normals[3 * static_cast<size_t>(c)];
        const Vector n{p[0], p[1], p[2]}, lean = cross(n, m);
        return dot(lean, lean) <= 1e-12 * dot(n, n) * dot(m, m);
    });
}

struct Box {
    float low[3], high[3];

    int longest_axis() const {
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
        return axis;
    }
    float size() const { return high[longest_axis()] - low[longest_axis()]; }
};

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr Box kEmptyBox{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};

Box joined(Box a, const Box& b) {
    for (int k = 0; k < 3; ++k)
        a.low[k] = std::min(a.low[k], b.low[k]), a.high[k] = std::max(a.high[k], b.high[k]);
    return a;
}

void add(Box& box, const float (&at)[3]) {
    for (int k = 0; k < 3; ++k)
        box.low[k] = std::min(box.low[k], at[k]), box.high[k] = std::max(box.high[k], at[k]);
}

// A point of a mesh in the world, as placed by an instance (-1: none).
void place(const SceneTables& tables, int32_t instance, Vector p, float (&at)[3]) {
    const double own[3] = {p.x, p.y, p.z};
    const float* m = instance < 0 ? nullptr : &tables.instance_to_world[12 * static_cast<size_t>(instance)];
    for (int k = 0; k < 3; ++k)
        at[k] = static_cast<float>(m ? m[4 * k] * p.x + m[4 * k + 1] * p.y + m[4 * k + 2] * p.z + m[4 * k + 3]
                                     : own[k]);
}

// The box of a face, as placed by an instance.
Box box_of(const SceneTables& tables, size_t face, int32_t instance) {
    Box box = kEmptyBox;
    for (size_t corner = 0; corner < 3; ++corner) {
        float at[3];
        place(tables, instance, face_corner(tables, face, corner), at);
        add(box, at);
    }
    return box;
}

// The box of a box's corners, as placed by an instance.
Box placed(const SceneTables& tables, const Box& box, int32_t instance) {
    if (instance < 0) return box;
    Box out = kEmptyBox;
    for (int k = 0; k < 8; ++k) {
        float at[3];
        place(tables, instance,
              {(k & 1 ? box.high : box.low)[0], (k & 2 ? box.high : box.low)[1],
               (k & 4 ? box.high : box.low)[2]},
              at);
        add(out, at);
    }
    return out;
}

// The box of each visible mesh with all its copies; of copies, that of their corners' box.
std::vector<Box> mesh_boxes(const SceneTables& tables) {
    const auto instances = mesh_instances(tables);
    std::vector<Box> out(instances.size(), kEmptyBox);
    for (size_t mesh = 0; mesh < out.size(); ++mesh) {
        Box own = kEmptyBox;
        for (auto face = static_cast<size_t>(tables.mesh_first_face[mesh]);
             face < static_cast<size_t>(tables.mesh_first_face[mesh + 1]); ++face)
            own = joined(own, box_of(tables, face, -1));
        for (int32_t instance : instances[mesh]) out[mesh] = joined(out[mesh], placed(tables, own, instance));
    }
    return out;
}

// Whether two boxes overlap or nearly touch.
bool overlap(const Box& a, const Box& b) {
    constexpr float kNear = 1e-3f;
    const float slack = kNear * std::min(a.size(), b.size());
    for (int k = 0; k < 3; ++k)
        if (!(a.low[k] <= b.high[k] + slack && b.low[k] <= a.high[k] + slack)) return false;
    return true;
}

}  // namespace

std::vector<float> mesh_sizes(const SceneTables& tables) {
    std::vector<float> out;
    for (const Box& box : mesh_boxes(tables)) out.push_back(box.size());
    return out;
}

ContactMaterials contact_materials(const SceneTables& tables, const MaterialJumps& jumps) {
    ContactMaterials out;
    out.first_grid.push_back(0);
    for (size_t m = 0; m + 1 < tables.material_first_closure.size(); ++m) {
        out.bits.push_back(flags_of(tables, m, jumps.of[m]));
        if (out.bits.back() & kContactTo)
            for (const CellGrid& grid : jumps.of[m].grids) {
                out.grid_attributes.push_back(grid.attribute);
                for (const auto& row : grid.row) out.grid_rows.insert(out.grid_rows.end(), row, row + 4);
            }
        out.first_grid.push_back(static_cast<int32_t>(out.grid_attributes.size()));
    }
    return out;
}

std::vector<int32_t> contact_meshes(const SceneTables& tables, const std::vector<int32_t>& materials) {
    std::vector<int32_t> meshes(static_cast<size_t>(tables.visible_meshes), 0);
    int32_t any = 0;
    for (size_t mesh = 0; mesh < meshes.size(); ++mesh) {
        const auto first = static_cast<size_t>(tables.mesh_first_face[mesh]),
                   last = static_cast<size_t>(tables.mesh_first_face[mesh + 1]);
        int32_t flags = first < last ? kContactFrom | kContactTo | kContactWide : 0;
        int32_t others = 0;  // bits that one face sets for its mesh
        for (size_t face = first; face < last && flags; ++face) {
            const int32_t material = materials[static_cast<size_t>(tables.face_material[face])];
            others |=
                material & (kContactBent | kContactEmits | kContactThrough | kContactMapped | kContactCells);
            if (!(others & kContactBent) && !is_flat(tables, face)) others |= kContactBent;
            flags &= material;
        }
        if (flags & (kContactFrom | kContactTo))
            flags |= others;
        else
            flags = 0;
        if ((flags & (kContactTo | kContactEmits)) == kContactTo &&
            static_cast<int32_t>(mesh) < tables.first_field())
            flags |= kContactOpen;
        meshes[mesh] = flags;
        any |= flags;
    }
    return (any & kContactFrom) && (any & kContactTo) ? meshes : std::vector<int32_t>{};
}

std::vector<int32_t> noisy_contact_materials(const SceneTables& tables, const RequestedMotion& motion,
                                             const std::vector<int32_t>& materials) {
    constexpr int32_t both = kContactFrom | kContactTo;
    std::vector<uint8_t> excluded(materials.size());
    for (size_t m = 0; m < excluded.size(); ++m) excluded[m] = (materials[m] & both) != both;
    if (std::find(excluded.begin(), excluded.end(), 1) == excluded.end()) return {};
    // Find the meshes with concave edges
    const auto meshes = static_cast<size_t>(tables.visible_meshes);
    const std::vector<uint8_t> moves = moving_meshes(tables, motion);
    std::vector<uint8_t> concave(meshes, 0);
    for (size_t e = 0; 2 * e < tables.edge_vertices.size(); ++e) {
        const uint32_t first = tables.edge_face_first[e];
        if (count_own_faces(tables, e) != 2) continue;
        const auto mesh =
            static_cast<size_t>(mesh_of(tables, static_cast<int32_t>(tables.edge_faces[first])));
        if (mesh >= meshes || concave[mesh] || !(motion.camera || moves[mesh])) continue;
        const float* a = &tables.vertices[3 * static_cast<size_t>(tables.edge_vertices[2 * e])];
        const float* p = &tables.vertices[3 * static_cast<size_t>(tables.edge_opposite[first + 1])];
        const Vector n = area_normal(tables, tables.edge_faces[first]);
        const Vector way = Vector{p[0], p[1], p[2]} - Vector{a[0], a[1], a[2]};
        constexpr double kSlope = 1e-3;
        concave[mesh] = dot(n, way) > kSlope * length(n) * length(way);
    }
    // Collect their materials, and those of meshes that may touch others which move relative to them
    const std::vector<Box> boxes = mesh_boxes(tables);
    const auto touches = [&](size_t mesh) {
        for (size_t k = 0; k < meshes; ++k)
            if (k != mesh && (motion.camera || moves[mesh] || moves[k]) && overlap(boxes[mesh], boxes[k]))
                return true;
        return false;
    };
    std::vector<uint8_t> named(excluded.size(), 0);
    for (size_t mesh = 0; mesh < meshes; ++mesh) {
        const auto first = tables.face_material.begin() + tables.mesh_first_face[mesh],
                   last = tables.face_material.begin() + tables.mesh_first_face[mesh + 1];
        const auto is_excluded = [&](int32_t m) { return excluded[static_cast<size_t>(m)] != 0; };
        if (std::none_of(first, last, is_excluded) || !(concave[mesh] || touches(mesh))) continue;
        for (auto m = first; m != last; ++m)
            if (is_excluded(*m)) named[static_cast<size_t>(*m)] = 1;
    }
    std::vector<int32_t> out;
    for (size_t m = 0; m < named.size(); ++m)
        if (named[m]) out.push_back(static_cast<int32_t>(m));
    return out;
}

std::vector<float> transparent_boxes(const SceneTables& tables) {
    const auto transparent = [&tables](size_t face) {
        return has_flags(tables, static_cast<size_t>(tables.face_material[face]), kHasTransparency);
    };
    // The boxes of all transparent faces in the world
    std::vector<Box> faces;
    const auto instances = mesh_instances(tables);
    for (size_t mesh = 0; mesh < instances.size(); ++mesh) {
        std::vector<size_t> seen_through;
        for (auto face = static_cast<size_t>(tables.mesh_first_face[mesh]);
             face < static_cast<size_t>(tables.mesh_first_face[mesh + 1]); ++face)
            if (transparent(face)) seen_through.push_back(face);
        if (seen_through.size() * instances[mesh].size() <= kMostTransparent) {
            for (const size_t face : seen_through)
                for (int32_t instance : instances[mesh]) faces.push_back(box_of(tables, face, instance));
            continue;
        }
        // Of very many instances, each has one box for all its faces
        Box own = kEmptyBox;
        for (const size_t face : seen_through) own = joined(own, box_of(tables, face, -1));
        for (int32_t instance : instances[mesh]) faces.push_back(placed(tables, own, instance));
    }
    if (faces.empty()) return {};
    // Halve the group with the largest box until there are enough groups
    struct Group {
        size_t first, last;
        Box box;
    };
    const auto group = [&](size_t first, size_t last) {
        Group g{first, last, faces[first]};
        for (size_t k = first; k < last; ++k) g.box = joined(g.box, faces[k]);
        return g;
    };
    std::vector<Group> groups{group(0, faces.size())};
    while (groups.size() < kTransparentBoxes) {
        const auto largest =
            std::max_element(groups.begin(), groups.end(), [](const Group& a, const Group& b) {
                return (a.last - a.first > 1 ? a.box.size() : 0.0f) <
                       (b.last - b.first > 1 ? b.box.size() : 0.0f);
            });
        const Group whole = *largest;
        if (whole.last - whole.first < 2) break;
        const int axis = whole.box.longest_axis();
        const float middle = 0.5f * (whole.box.low[axis] + whole.box.high[axis]);
        const auto begin = faces.begin() + static_cast<std::ptrdiff_t>(whole.first),
                   end = faces.begin() + static_cast<std::ptrdiff_t>(whole.last);
        const auto split = std::partition(
            begin, end, [&](const Box& b) { return b.low[axis] + b.high[axis] < 2.0f * middle; });
        const auto at = static_cast<size_t>(split - faces.begin());
        if (at == whole.first || at == whole.last) break;
        *largest = group(whole.first, at);
        groups.push_back(group(at, whole.last));
    }
    std::vector<float> out;
    for (const Group& g : groups) {
        out.insert(out.end(), g.box.low, g.box.low + 3);
        out.insert(out.end(), g.box.high, g.box.high + 3);
    }
    return out;
}

}  // namespace edgegrad
