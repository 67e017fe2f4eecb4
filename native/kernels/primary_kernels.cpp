// The primary boundary's kernels of one instruction set.
#include "boundary/samples/edge_weights.h"
#include "boundary/terms/field_crossing.h"
#include "boundary/terms/field_outline.h"
#include "boundary/terms/primary.h"
#include "boundary/terms/texture_border.h"
#include "kernels/parts.h"
#include "tasks/boundary_kind.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_primary_kernels(KernelTable& table) {
    table.boundary[kPrimaryBoundary] = {primary_forward_kernel<MeshCurves>,
                                        primary_backward_kernel<MeshCurves>};
    table.boundary[kFieldOutline] = {primary_forward_kernel<FieldCurves>,
                                     primary_backward_kernel<FieldCurves>};
    table.boundary[kFieldCrossing] = {primary_forward_kernel<CrossingCurves>,
                                      primary_backward_kernel<CrossingCurves>};
    table.boundary[kTextureBorder] = {primary_forward_kernel<BorderCurves>,
                                      primary_backward_kernel<BorderCurves>};
    table.edge_weights = edge_weights_kernel;
    table.add_splats = add_splats_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
