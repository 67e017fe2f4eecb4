// Tangents of a mesh's corners for normal maps.
#pragma once

#include <cstddef>
#include <cstdint>

namespace edgegrad {

// Triangles of one mesh.
struct MappedFaces {
    const float* vertices;     // (vertex_count, 3)
    const int32_t* faces;      // (face_count, 3)
    const float* uv;           // (face_count, 3, 2)
    const int32_t* smoothing;  // (face_count, 3) normal of each corner, -1: that of its triangle
    const float* normals;      // unit
    size_t vertex_count, face_count;
    bool around;  // u = 0 is where u = 1 is
};

// Writes the unit tangents along u, and signs of the bitangents, (face_count, 3, 4), as MikkTSpace computes
// them for triangles. Corners with equal vertex, normal, UV coordinate and sign share one tangent: the sum of
// the tangents of their triangles, each projected perpendicular to the normal and weighted by the angle at
// the corner. Triangles whose UV coordinates have no area add nothing; they take the sign of a neighbour and
// share its tangents where the UV coordinates are the same. Elsewhere their tangent is the X axis and their
// sign is negative.
void corner_tangents(const MappedFaces& mesh, int threads, float* tangents);

}  // namespace edgegrad
