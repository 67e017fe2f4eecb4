// The kernels of the boundaries behind the camera's, of one instruction set.
#include "boundary/terms/cone_border.h"
#include "boundary/terms/shadow.h"
#include "kernels/parts.h"
#include "tasks/boundary_kind.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_boundary_kernels(KernelTable& table) {
    table.boundary[kShadowBoundary] = {direct_forward<sample_shadow>, direct_backward<sample_shadow>};
    table.boundary[kConeBorder] = {direct_forward<sample_cone_border>, direct_backward<sample_cone_border>};
}

}  // namespace edgegrad::EDGEGRAD_ISA
