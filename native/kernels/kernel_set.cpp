// The table of one instruction set's kernels.
#include "adjoint/adjoint_kernels.h"
#include "kernels/parts.h"
#include "simd/packet.h"
#include "tasks/kernel_table.h"

#define EG_STRING2(x) #x
#define EG_STRING(x) EG_STRING2(x)

namespace edgegrad::EDGEGRAD_ISA {

// Made at the first call: this file has instructions of its set, which a processor without them must not run,
// not even while the module is loaded.
const KernelTable& kernel_table() {
    static const KernelTable made = [] {
        KernelTable table{};
        table.name = EG_STRING(EDGEGRAD_ISA);
        table.width = W;
#define EDGEGRAD_ADD_PART(name) add_##name##_kernels(table);
        EDGEGRAD_KERNEL_PARTS(EDGEGRAD_ADD_PART)
#undef EDGEGRAD_ADD_PART
        EDGEGRAD_ADJOINT_ISA::add_adjoint_path_kernels(table);
#ifdef EDGEGRAD_PROBES
        add_probe_kernels(table);
        EDGEGRAD_ADJOINT_ISA::add_adjoint_probe_kernels(table);
#endif
        for (const BoundaryKindRow& row : kBoundaryTable)
            table.boundary[row.kind] = table.boundary[row.kernels];
        return table;
    }();
    return made;
}

}  // namespace edgegrad::EDGEGRAD_ISA
