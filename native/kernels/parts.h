// The kernels of one instruction set come from several files, each compiled once for each instruction set
// with its own EDGEGRAD_ISA and EDGEGRAD_WIDTH (CMakeLists.txt).
#pragma once

#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

const KernelTable& kernel_table();

void add_camera_sampled_kernels(KernelTable& table);
void add_outline_kernels(KernelTable& table);
void add_path_kernels(KernelTable& table);
void add_derivative_kernels(KernelTable& table);
void add_edge_on_kernels(KernelTable& table);
void add_horizon_kernels(KernelTable& table);
void add_indirect_kernels(KernelTable& table);
void add_primary_kernels(KernelTable& table);
void add_probe_kernels(KernelTable& table);
void add_specular_kernels(KernelTable& table);

}  // namespace edgegrad::EDGEGRAD_ISA
