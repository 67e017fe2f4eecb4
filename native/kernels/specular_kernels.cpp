// The specular boundary's kernels of one instruction set. It shares parts of other kernels' headers only.
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include "boundary/specular/chain_term.h"
#include "boundary/specular/scan_lines.h"
#include "kernels/parts.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_specular_kernels(KernelTable& table) {
    table.scan = scan_kernel;
    table.chain_sides = chain_sides_kernel;
    table.chain_sweeps = chain_sweeps_kernel;
    table.chain_forward = chain_forward_kernel;
    table.chain_backward = chain_backward_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
