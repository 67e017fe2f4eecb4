#include "python/probes/light_sampling.h"

#include <stdexcept>
#include <vector>

#include "python/numpy_arrays.h"

namespace nb = nanobind;

namespace edgegrad {
namespace {

template <typename T>
std::vector<T> take(nb::handle value, size_t size) {
    std::vector<T> values = InputArray<T>(value, "probe").copy();
    if (values.size() != size) throw std::invalid_argument("the probes' arrays have different lengths");
    return values;
}

std::vector<float> take(nb::handle value) { return InputArray<float>(value, "probe").copy(); }

}  // namespace

nb::dict sample_lights(const Engine& engine, nb::handle position, nb::handle normal, nb::handle u,
                       nb::handle v, bool both_sides) {
    const auto us = take(u);
    const size_t n = us.size();
    const auto p = take<float>(position, 3 * n), m = take<float>(normal, 3 * n), vs = take<float>(v, n);
    std::vector<float> w(3 * n), radiance(3 * n), r(n), pdf(n), geometry(n);
    engine.probe_lights({static_cast<int64_t>(n), p.data(), m.data(), us.data(), vs.data(), both_sides,
                         w.data(), radiance.data(), r.data(), pdf.data(), geometry.data()});
    nb::dict out;
    out["w"] = rows_to_numpy(w, 3);
    out["radiance"] = rows_to_numpy(radiance, 3);
    out["r"] = rows_to_numpy(r, 1);
    out["pdf"] = rows_to_numpy(pdf, 1);
    out["geometry"] = rows_to_numpy(geometry, 1);
    return out;
}

nb::dict meet_lights(const Engine& engine, nb::handle position, nb::handle normal, nb::handle w,
                     nb::handle face, nb::handle r, nb::handle bsdf_pdf, int kind, bool both_sides) {
    const auto rs = take(r);
    const size_t n = rs.size();
    const auto p = take<float>(position, 3 * n), m = take<float>(normal, 3 * n), d = take<float>(w, 3 * n);
    const auto f = take<int32_t>(face, n);
    const auto b = take<float>(bsdf_pdf, n);
    const auto faces = static_cast<int64_t>(engine.tables().face_material.size());
    for (size_t k = 0; k < n; ++k)
        if (f[k] < -1 || f[k] >= faces) throw std::invalid_argument("the probes' faces are out of range");
    std::vector<float> pdf(n), radiance(3 * n);
    engine.probe_directions({static_cast<int64_t>(n), p.data(), m.data(), d.data(), f.data(), rs.data(),
                             b.data(), kind, both_sides, pdf.data(), radiance.data()});
    nb::dict out;
    out["pdf"] = rows_to_numpy(pdf, 1);
    out["radiance"] = rows_to_numpy(radiance, 3);
    return out;
}

nb::dict sample_environment_light(const Engine& engine, nb::handle u, nb::handle v) {
    const auto us = take(u);
    const size_t n = us.size();
    const auto vs = take<float>(v, n);
    std::vector<float> w(3 * n), radiance(3 * n), pdf(n);
    engine.probe_environment(
        {static_cast<int64_t>(n), us.data(), vs.data(), w.data(), radiance.data(), pdf.data()});
    nb::dict out;
    out["w"] = rows_to_numpy(w, 3);
    out["radiance"] = rows_to_numpy(radiance, 3);
    out["pdf"] = rows_to_numpy(pdf, 1);
    return out;
}

nb::dict look_at_environment(const Engine& engine, nb::handle w) {
    std::vector<float> ws = take(w);
    const size_t n = ws.size() / 3;
    std::vector<float> radiance(3 * n), pdf(n);
    engine.probe_environment(
        {static_cast<int64_t>(n), nullptr, nullptr, ws.data(), radiance.data(), pdf.data()});
    nb::dict out;
    out["radiance"] = rows_to_numpy(radiance, 3);
    out["pdf"] = rows_to_numpy(pdf, 1);
    return out;
}

}  // namespace edgegrad
