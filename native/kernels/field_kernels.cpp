// The kernels of distance fields between surfaces and light, of one instruction set.
#include "boundary/terms/field_indirect.h"
#include "boundary/terms/field_shadow.h"
#include "kernels/parts.h"
#include "tasks/boundary_kind.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_field_kernels(KernelTable& table) {
    table.boundary[kFieldLights] = {direct_forward<sample_field_outline_shadow>,
                                    direct_backward<sample_field_outline_shadow>};
    table.boundary[kFieldSizedLights] = {direct_forward<sample_field_tangent_shadow>,
                                         direct_backward<sample_field_tangent_shadow>};
    table.boundary[kFieldIndirect] = {lit_segments_forward<sample_field_indirect>,
                                      lit_segments_backward<sample_field_indirect>};
}

}  // namespace edgegrad::EDGEGRAD_ISA
