// Kernels that evaluate texture programs and trace rays at points of the caller's choice.
#include "kernels/parts.h"
#include "kernels/ray_batch.h"
#include "tasks/kernel_table.h"
#include "texture/texture_kernel.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_query_kernels(KernelTable& table) {
    table.textures = texture_kernel;
    table.ray_batch = ray_batch_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
