// The kernels of boundaries between surfaces that start at the camera, of one instruction set. They share
// parts of other kernels' headers only.
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include "boundary/terms/camera_sampled.h"
#include "boundary/terms/disk_intersection.h"
#include "boundary/terms/emitter_outline.h"
#include "kernels/parts.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_aimed_kernels(KernelTable& table) {
    table.boundary[kAimedBoundary] = {lit_segments_forward<sample_aimed>,
                                      lit_segments_backward<sample_aimed>};
    table.boundary[kEmitterOutline] = {direct_forward<sample_emitter_outline>,
                                       direct_backward<sample_emitter_outline>};
    table.boundary[kPiercedDisk] = {direct_forward<sample_pierced_disk>,
                                    direct_backward<sample_pierced_disk>};
}

}  // namespace edgegrad::EDGEGRAD_ISA
