// Kernels that run single functions of the path tracer, for tests.
#include "kernels/parts.h"
#include "shading/bsdf/bsdf_kernel.h"
#include "shading/lights/light_probe_kernels.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_probe_kernels(KernelTable& table) {
    table.bsdfs = bsdf_kernel;
    table.light_samples = light_samples_kernel;
    table.light_directions = light_directions_kernel;
    table.environment = environment_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
