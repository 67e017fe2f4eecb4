#include "sdf/field_block.h"

#include "sdf/spline.h"

namespace edgegrad::EDGEGRAD_ISA {
namespace {

typedef double Sums __attribute__((vector_size(32)));

EG_INLINE Sums load_sums(const double* p) {
    Sums r;
    __builtin_memcpy(&r, p, sizeof r);
    return r;
}

// The basis functions along the axes.
struct Basis {
    Taps value[3], slope[3];

    explicit Basis(const float (&at)[3]) {
        for (int a = 0; a < 3; ++a) value[a] = spline_weights(at[a]), slope[a] = spline_slopes(at[a]);
    }
};

int64_t first_tap(const FieldView& f, const int32_t (&cell)[3]) {
    return (cell[0] * static_cast<int64_t>(f.size[1]) + cell[1]) * f.size[2] + cell[2];
}

void add_to_values(const FieldView& f, const FieldDerivatives::Span& to, const FieldJet& x, float alpha,
                   const double (&beta)[3]) {
    const Basis basis(x.at);
    const auto along_x = static_cast<float>(beta[0]), along_y = static_cast<float>(beta[1]),
               along_z = static_cast<float>(beta[2]);
    const Taps wz = basis.value[2], dz = basis.slope[2] * along_z;
    int64_t slab = f.first_value - to.first + first_tap(f, x.cell);
    for (int i = 0; i < 4; ++i, slab += static_cast<int64_t>(f.size[1]) * f.size[2]) {
        const float wx = basis.value[0][i], by_x = alpha * wx + along_x * basis.slope[0][i];
        int64_t at = slab;
        for (int j = 0; j < 4; ++j, at += f.size[2]) {
            to.met[at >> to.kPage] = to.met[(at + 3) >> to.kPage] = 1;
            double* row = to.gradient + at;
            const float wy = basis.value[1][j];
            const Taps taps = wz * (by_x * wy + wx * along_y * basis.slope[1][j]) + dz * (wx * wy);
            const Sums sums = load_sums(row) + __builtin_convertvector(taps, Sums);
            __builtin_memcpy(row, &sums, sizeof sums);
        }
    }
}

// The change of the field by a tangent of its coefficients: its value, and its gradient in grid coordinates.
void change_of_values(const FieldView& f, const double* tangent, const FieldJet& x, double& value,
                      double (&slope)[3]) {
    const Basis basis(x.at);
    const Sums wz = __builtin_convertvector(basis.value[2], Sums),
               dz = __builtin_convertvector(basis.slope[2], Sums);
    Sums sum{}, along_x{}, along_y{};
    const double* slab = tangent + first_tap(f, x.cell);
    for (int i = 0; i < 4; ++i, slab += static_cast<int64_t>(f.size[1]) * f.size[2]) {
        Sums row{}, turned{};
        for (int j = 0; j < 4; ++j) {
            const Sums taps = load_sums(slab + static_cast<int64_t>(j) * f.size[2]);
            row += taps * static_cast<double>(basis.value[1][j]);
            turned += taps * static_cast<double>(basis.slope[1][j]);
        }
        sum += row * static_cast<double>(basis.value[0][i]);
        along_x += row * static_cast<double>(basis.slope[0][i]);
        along_y += turned * static_cast<double>(basis.value[0][i]);
    }
    const auto total = [](const Sums& a) { return (a[0] + a[2]) + (a[1] + a[3]); };
    value = total(sum * wz);
    slope[0] = total(along_x * wz), slope[1] = total(along_y * wz), slope[2] = total(sum * dz);
}

void grid_place(const FieldJet& x, double (&u)[4]) {
    for (int a = 0; a < 3; ++a) u[a] = x.cell[a] + static_cast<double>(x.at[a]);
    u[3] = 1.0;
}

void by_hessian(const FieldJet& x, const double (&v)[3], double (&out)[3]) {
    const auto& h = x.hessian;
    const double rows[3][3] = {{h[0], h[5], h[4]}, {h[5], h[1], h[3]}, {h[4], h[3], h[2]}};
    for (int c = 0; c < 3; ++c) out[c] = rows[c][0] * v[0] + rows[c][1] * v[1] + rows[c][2] * v[2];
}

}  // namespace

FieldJet field_jet(const FieldView& field, const float (&position)[3]) {
    FieldJet x;
    double grid[3];
    field.place_in_grid(position, grid);
    find_cell(field, grid, x.cell, x.at);
    float g[3], h[6];
    spline_derivatives(field, x.cell, x.at, g, h);
    const double own[3][3] = {{h[0], h[5], h[4]}, {h[5], h[1], h[3]}, {h[4], h[3], h[2]}};
    // Gradients map by the transpose of the inverse
    double half[3][3];  // own * to_grid
    for (int a = 0; a < 3; ++a)
        for (int c = 0; c < 3; ++c)
            half[a][c] = own[a][0] * field.to_grid[0][c] + own[a][1] * field.to_grid[1][c] +
                         own[a][2] * field.to_grid[2][c];
    const auto in_world = [&](int c, double a, double b, double d) {
        return static_cast<float>(field.to_grid[0][c] * a + field.to_grid[1][c] * b +
                                  field.to_grid[2][c] * d);
    };
    for (int c = 0; c < 3; ++c) x.gradient[c] = in_world(c, g[0], g[1], g[2]);
    constexpr int place[6][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};
    for (int k = 0; k < 6; ++k) {
        const int c = place[k][0], d = place[k][1];
        x.hessian[k] = in_world(c, half[0][d], half[1][d], half[2][d]);
    }
    return x;
}

void field_backward(const FieldView& field, const FieldDerivatives& to, const FieldJet& x, float alpha,
                    const float (&beta)[3]) {
    double in_grid[3];  // beta, as a vector in grid coordinates
    field.vector_in_grid(beta, in_grid);
    if (to.values.has(field.first_value)) add_to_values(field, to.values, x, alpha, in_grid);
    if (!to.places.has(field.first_place())) return;
    double* rows = to.places.gradient + (field.first_place() - to.places.first);
    const double b[3] = {beta[0], beta[1], beta[2]};
    double u[4], w[3];
    grid_place(x, u);
    by_hessian(x, b, w);
    for (int c = 0; c < 3; ++c) {
        w[c] += static_cast<double>(alpha) * x.gradient[c];
        for (int a = 0; a < 4; ++a)
            rows[4 * c + a] -= w[c] * u[a] + (a < 3 ? x.gradient[c] * in_grid[a] : 0.0);
    }
}

void field_forward(const FieldView& field, const FieldDerivatives& from, const FieldJet& x, float& change,
                   float (&slope)[3]) {
    double value = 0.0, in_grid[3] = {0.0, 0.0, 0.0}, moved[3] = {0.0, 0.0, 0.0};
    if (from.values.has(field.first_value))
        change_of_values(field, from.values.tangent + (field.first_value - from.values.first), x, value,
                         in_grid);
    if (from.places.has(field.first_place())) {
        const double* rows = from.places.tangent + (field.first_place() - from.places.first);
        double u[4], m[3];
        grid_place(x, u);
        for (int c = 0; c < 3; ++c) {
            m[c] = rows[4 * c] * u[0] + rows[4 * c + 1] * u[1] + rows[4 * c + 2] * u[2] + rows[4 * c + 3];
            value -= x.gradient[c] * m[c];
            for (int a = 0; a < 3; ++a) in_grid[a] -= rows[4 * c + a] * x.gradient[c];
        }
        by_hessian(x, m, moved);
    }
    change = static_cast<float>(value);
    double turned[3];
    field.gradient_in_world(in_grid, turned);
    for (int c = 0; c < 3; ++c) slope[c] = static_cast<float>(turned[c] - moved[c]);
}

}  // namespace edgegrad::EDGEGRAD_ISA
