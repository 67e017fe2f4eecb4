// The kernels of bands about the outlines of distance fields, of one instruction set.
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include "boundary/terms/relaxed_outline.h"
#include "boundary/terms/warped_picture.h"
#include "kernels/parts.h"
#include "tasks/boundary_kind.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_field_band_kernels(KernelTable& table) {
    table.boundary[kFieldBand] = {primary_forward_kernel<FieldBands>, primary_backward_kernel<FieldBands>};
    table.warp_record = warp_record_kernel;
    table.warp_borders = warp_borders_kernel;
    table.warp_forward = warp_forward_kernel;
    table.warp_backward = warp_backward_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
