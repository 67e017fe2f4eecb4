#include "boundary/fields/field_lights.h"

#include <optional>

#include "boundary/fields/field_crossings.h"
#include "boundary/fields/field_curves.h"

namespace edgegrad {
namespace {

Box box_of(const FieldView& field) {
    Box box;
    for (int corner = 0; corner < 8; ++corner) {
        double grid[3], p[3];
        for (int a = 0; a < 3; ++a) grid[a] = (corner >> a & 1) ? field.cells(a) : 0.0;
        field.place_in_world(grid, p);
        const float at[3] = {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
        box.add(at);
    }
    return box;
}

}  // namespace

std::vector<std::array<int32_t, 2>> fields_through_lights(const SceneTables& tables, EdgeCache& kept,
                                                          int threads, const RequestedPair& requested) {
    std::vector<std::array<int32_t, 2>> out;
    for (size_t k = 0; k < tables.fields.size(); ++k) {
        const FieldView field = tables.fields[k].view();
        const Box own = box_of(field);
        const auto mesh = static_cast<size_t>(tables.first_field()) + k;
        std::optional<std::vector<Triangle3>> surface;
        for (size_t row = 0; row < tables.lights.kind.size(); ++row) {
            const std::optional<Box> light = box_of_light(tables, row);
            if (!light || !light->meets(own) || !requested(row, mesh)) continue;
            if (!surface) surface = placed_triangles(field, (*field_carriers(tables, kept, threads))[k]);
            if (any_through_light(tables, row, *surface))
                out.push_back({static_cast<int32_t>(row), static_cast<int32_t>(mesh)});
        }
    }
    return out;
}

}  // namespace edgegrad
