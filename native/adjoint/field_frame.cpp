// Points of fields relative to the fields, for attributes on grids that move with them.
#include "adjoint/number.h"

#include "adjoint/blocks.h"
#include "texture/field_grid.h"

namespace edgegrad::EDGEGRAD_ISA {

namespace {

// A point x = A u + t at fixed grid coordinates u moves by dA u + dt with the field's map. The result is the
// point's own motion without that. Results: the position.
struct FieldFrame {
    static constexpr int kResults = 3;
    int32_t first;
    const FieldDerivatives* derivatives;
    Nodes3 position;
    const FieldView* field[W];  // null: not on a field whose map is requested
    double grid[W][4];          // u, and 1

    void backward(raw::Float* a) const {
        const RawVec3 g = read(a, first);
        const raw::Mask live = nonzero(g);
        if (!raw::any(live)) return;
        add(a, position, live, g);
        for (int i = 0; i < W; ++i) {
            if (!live[i] || !field[i]) continue;
            double* rows =
                derivatives->places.gradient + (field[i]->first_place() - derivatives->places.first);
            const double by[3] = {g.x[i], g.y[i], g.z[i]};
            for (int c = 0; c < 3; ++c)
                for (int k = 0; k < 4; ++k) rows[4 * c + k] -= by[c] * grid[i][k];
        }
    }
    void forward(raw::Float* a) const {
        RawVec3 t = read(a, position);
        for (int i = 0; i < W; ++i) {
            if (!field[i]) continue;
            const double* rows =
                derivatives->places.tangent + (field[i]->first_place() - derivatives->places.first);
            double m[3] = {};
            for (int c = 0; c < 3; ++c)
                for (int k = 0; k < 4; ++k) m[c] += rows[4 * c + k] * grid[i][k];
            t.x[i] -= static_cast<float>(m[0]);
            t.y[i] -= static_cast<float>(m[1]);
            t.z[i] -= static_cast<float>(m[2]);
        }
        write(a, first, nonzero(t), t);
    }
};

}  // namespace

Vec3 relative_to_fields(const SceneView& scene, Mask lanes, Int face, Vec3 position) {
    if (!current_tape) return position;
    const FieldDerivatives& derivatives = current_tape->fields();
    const auto requested = [&](int i) -> const FieldView* {
        if (!lanes[i]) return nullptr;
        const FieldView* field = &field_of_face(scene, face[i]);
        return derivatives.places.has(field->first_place()) ? field : nullptr;
    };
    bool moves = false;
    for (int i = 0; i < W; ++i) moves |= requested(i) != nullptr;
    if (!moves) return position;
    FieldFrame& block = current_tape->new_block<FieldFrame>();
    block.derivatives = &derivatives;
    block.position = nodes(position);
    for (int i = 0; i < W; ++i) {
        block.field[i] = requested(i);
        if (!block.field[i]) continue;
        const float point[3] = {position.x[i], position.y[i], position.z[i]};
        double grid[3];
        block.field[i]->place_in_grid(point, grid);
        for (int k = 0; k < 4; ++k) block.grid[i][k] = k < 3 ? grid[k] : 1.0;
    }
    return results(values(position), block.first);
}

}  // namespace edgegrad::EDGEGRAD_ISA
