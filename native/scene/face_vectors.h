// Corners and normals of faces in double precision, for quantities that are computed once per call.
#pragma once

#include "scene/tables.h"
#include "util/double_vector.h"

namespace edgegrad {

inline Vector face_corner(const SceneTables& t, size_t face, size_t corner) {
    return vector_at(&t.vertices[3 * static_cast<size_t>(t.faces[3 * face + corner])]);
}

inline Vector area_normal(const SceneTables& t, size_t face) {
    const Vector a = face_corner(t, face, 0);
    return cross(face_corner(t, face, 1) - a, face_corner(t, face, 2) - a);
}

// Returns whether all corners of a face have shading normals.
inline bool is_smooth(const SceneTables& t, size_t face) {
    if (t.corner_normal.empty()) return false;
    const int32_t* n = &t.corner_normal[3 * face];
    return n[0] >= 0 && n[1] >= 0 && n[2] >= 0;
}

}  // namespace edgegrad
