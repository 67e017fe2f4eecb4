#include "emitter_bindings.h"

#include <nanobind/ndarray.h>

#include <stdexcept>
#include <vector>

namespace nb = nanobind;

namespace edgegrad {
namespace {

template <typename T>
using Array = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;

template <typename T>
Array<T> take(nb::handle value, size_t size) {
    Array<T> array = nb::cast<Array<T>>(value);
    if (array.size() != size) throw std::invalid_argument("the probes' arrays have different lengths");
    return array;
}

nb::ndarray<nb::numpy, float> give(std::vector<float>&& values, size_t columns) {
    auto* held = new std::vector<float>(std::move(values));
    nb::capsule owner(held, [](void* p) noexcept { delete static_cast<std::vector<float>*>(p); });
    const size_t shape[2] = {held->size() / columns, columns};
    return nb::ndarray<nb::numpy, float>(held->data(), columns == 1 ? 1 : 2, shape, owner);
}

}  // namespace

nb::dict sample_lights(const Engine& engine, nb::handle position, nb::handle normal, nb::handle u,
                       nb::handle v, bool both_sides) {
    const auto us = nb::cast<Array<float>>(u);
    const size_t n = us.size();
    const auto p = take<float>(position, 3 * n), m = take<float>(normal, 3 * n), vs = take<float>(v, n);
    std::vector<float> w(3 * n), radiance(3 * n), r(n), pdf(n), geometry(n);
    engine.probe_lights({static_cast<int64_t>(n), p.data(), m.data(), us.data(), vs.data(), both_sides,
                         w.data(), radiance.data(), r.data(), pdf.data(), geometry.data()});
    nb::dict out;
    out["w"] = give(std::move(w), 3);
    out["radiance"] = give(std::move(radiance), 3);
    out["r"] = give(std::move(r), 1);
    out["pdf"] = give(std::move(pdf), 1);
    out["geometry"] = give(std::move(geometry), 1);
    return out;
}

nb::dict meet_lights(const Engine& engine, nb::handle position, nb::handle normal, nb::handle w,
                     nb::handle face, nb::handle r, nb::handle bsdf_pdf, int kind, bool both_sides) {
    const auto rs = nb::cast<Array<float>>(r);
    const size_t n = rs.size();
    const auto p = take<float>(position, 3 * n), m = take<float>(normal, 3 * n), d = take<float>(w, 3 * n);
    const auto f = take<int32_t>(face, n);
    const auto b = take<float>(bsdf_pdf, n);
    const auto faces = static_cast<int64_t>(engine.tables().face_material.size());
    for (size_t k = 0; k < n; ++k)
        if (f.data()[k] < -1 || f.data()[k] >= faces)
            throw std::invalid_argument("the probes' faces are out of range");
    std::vector<float> pdf(n), radiance(3 * n);
    engine.probe_directions({static_cast<int64_t>(n), p.data(), m.data(), d.data(), f.data(), rs.data(),
                             b.data(), kind, both_sides, pdf.data(), radiance.data()});
    nb::dict out;
    out["pdf"] = give(std::move(pdf), 1);
    out["radiance"] = give(std::move(radiance), 3);
    return out;
}

nb::dict sample_sky(const Engine& engine, nb::handle u, nb::handle v) {
    const auto us = nb::cast<Array<float>>(u);
    const size_t n = us.size();
    const auto vs = take<float>(v, n);
    std::vector<float> w(3 * n), radiance(3 * n), pdf(n);
    engine.probe_sky({static_cast<int64_t>(n), us.data(), vs.data(), w.data(), radiance.data(), pdf.data()});
    nb::dict out;
    out["w"] = give(std::move(w), 3);
    out["radiance"] = give(std::move(radiance), 3);
    out["pdf"] = give(std::move(pdf), 1);
    return out;
}

nb::dict look_at_sky(const Engine& engine, nb::handle w) {
    const auto ws = nb::cast<Array<float>>(w);
    const size_t n = ws.size() / 3;
    std::vector<float> directions(ws.data(), ws.data() + 3 * n), radiance(3 * n), pdf(n);
    engine.probe_sky(
        {static_cast<int64_t>(n), nullptr, nullptr, directions.data(), radiance.data(), pdf.data()});
    nb::dict out;
    out["radiance"] = give(std::move(radiance), 3);
    out["pdf"] = give(std::move(pdf), 1);
    return out;
}

}  // namespace edgegrad
