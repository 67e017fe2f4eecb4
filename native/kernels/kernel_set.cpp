// The table of one instruction set's kernels.
#include "adjoint/adjoint_kernels.h"
#include "kernels/parts.h"
#include "simd/packet.h"
#include "tasks/kernel_table.h"

#define EG_STRING2(x) #x
#define EG_STRING(x) EG_STRING2(x)

namespace edgegrad::EDGEGRAD_ISA {

// Made when it is asked for, and not before: this file's instructions are those of its instruction set, which
// a processor that lacks it must never meet, not even while the module is loaded.
const KernelTable& kernel_table() {
    static const KernelTable made = [] {
        KernelTable table{};
        table.name = EG_STRING(EDGEGRAD_ISA);
        table.width = W;
        add_camera_sampled_kernels(table);
        add_path_kernels(table);
        add_derivative_kernels(table);
        add_edge_on_kernels(table);
        add_horizon_kernels(table);
        add_indirect_kernels(table);
        add_outline_kernels(table);
        add_primary_kernels(table);
        add_probe_kernels(table);
        add_specular_kernels(table);
        EDGEGRAD_ADJOINT_ISA::add_adjoint_path_kernels(table);
        EDGEGRAD_ADJOINT_ISA::add_adjoint_probe_kernels(table);
        return table;
    }();
    return made;
}

}  // namespace edgegrad::EDGEGRAD_ISA
