// Kernels of camera samples by area, of one instruction set.
#include "kernels/parts.h"
#include "path/edge_on.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_edge_on_kernels(KernelTable& table) {
    table.weigh_edge_on = weigh_edge_on_kernel;
    table.record_edge_on = record_edge_on_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
