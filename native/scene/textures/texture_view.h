// Textures as the kernels read them: programs, images, lookup tables and attributes
// (core/tables/textures/program.py builds them).
#pragma once

#include <cstdint>

namespace edgegrad {

// One instruction of a program on scalar registers. A non-negative operand is a register, ~i is constant i.
struct TextureInstruction {
    int32_t op;      // TextureOp
    int32_t data;    // index of an image, table, attribute or column, or a parameter of the operation
    int32_t out[4];  // registers; kTextureScratch for unused results
    int32_t in[10];
};
constexpr int kTextureRegisters = 128;
constexpr int kTextureScratch = kTextureRegisters;
// Integers of a mesh in TextureView::mesh_extent.
constexpr int kMeshExtent = 8;

enum TextureInterpolation : int32_t { kImageLinear, kImageClosest, kImageCubic };
enum TextureExtension : int32_t { kImageRepeat, kImageExtend, kImageClip, kImageMirror };

// An image as one node reads it. Several images may share their pixels.
struct TextureImage {
    int64_t offset;  // of its first float in `pixels`, rows from the top
    int32_t width, height, channels;
    int32_t interpolation, extension;
    int32_t unassociate;  // 1: the pixels are premultiplied by alpha, the result must not be
};

struct TextureLookup {
    int32_t offset, rows, columns;  // in `lookups`
    int32_t interpolate, extrapolate;
};

// One attribute on one mesh: values at corners or, if `components` is negative, one value per instance.
struct TextureAttribute {
    int64_t offset;      // in `attributes`, of the corner data of face 0, or of the value of instance 0
    int32_t components;  // 0: the mesh does not have it
};

// One attribute on one distance field (texture/field_grid.h).
struct TextureGrid {
    int64_t offset;      // in `attributes`
    int32_t size[3];     // numbers of values along the field's axes
    int32_t components;  // 0: the field does not have it
};

struct TextureView {
    const TextureInstruction* code;
    const int32_t* program_first;  // (programs + 1)
    const float* constants;

    const TextureImage* images;
    const float* pixels;
    const TextureLookup* tables;
    const float* lookups;
    const TextureAttribute* mesh_attributes;  // (attributes, meshes)
    const TextureGrid* field_grids;           // (attributes, fields)
    const float* attributes;
    const int32_t* face_mesh;  // by face of the scene's meshes
    int32_t mesh_count;

    // By closure: its program, and the program of its weight; -1: none. Null if no closure has one.
    const int32_t* closure_program;
    const int32_t* closure_weight_program;
    // The program of a material's displaced normal, by its first closure; -1: none. Null if no material has
    // one.
    const int32_t* closure_normal_program;
    bool reads_history;  // some program reads bounces or lengths of rays
    // By closure: the attributes of its normal map and anisotropy; -1: none.
    const int32_t* closure_uv;
    const int32_t* closure_tangent;
    // (meshes, 2, 4) places in `vertices` of the least and the greatest coordinate along x and y, and of the
    // two whose difference is the size, for tangents of meshes without a UV map
    const int32_t* mesh_extent;
};

}  // namespace edgegrad
