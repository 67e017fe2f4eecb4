// The picture's kernel of one instruction set.
#include "kernels/parts.h"
#include "path/radiance.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_path_kernels(KernelTable& table) { table.radiance = radiance_kernel; }

}  // namespace edgegrad::EDGEGRAD_ISA
