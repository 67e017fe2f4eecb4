// The adjoint block F of distance fields: the scalar
//
//   alpha * dphi + beta . grad dphi
//
// at a fixed point of the world, where dphi is the change of the field's value there. All derivatives by
// fields are sums of such blocks. The field changes with its coefficients c and with its map x = A u + t from
// grid coordinates:
//   dphi = sum of dc B(u) - g . m,    m = dA u + dt,    g = grad phi,    H = grad g.
#pragma once

#include "sdf/field_derivatives.h"

namespace edgegrad::EDGEGRAD_ISA {

// A point of a field, with the field's derivatives in the world.
struct FieldJet {
    int32_t cell[3];
    float at[3];  // within the cell
    float gradient[3];
    float hessian[6];  // xx, yy, zz, yz, xz, xy
};

FieldJet field_jet(const FieldView& field, const float (&position)[3]);

// Adds the block's gradient.
void field_backward(const FieldView& field, const FieldDerivatives& to, const FieldJet& x, float alpha,
                    const float (&beta)[3]);
// Computes dphi and grad dphi.
void field_forward(const FieldView& field, const FieldDerivatives& from, const FieldJet& x, float& change,
                   float (&slope)[3]);

}  // namespace edgegrad::EDGEGRAD_ISA
