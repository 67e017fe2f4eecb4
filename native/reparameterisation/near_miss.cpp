#include "reparameterisation/near_miss.h"

#include <cmath>

#include "sdf/triple.h"

namespace edgegrad {
namespace {

// The basis functions of a cell and their derivatives up to the third, by order and tap.
void cubic_weights(double u, double (&w)[4][4]) {
    const double v = 1.0 - u;
    const double rows[4][4] = {
        {v * v * v / 6.0, (4.0 - 3.0 * u * u * (1.0 + v)) / 6.0, (4.0 - 3.0 * v * v * (1.0 + u)) / 6.0,
         u * u * u / 6.0},
        {-0.5 * v * v, 0.5 * u * (3.0 * u - 4.0), 0.5 * v * (4.0 - 3.0 * v), 0.5 * u * u},
        {v, 3.0 * u - 2.0, 1.0 - 3.0 * u, u},
        {-1.0, 3.0, -3.0, 1.0}};
    for (int order = 0; order < 4; ++order)
        for (int tap = 0; tap < 4; ++tap) w[order][tap] = rows[order][tap];
}

// The gradient of d . H d at a fixed d: third derivatives, which jump between cells.
void curvature_slope(const FieldView& f, const Triple& grid, const Triple& d, Triple& out) {
    double w[3][4][4];
    int64_t cell[3];
    for (int a = 0; a < 3; ++a) cubic_weights(f.place_in_cell(grid, a, cell[a]), w[a]);
    out[0] = out[1] = out[2] = 0.0;
    const int64_t step = f.size[2], slab = step * f.size[1];
    const float* first = f.values + cell[0] * slab + cell[1] * step + cell[2];
    // Sums over the taps for each combination of orders (i, j, k) with i + j + k = 3
    for (int i = 0; i < 4; ++i)
        for (int j = 0; i + j < 4; ++j) {
            const int k = 3 - i - j;
            double sum = 0.0;
            for (int x = 0; x < 4; ++x)
                for (int y = 0; y < 4; ++y) {
                    const float* row = first + x * slab + y * step;
                    double along = 0.0;
                    for (int z = 0; z < 4; ++z) along += static_cast<double>(row[z]) * w[2][k][z];
                    sum += w[0][i][x] * w[1][j][y] * along;
                }
            // Of the 3!/(i! j! k!) orders of the axes, those that end with axis c have the other two first
            const int of[3] = {i, j, k};
            for (int c = 0; c < 3; ++c) {
                if (of[c] == 0) continue;
                int rest[3] = {i, j, k};
                --rest[c];
                double factor = 1.0;
                bool mixed = true;
                for (int a = 0; a < 3; ++a)
                    for (int n = 0; n < rest[a]; ++n) {
                        factor *= d[a];
                        if (rest[a] == 2) mixed = false;
                    }
                out[c] += (mixed ? 2.0 : 1.0) * factor * sum;
            }
        }
}

}  // namespace

bool see_near_miss(const PictureRay& ray, const FieldBand& band, NearMiss& m) {
    const FieldView& f = *m.field;
    const SplineJet& jet = m.jet;
    const Triple& g = jet.gradient;
    Triple d, e[2], bent;
    f.vector_in_grid(ray.direction, d);
    for (int i = 0; i < 2; ++i) f.vector_in_grid(ray.across[i], e[i]);
    times(jet.hessian, d, bent);
    const double scale = ray.parallel ? 1.0 : m.depth;
    m.curvature = dot(d, bent);
    const double curvature = m.curvature, length = std::sqrt(dot(g, g));
    const double across[2] = {dot(g, e[0]), dot(g, e[1])};
    for (int i = 0; i < 2; ++i) m.slope[i] = scale * across[i];
    const double square = m.square();
    if (!(curvature > 0.0) || !(square > 0.0) || !(length > 0.0)) return false;
    // How the point moves: g . D = 0 stays
    double deeper[2];
    for (int j = 0; j < 2; ++j) {
        deeper[j] = -(scale * dot(e[j], bent) + (ray.parallel ? 0.0 : across[j])) / curvature;
        for (int a = 0; a < 3; ++a) m.moves[j][a] = scale * e[j][a] + deeper[j] * d[a];
    }
    Triple turned[2];
    for (int j = 0; j < 2; ++j) times(jet.hessian, m.moves[j], turned[j]);
    const auto second = [&](int i, int j) {
        return (ray.parallel ? 0.0 : deeper[j] * across[i]) + scale * dot(e[i], turned[j]);
    };
    m.bend[0] = second(0, 0), m.bend[1] = second(0, 1), m.bend[2] = second(1, 1);
    // Where the minimum meets a maximum, the curvature vanishes and the band closes with it
    const double stretch = dot(d, d), relative = curvature / (stretch * length);
    double close = 1.0, close_slope[2] = {0.0, 0.0};
    if (relative < static_cast<double>(band.least_curvature)) {
        close = relative / static_cast<double>(band.least_curvature);
        Triple third;
        curvature_slope(f, m.grid, d, third);
        for (int j = 0; j < 2; ++j) {
            const double change = (ray.parallel ? 0.0 : 2.0 * dot(e[j], bent)) + dot(third, m.moves[j]);
            const double stretched = ray.parallel ? 0.0 : 2.0 * dot(d, e[j]);
            close_slope[j] = change / curvature - stretched / stretch - dot(g, turned[j]) / (length * length);
        }
    }
    m.width = static_cast<double>(band.pixels) * close * std::sqrt(square);
    const double width = m.width;
    m.apart = jet.value / width;
    const double turn[2] = {m.bend[0] * m.slope[0] + m.bend[1] * m.slope[1],
                            m.bend[1] * m.slope[0] + m.bend[2] * m.slope[1]};
    for (int j = 0; j < 2; ++j)
        m.apart_slope[j] = m.slope[j] / width - m.apart * (turn[j] / square + close_slope[j]);
    return m.apart > -1.0 && m.apart < 1.0;
}

}  // namespace edgegrad
