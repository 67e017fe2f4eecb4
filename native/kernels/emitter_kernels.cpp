// The kernels of boundaries of what gives light, as surfaces see them, of one instruction set.
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include "boundary/terms/disk_intersection.h"
#include "boundary/terms/emitter_outline.h"
#include "kernels/parts.h"
#include "tasks/boundary_kind.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_emitter_kernels(KernelTable& table) {
    table.boundary[kEmitterOutline] = {direct_forward<sample_emitter_outline>,
                                       direct_backward<sample_emitter_outline>};
    table.boundary[kDiskIntersection] = {direct_forward<sample_disk_intersection>,
                                         direct_backward<sample_disk_intersection>};
}

}  // namespace edgegrad::EDGEGRAD_ISA
