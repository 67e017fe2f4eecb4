#include "scene/emitter_table.h"

#include <algorithm>
#include <cmath>

namespace edgegrad {
namespace {

double mean(const float* c) { return (static_cast<double>(c[0]) + c[1] + c[2]) / 3.0; }

double triangle_area(const SceneTables& t, size_t face) {
    double p[3][3];
    for (int k = 0; k < 3; ++k)
        for (int c = 0; c < 3; ++c) p[k][c] = t.vertices[3 * static_cast<size_t>(t.faces[3 * face + k]) + c];
    double a[3], b[3];
    for (int c = 0; c < 3; ++c) a[c] = p[1][c] - p[0][c], b[c] = p[2][c] - p[0][c];
    return 0.5 * std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
}

double scene_radius(const SceneTables& t) {
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    for (size_t k = 0; k < t.vertices.size(); ++k) {
        const double x = t.vertices[k];
        low[k % 3] = k < 3 ? x : std::min(low[k % 3], x);
        high[k % 3] = k < 3 ? x : std::max(high[k % 3], x);
    }
    return 0.5 * std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
}

}  // namespace

EmitterTable::EmitterTable(const SceneTables& t) {
    std::vector<double> power;
    const auto add = [&](int32_t k, int32_t i, double p) {
        if (!(p > 0.0)) return;
        kind.push_back(k);
        index.push_back(i);
        power.push_back(p);
    };
    const bool any = std::any_of(t.emission.begin(), t.emission.end(), [](float e) { return e > 0.0f; });
    for (size_t f = 0; any && f < t.face_material.size(); ++f) {
        const size_t m = static_cast<size_t>(t.face_material[f]);
        const double radiance = mean(&t.emission[3 * m]);
        if (!(radiance > 0.0)) continue;
        const double sides = t.emission_two_sided[m] ? 2.0 : 1.0;
        add(kEmissiveTriangle, static_cast<int32_t>(f), triangle_area(t, f) * sides * M_PI * radiance);
    }
    for (size_t k = 0; k < t.point_intensity.size() / 3; ++k)
        add(kPointLight, static_cast<int32_t>(k), 4.0 * M_PI * mean(&t.point_intensity[3 * k]));
    const double radius = scene_radius(t);
    for (size_t k = 0; k < t.sun_irradiance.size() / 3; ++k)
        add(kSunLight, static_cast<int32_t>(k), M_PI * radius * radius * mean(&t.sun_irradiance[3 * k]));

    std::vector<double> sum{0.0};
    for (double p : power) sum.push_back(sum.back() + p);
    for (double s : sum) cdf.push_back(static_cast<float>(s / sum.back()));
    if (!cdf.empty()) cdf.back() = 1.0f;
}

}  // namespace edgegrad
