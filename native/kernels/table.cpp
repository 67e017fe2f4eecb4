// The table of one instruction set's kernels.
#include "kernels/parts.h"
#include "simd/packet.h"

#define EG_STRING2(x) #x
#define EG_STRING(x) EG_STRING2(x)

namespace edgegrad::EDGEGRAD_ISA {

extern const KernelTable kernel_table;
const KernelTable kernel_table = [] {
    KernelTable table{};
    table.name = EG_STRING(EDGEGRAD_ISA);
    table.width = W;
    add_path_kernels(table);
    add_derivative_kernels(table);
    add_probe_kernels(table);
    return table;
}();

}  // namespace edgegrad::EDGEGRAD_ISA
