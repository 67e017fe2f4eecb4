#include "boundary/fields/field_insides.h"

#include "scene/sharp_lobes.h"
#include "sdf/carrier/carrier.h"

namespace edgegrad {
namespace {

bool passes_light(const SceneTables& t, size_t closure) {
    return (t.closure_flags[closure] & kHasTransparency) || scatters_through(t, closure);
}

bool is_open(const SceneTables& t, size_t field) {
    const auto face = static_cast<size_t>(t.first_field_face()) + field;
    const auto material = static_cast<size_t>(t.face_material[face]);
    if (any_closure(t, material, [&](size_t closure) { return passes_light(t, closure); })) return true;
    const FieldView f = t.fields[field].view();
    return f.values[0] < 0.0f || may_end_at_its_box(f);
}

bool holds_camera(const SceneTables& t, size_t field) {
    const FieldView f = t.fields[field].view();
    double grid[3];
    f.place_in_grid(t.camera.position, grid);
    for (int a = 0; a < 3; ++a)
        if (!(grid[a] >= 0.0 && grid[a] <= f.cells(a))) return false;
    return spline_value(f, grid) < 0.0;
}

}  // namespace

bool light_may_be_inside(const SceneTables& tables, size_t field) {
    return is_open(tables, field) || holds_camera(tables, field);
}

std::vector<uint8_t> lit_insides(const SceneTables& tables, EdgeCache& kept) {
    const auto open = kept.open_fields.get(true, [&] {
        std::vector<uint8_t> all;
        for (size_t k = 0; k < tables.fields.size(); ++k) all.push_back(is_open(tables, k));
        return all;
    });
    std::vector<uint8_t> out = *open;
    for (size_t k = 0; k < out.size(); ++k) out[k] |= holds_camera(tables, k) ? 1 : 0;
    return out;
}

}  // namespace edgegrad
