#include "reparameterisation/picture_warp.h"

#include <cmath>

namespace edgegrad {
namespace {

// Squares of distances below this, in units of the band, do not decide between two outlines.
constexpr double kNearest = 1e-6;

// A number with its slope in the picture.
struct Sloped {
    double value, slope[2];
};

}  // namespace

PictureWarp warp_of(const NearMiss* misses, int count) {
    PictureWarp out;
    // b falls from 1 on the outline to 0 at the border of the band; nearer near misses count more
    Sloped inside[kMostNearMisses], share[kMostNearMisses], sum{};
    for (int k = 0; k < count; ++k) {
        const NearMiss& m = misses[k];
        const double q = m.apart, away = std::abs(q), square = q * q + kNearest;
        inside[k].value = 1.0 - away;
        share[k].value = inside[k].value / square;
        sum.value += share[k].value;
        for (int j = 0; j < 2; ++j) {
            inside[k].slope[j] = q < 0.0 ? m.apart_slope[j] : -m.apart_slope[j];
            share[k].slope[j] = inside[k].slope[j] / square -
                                2.0 * q * m.apart_slope[j] * inside[k].value / (square * square);
            sum.slope[j] += share[k].slope[j];
        }
    }
    for (int k = 0; k < count; ++k) {
        const NearMiss& m = misses[k];
        const FieldView& f = *m.field;
        const double r = share[k].value / sum.value, u = r * inside[k].value, square = m.square();
        double across = 0.0;  // p . grad u
        for (int j = 0; j < 2; ++j)
            across += m.slope[j] * (r * inside[k].slope[j] +
                                    inside[k].value * (share[k].slope[j] - r * sum.slope[j]) / sum.value);
        const double bent = m.bend[0] * m.slope[0] * m.slope[0] + 2.0 * m.bend[1] * m.slope[0] * m.slope[1] +
                            m.bend[2] * m.slope[1] * m.slope[1];
        const double spread = -across / square - u * (m.bend[0] + m.bend[2] - 2.0 * bent / square) / square;
        WarpPart& part = out.part[out.count++];
        part.field = m.field;
        part.spread = static_cast<float>(spread);
        double moved[3], steep = 0.0;  // sum p_j x_j, in grid coordinates
        for (int a = 0; a < 3; ++a) moved[a] = m.slope[0] * m.moves[0][a] + m.slope[1] * m.moves[1][a];
        double point[3], motion[3], gradient[3];
        f.place_in_world(m.grid, point);
        f.vector_in_world(moved, motion);
        f.gradient_in_world(m.jet.gradient, gradient);
        for (int c = 0; c < 3; ++c) {
            part.point[c] = static_cast<float>(point[c]);
            part.along[c] = static_cast<float>(-u / square * motion[c]);
            steep += gradient[c] * gradient[c];
        }
        for (int j = 0; j < 2; ++j) part.step[j] = static_cast<float>(-u * m.slope[j] / square);
        part.slope = static_cast<float>(std::sqrt(steep));
    }
    return out;
}

}  // namespace edgegrad
