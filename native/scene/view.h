// The scene as kernels read it: plain pointers into the engine's tables (same names as in
// core/tables/tables.py).
#pragma once

#include <cstddef>
#include <cstdint>

#include "embree/api.h"
#include "scene/camera_row.h"
#include "scene/lights/environment_view.h"
#include "scene/lights/light_view.h"
#include "scene/material_params.h"
#include "scene/rays/brute_triangle.h"
#include "scene/textures/texture_view.h"
#include "sdf/field_band.h"
#include "sdf/field_derivatives.h"
#include "sdf/field_view.h"
#include "sdf/surface_patch.h"

namespace edgegrad {

// Kinds of rays, as bits 1 << kind of the meshes that they can hit (core/_check.py, RAYS). Higher bits of a
// mesh's mask are the sets of blockers that lights may name.
enum RayKind : int32_t { kCameraRay, kDiffuseRay, kGlossyRay, kTransmissionRay, kShadowRay, kFirstBlockers };

// Rays that a medium has scattered. They meet what diffuse rays meet.
constexpr int32_t kMediumRay = 6;
constexpr int32_t meets_as(int32_t kind) { return kind == kMediumRay ? kDiffuseRay : kind; }

// What textures get for the kind of an emitter sample. Emission that light sampling finds is that which a ray
// of no kind sees, as in Cycles. Only rays that meet an emissive surface see it by their kind.
constexpr int32_t kNoRay = -1;

// Camera rays outside of what a fisheye sees: they meet nothing, since their mask is 0 (scene/rays/rays.h).
constexpr int32_t kUnseenRay = 7;

// Kinds of scattered rays.
constexpr int32_t kScatteredRays = 1 << kDiffuseRay | 1 << kGlossyRay | 1 << kTransmissionRay;
// Those that mirrors and glass scatter.
constexpr int32_t kBentRays = 1 << kGlossyRay | 1 << kTransmissionRay;
// A bit beside those of the kinds of rays that see a light: it is one of the light table.
constexpr int32_t kOfTable = 1 << 30;

// In the order of core/scene/camera.py.
enum CameraKind : int32_t {
    kPerspective,
    kOrthographic,
    kEquirectangular,
    kEquisolidFisheye,
    kEquidistantFisheye,
    kPolynomialFisheye
};
// Rays of panoramas leave one point in directions that bend lines. Depths are distances along rays.
constexpr bool is_panorama(CameraKind kind) { return kind >= kEquirectangular; }
constexpr bool is_fisheye(CameraKind kind) { return kind >= kEquisolidFisheye; }

constexpr int kFilterSize = 1024;

// One medium's values as a row of floats (core/tables/media.py).
enum MediumFloat : int32_t {
    kMediumExtinction = 0,  // 1/m
    kMediumScattering = 3,  // 1/m
    kMediumForward = 6,     // mean scattering times the mean cosine of the phase function, 1/m
    kMediumFloats = 8
};
// Whether a row is a medium.
inline bool is_medium(const float* row) { return row[0] > 0.0f || row[1] > 0.0f || row[2] > 0.0f; }

struct CameraView {
    // Floats with derivatives, consecutive (kCameraFloats).
    float position[3];
    float right[3], up[3], back[3];  // axes X, Y, Z; it looks along -Z
    float focal;                     // pixels; orthographic: pixels per metre
    float pixel_aspect;              // height of a pixel divided by its width
    float principal[2];              // pixels of the rendered window
    float panorama[4];  // longitude and latitude of the full picture's left, right, lower and upper edge
    float fisheye[5];   // angle from the viewing direction by powers of the radius (path/fisheye.h)
    float disc;         // radius of the disc that a fisheye sees, in units of pixels along x
    float aperture_radius, focus_distance, aperture_rotation, aperture_ratio;

    CameraKind kind;
    int32_t aperture_blades;
    int32_t full_width, full_height;
    int32_t window_x, window_y;  // first pixel of the window in the full picture
    int32_t width, height;       // of the window
    float clip_start, clip_end;
    // The pixel filter's inverse distribution at kFilterSize + 1 points; null: box of one pixel.
    const float* filter;
};
constexpr int kCameraFloats = 30;
static_assert(offsetof(CameraView, kind) == kCameraFloats * sizeof(float));

// One of the two surfaces of an intersection curve (boundary/curves/intersections.h): a face, or a light of
// the table, marked by the highest bit. Edges have faces only.
class LineSurface {
 public:
    explicit constexpr LineSurface(uint32_t bits) : bits_(bits) {}
    static constexpr LineSurface light(int32_t row) {
        return LineSurface(kLight | static_cast<uint32_t>(row));
    }
    constexpr bool is_light() const { return bits_ & kLight; }
    constexpr int32_t face() const { return static_cast<int32_t>(bits_); }
    constexpr int32_t light_row() const { return static_cast<int32_t>(bits_ & ~kLight); }
    constexpr uint32_t bits() const { return bits_; }

 private:
    static constexpr uint32_t kLight = 1u << 31;
    uint32_t bits_;
};

// Bits by mesh (scene/contact.h): light that the mesh receives may have a fixed direction near contact; light
// that it sends may; some of its shading normals differ from those of its faces; it emits light; it scatters
// light from behind; normal maps bend its normals; textures jump at borders of cells; all of its lobes are
// wide; samples along its edges have what moves over its borders.
constexpr int32_t kContactFrom = 1, kContactTo = 2, kContactBent = 4, kContactEmits = 8, kContactThrough = 16,
                  kContactMapped = 32, kContactCells = 64, kContactWide = 128, kContactOpen = 256;
// What moves a face (SceneView::face_moving).
constexpr int32_t kVerticesMove = 1, kFieldMoves = 2;
// Coordinates of the cells at whose borders a texture jumps (scene/textures/jumps.h).
constexpr int32_t kCellCoordinates = 3;
// The largest number of sides of a polygon that coplanar faces form (boundary/meshes/coplanar_polygons.h),
// and of boxes around the scene's transparent faces (scene/contact_meshes.h).
constexpr int32_t kPolygonSides = 8, kTransparentBoxes = 16;
// Number of surfaces along a path, from the camera, to which this applies.
constexpr int32_t kFixedDirectionSurfaces = 4;

struct SceneView {
    const embree::Api* api;
    embree::SceneHandle bvh;
    const BruteTriangle* brute_triangles;  // all triangles, if testing all is faster than the BVH
    int32_t brute_count;                   // 0: the BVH is used

    // Distance fields. A hit of field k has the face first_field_face + k, and a place in the field in the
    // bits of its barycentrics (sdf/trace.h).
    const FieldView* fields;
    const FieldBand* field_bands;  // null: no estimator needs them
    int32_t field_count, first_field_face;

    const float* vertices;         // (V, 3)
    const int32_t* faces;          // (F, 3)
    const int32_t* face_material;  // (F)
    const int32_t* face_moving;    // (F) kVerticesMove, kFieldMoves, or 0
    // (F) 1: its light has a fixed direction (shading/lights/fixed_direction_light.h), or null.
    const int32_t* face_fixed_direction;
    const int32_t* material_fixed_direction;  // (M) 1: receives such light
    // (M) 1: its textures may jump within faces (scene/textures/jumps.h), or null: nothing moves, or none do.
    const int32_t* material_jumps;
    const int32_t* mesh_first_face;  // by Embree's geomID
    const int32_t* mesh_contact;     // (S) contact bits, or null: no surface moves, or no light qualifies
    // Grids of cells by material (M + 1), and by grid the attribute and (kCellCoordinates, 4) rows
    // (scene/contact_meshes.h), if mesh_contact is not null.
    const int32_t *material_first_grid, *cell_attributes;
    const float* cell_rows;
    const float* mesh_size;  // (S) the longest side of a mesh's box, if mesh_contact is not null
    // Number of surfaces, from the camera, that receive light of a fixed direction near contact.
    int32_t fixed_direction_surfaces;
    bool sampled_borders;  // samples along edges have what moves over the borders of faces near contact
    // (F) the polygon that a face and its coplanar neighbours form, or -1; null: no such polygons. And by
    // polygon (kPolygonSides, 2) the ends of its sides, counter-clockwise, with -1 after the last one.
    const int32_t *face_polygon, *polygon_sides;
    const float* transparent_boxes;  // (B, 2, 3) lower and upper corners in the world
    int32_t transparent_box_count;
    // Lobes up to this alpha are followed, if the camera sees them by such lobes alone
    // (shading/bsdf/followed_lobes.h); 0: none.
    float followed_alpha;
    // (L) Their widest (by alpha) for light of each row of the light table, 0 for lights without size: rays
    // of wider ones do not meet it. Null: none is followed. And the least of them of lights with a size.
    const float* light_followed;
    float least_followed;
    // (L) 1/m^2 of the slopes m from which on emitter samples find a light in followed lobes
    // (shading/bsdf/distributions/tail.h); 0: such lobes have no tail. And whether any is above 0.
    const float* light_tail;
    bool any_tail;
    // Mirrors and coats up to this alpha throw light of the table and of the environment on other surfaces at
    // a fixed microfacet normal (path/lights/thrown_light.h); 0: none.
    float thrown_alpha;
    // Least alpha of mirrors, coats and interfaces behind diffuse bounces (shading/bsdf/filter_glossy.h); 0:
    // none.
    float least_alpha;
    // Up to this width, emitter samples of recorded paths sample lobes (path/lights/lobe_light.h).
    float lobe_samples;
    int32_t mesh_count;        // number of meshes that rays can hit; instances have the geomIDs after them
    const int32_t* mesh_mask;  // (S) bits of the ray kinds that can hit a mesh
    bool rays_differ;          // some mesh cannot be hit by all kinds of rays
    const int32_t* mesh_receivers;  // (S) bits of the receiver sets of a mesh
    const float* mesh_terminator;   // (S) terminator offset of the mesh
    bool any_terminator;
    const float* mesh_dimming;     // (S) factor on the angle of arriving light (terminator_dimming), 1: none
    bool any_dimming;              // then no closure is shaded as Lambertian
    const int32_t* corner_normal;  // (F, 3) shading normal of each corner, -1: flat; null: all is flat
    const float* normals;          // (N, 3) unit
    const int32_t* instance_mesh;  // (I)
    const float* instance_to_world;  // (I, 3, 4) rows

    const int32_t* material_first_closure;  // (M + 1) its closures
    const int32_t* closure_kind;            // (L) ShaderKind
    const int32_t* closure_flags;           // (L) ClosureFlag bits
    const float* closure_params;            // (L, kMaterialParams)
    int32_t all_flags, common_flags;        // bits of any closure, and of every closure
    bool any_mixture;
    bool any_perfect;      // some material may be a perfect mirror or smooth glass; set for derivatives
    bool emission_varies;  // some emission is not one constant

    TextureView textures;

    EnvironmentView environment_image;
    float environment_rotation[9];
    int32_t environment_mask;

    LightView lights;

    const float* emission;              // (M, 3)
    const int32_t* emission_two_sided;  // (M)

    // (M, kMediumFloats) the medium in closed meshes by material, that of the space around them, and whether
    // there is one at all (shading/media.h).
    const float* media;
    const float* world_medium;
    bool any_medium;

    bool convex;  // a flat sheet, or one convex body seen from outside, has no shadows on itself

    float environment[3];
    bool has_environment;

    // Edges with their faces (core/geometry/topology.py), for boundary terms and for rays that start at
    // edges.
    const uint32_t* edge_vertices;    // (E, 2)
    const uint32_t* edge_face_first;  // (E + 1)
    const uint32_t* edge_faces;
    const uint32_t* edge_opposite;
    const uint8_t* edge_sharing;    // number of edges in the same place, which share a sample; null: one each
    const uint8_t* face_collinear;  // faces on lines, which rays through edges pass; null: there are none
    int32_t edge_count;
    // (N, 2, 3) ends of the intersection curves of two faces (boundary/curves/intersections.h). Their edge
    // numbers follow edge_count.
    const float* intersection_ends;
    // (N, 2) instances of those faces, -1: none; null: no face is instanced.
    const int32_t* intersection_instances;
    // (N, 2) the points of the lens from which lines are seen, and how many such points there are; null:
    // lines are seen from all points.
    const float* line_lens;
    int32_t lens_points;
    // (N) patches of fields' surfaces, by line; null: the lines are no patches.
    const FieldPatch* field_patches;

    CameraView camera;

    // Lines by number: the edges, and behind them the intersection curves.
    bool is_intersection(int32_t line) const { return line >= edge_count; }
    int64_t intersection(int32_t line) const { return static_cast<int64_t>(line) - edge_count; }
    LineSurface surface_of_line(int32_t line, uint32_t k) const {
        return LineSurface(edge_faces[edge_face_first[line] + k]);
    }
};

// Motion in boundary terms: tangents (read) or gradients (written). `vertices` starts at `first_vertex` and
// holds only the span of meshes that move.
struct DerivativeView {
    double* vertices;
    int32_t first_vertex;
    double* camera;                // (kCameraFloats)
    double* instance_to_world;     // (I, 12)
    double* light_params;          // (L, kLightParams)
    double* environment_rotation;  // (9)
    FieldDerivatives fields;
    // Whether these derivatives are requested.
    bool camera_requested;
    bool instances_requested;
    bool lights_requested;
    bool rotation_requested;
    // Whether camera rays move with the outlines of fields (reparameterisation/picture_warp.h).
    bool warped;
};

}  // namespace edgegrad
