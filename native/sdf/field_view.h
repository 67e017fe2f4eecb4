// A distance field as kernels read it: a grid of cubic B-spline coefficients.
//
// Grid coordinates count cells, from the lower corner of the field's box. The cell (i, j, k) reads the 4^3
// coefficients from (i, j, k) on, so that n coefficients make n - 3 cells. The surface is where the spline
// changes its sign; it is negative inside.
#pragma once

#include <cstdint>

namespace edgegrad {

struct FieldView {
    const float* values;    // (size[0], size[1], size[2])
    int32_t size[3];        // numbers of coefficients
    double to_world[3][4];  // rows, from grid coordinates
    double to_grid[3][4];
    double cell_size;    // largest coordinate of a cell's axes in the world
    double extent;       // and of the box's
    int32_t number = 0;  // among the fields of the scene
    // Light may travel inside (boundary/fields/field_insides.h): outlines also bound rays there.
    bool inside = false;
    const uint8_t* signs =
        nullptr;              // of blocks of coefficients (sdf/bricks/coefficient_blocks.h); null: not known
    int64_t first_value = 0;  // of all coefficients of the scene's fields, one field after the other

    int32_t cells(int axis) const { return size[axis] - 3; }
    // A point of the world in grid coordinates, and the way back.
    template <typename T>
    void place_in_grid(const T (&point)[3], double (&grid)[3]) const {
        vector_in_grid(point, grid);
        for (int a = 0; a < 3; ++a) grid[a] += to_grid[a][3];
    }
    void place_in_world(const double (&grid)[3], double (&point)[3]) const {
        vector_in_world(grid, point);
        for (int c = 0; c < 3; ++c) point[c] += to_world[c][3];
    }
    // A direction, or a motion.
    template <typename T>
    void vector_in_grid(const T (&vector)[3], double (&grid)[3]) const {
        for (int a = 0; a < 3; ++a) {
            const auto& m = to_grid[a];
            grid[a] = m[0] * static_cast<double>(vector[0]) + m[1] * static_cast<double>(vector[1]) +
                      m[2] * static_cast<double>(vector[2]);
        }
    }
    void vector_in_world(const double (&grid)[3], double (&vector)[3]) const {
        for (int c = 0; c < 3; ++c) {
            const auto& m = to_world[c];
            vector[c] = m[0] * grid[0] + m[1] * grid[1] + m[2] * grid[2];
        }
    }
    // A gradient of a function on the grid: gradients map by the transpose of the inverse.
    template <typename T>
    void gradient_in_world(const T (&grid)[3], double (&gradient)[3]) const {
        const auto& m = to_grid;
        for (int c = 0; c < 3; ++c)
            gradient[c] = m[0][c] * static_cast<double>(grid[0]) + m[1][c] * static_cast<double>(grid[1]) +
                          m[2][c] * static_cast<double>(grid[2]);
    }
    // The cell of a coordinate in the field's box; returns the place in it.
    double place_in_cell(const double (&grid)[3], int axis, int64_t& cell) const {
        const int32_t last = cells(axis) - 1;
        cell = grid[axis] > 0.0 ? static_cast<int64_t>(grid[axis] < last ? grid[axis] : last) : 0;
        return grid[axis] - static_cast<double>(cell);
    }
    int64_t value_count() const { return static_cast<int64_t>(size[0]) * size[1] * size[2]; }
    int64_t first_place() const { return 12 * static_cast<int64_t>(number); }
};

// Makes a view; `to_world` are the rows of a map that can be inverted.
inline FieldView field_view(const float* values, const int32_t (&size)[3], const double (&to_world)[12]) {
    FieldView f{};
    f.values = values;
    for (int a = 0; a < 3; ++a) {
        f.size[a] = size[a];
        for (int c = 0; c < 4; ++c) f.to_world[a][c] = to_world[4 * a + c];
    }
    const auto& m = f.to_world;
    for (int c = 0; c < 3; ++c)
        for (int a = 0; a < 3; ++a) {
            const double axis = m[c][a] < 0.0 ? -m[c][a] : m[c][a], side = axis * f.cells(a);
            if (axis > f.cell_size) f.cell_size = axis;
            if (side > f.extent) f.extent = side;
        }
    double cofactor[3][3];
    for (int a = 0; a < 3; ++a)
        for (int c = 0; c < 3; ++c)
            cofactor[a][c] = m[(a + 1) % 3][(c + 1) % 3] * m[(a + 2) % 3][(c + 2) % 3] -
                             m[(a + 1) % 3][(c + 2) % 3] * m[(a + 2) % 3][(c + 1) % 3];
    const double det = m[0][0] * cofactor[0][0] + m[0][1] * cofactor[0][1] + m[0][2] * cofactor[0][2];
    for (int a = 0; a < 3; ++a) {
        f.to_grid[a][3] = 0.0;
        for (int c = 0; c < 3; ++c) {
            f.to_grid[a][c] = cofactor[c][a] / det;
            f.to_grid[a][3] -= f.to_grid[a][c] * m[c][3];
        }
    }
    return f;
}

}  // namespace edgegrad
