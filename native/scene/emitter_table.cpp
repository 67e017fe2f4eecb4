#include "scene/emitter_table.h"

#include <algorithm>
#include <cmath>

namespace edgegrad {
namespace {

// Least probability of an emitter whose own strength is a parameter, as a share of the mean: one
// that is dark now still has a derivative.
constexpr double kLeastEmitterShare = 0.05;

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

EmitterTable::EmitterTable(const SceneTables& t, const Asked& asked) {
    std::vector<double> power;
    std::vector<bool> parameter;
    const auto add = [&](int32_t k, int32_t i, double p, bool is_parameter) {
        if (!(p > 0.0) && !is_parameter) return;
        kind.push_back(k);
        index.push_back(i);
        power.push_back(p);
        parameter.push_back(is_parameter);
    };
    const size_t materials = t.emission.size() / 3;
    std::vector<uint8_t> emits(materials), asked_for(materials);
    for (size_t m = 0; m < materials; ++m) {
        asked_for[m] = m < asked.emitting.size() && asked.emitting[m];
        emits[m] = asked_for[m] || mean(&t.emission[3 * m]) > 0.0;
    }
    if (std::any_of(emits.begin(), emits.end(), [](uint8_t e) { return e != 0; })) {
        for (size_t f = 0; f < t.face_material.size(); ++f) {
            const size_t m = static_cast<size_t>(t.face_material[f]);
            if (!emits[m]) continue;
            const double area = triangle_area(t, f);
            if (!(area > 0.0)) continue;
            const double sides = t.emission_two_sided[m] ? 2.0 : 1.0;
            add(kEmissiveTriangle, static_cast<int32_t>(f), area * sides * M_PI * mean(&t.emission[3 * m]),
                asked_for[m]);
        }
    }
    const bool lights = asked.lights;
    for (size_t k = 0; k < t.point_intensity.size() / 3; ++k)
        add(kPointLight, static_cast<int32_t>(k), 4.0 * M_PI * mean(&t.point_intensity[3 * k]), lights);
    const double radius = scene_radius(t);
    for (size_t k = 0; k < t.sun_irradiance.size() / 3; ++k)
        add(kSunLight, static_cast<int32_t>(k), M_PI * radius * radius * mean(&t.sun_irradiance[3 * k]),
            lights);

    double total = 0.0;
    for (double p : power) total += p;
    const double least =
        kind.empty() ? 0.0
                     : kLeastEmitterShare * (total > 0.0 ? total : 1.0) / static_cast<double>(kind.size());
    for (size_t k = 0; k < power.size(); ++k)
        if (parameter[k]) power[k] = std::max(power[k], least);
    std::vector<double> sum{0.0};
    for (double p : power) sum.push_back(sum.back() + p);
    for (double s : sum) cdf.push_back(static_cast<float>(s / sum.back()));
    if (!cdf.empty()) cdf.back() = 1.0f;
}

}  // namespace edgegrad
