// The kernels of one instruction set come from several files, each compiled once for each instruction set
// with its own EDGEGRAD_ISA and EDGEGRAD_WIDTH (CMakeLists.txt).
#pragma once

#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

const KernelTable& kernel_table();

// Of each file kernels/NAME_kernels.cpp; of boundary kinds those of kBoundaryTable[...].kernels.
#define EDGEGRAD_KERNEL_PARTS(X) \
    X(boundary)                  \
    X(camera_sampled)            \
    X(caustic)                   \
    X(edge_on)                   \
    X(emitter)                   \
    X(field) X(field_band) X(horizon) X(indirect) X(outline) X(path) X(primary) X(query) X(specular)
#define EDGEGRAD_DECLARE_PART(name) void add_##name##_kernels(KernelTable& table);
EDGEGRAD_KERNEL_PARTS(EDGEGRAD_DECLARE_PART)
#undef EDGEGRAD_DECLARE_PART
void add_probe_kernels(KernelTable& table);  // builds with EDGEGRAD_PROBES alone

}  // namespace edgegrad::EDGEGRAD_ISA
