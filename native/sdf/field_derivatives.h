// The requested derivatives by distance fields: by their coefficients, and by their maps from grid
// coordinates to the world, 12 floats each.
#pragma once

#include "sdf/field_view.h"

namespace edgegrad {

// Spans of the coefficients of all fields one after the other (FieldView::first_value), and of their maps. A
// span consists of whole fields. Pointers are those of the spans' first numbers; backward sweeps add to
// gradients, forward sweeps start from tangents.
struct FieldDerivatives {
    struct Span {
        int64_t first = 0, last = 0;
        double* gradient = nullptr;
        const double* tangent = nullptr;
        // Backward sweeps meet coefficients near the surface alone, and mark those pages of a gradient.
        static constexpr int kPage = 9;  // 2^9 numbers
        uint8_t* met = nullptr;

        bool has(int64_t at) const { return first <= at && at < last; }
    };
    Span values, places;

    bool any() const { return values.first < values.last || places.first < places.last; }
    bool moves(const FieldView& f) const { return values.has(f.first_value) || places.has(f.first_place()); }
};

}  // namespace edgegrad
