// The kernels on numbers that record derivatives (adjoint/number.h), of one instruction set.
#pragma once

#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ADJOINT_ISA {

void add_adjoint_path_kernels(KernelTable& table);
void add_adjoint_probe_kernels(KernelTable& table);

}  // namespace edgegrad::EDGEGRAD_ADJOINT_ISA
