// The kernels for this processor.
#pragma once

#include <string>
#include <vector>

#include "tasks/kernel_table.h"

namespace edgegrad {

// Instruction sets that this build has and this processor can run, the fastest first.
std::vector<std::string> instruction_sets();

// Kernels by instruction set; "" is the fastest. Throws std::invalid_argument for one that is not
// among instruction_sets().
const KernelTable& kernels(const std::string& instruction_set);

// Returns the table. Throws std::invalid_argument in builds without probes (EDGEGRAD_KERNELS in
// CMakeLists.txt).
const KernelTable& with_probes(const KernelTable& table);

}  // namespace edgegrad
