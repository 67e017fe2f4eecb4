// Kernels that run parts of the path tracer by themselves, for tests.
#include "kernels/parts.h"
#include "kernels/ray_batch.h"
#include "shading/bsdf/bsdf_kernel.h"
#include "shading/lights/light_probe_kernels.h"
#include "tasks/kernel_table.h"
#include "texture/texture_kernel.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_probe_kernels(KernelTable& table) {
    table.textures = texture_kernel;
    table.bsdfs = bsdf_kernel;
    table.light_samples = light_samples_kernel;
    table.light_directions = light_directions_kernel;
    table.environment = environment_kernel;
    table.ray_batch = ray_batch_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
