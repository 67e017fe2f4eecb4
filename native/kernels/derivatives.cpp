// The kernels of the boundaries behind the camera's, of one instruction set.
#include "boundary/shadow.h"
#include "kernels/parts.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_derivative_kernels(KernelTable& table) {
    table.boundary[kShadowBoundary] = {shadow_forward_kernel, shadow_backward_kernel};
    table.boundary[kSkyBoundary] = table.boundary[kShadowBoundary];
}

}  // namespace edgegrad::EDGEGRAD_ISA
