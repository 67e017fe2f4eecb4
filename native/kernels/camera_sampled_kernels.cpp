// The kernels of boundaries between surfaces that start at the camera, of one instruction set. They share
// parts of other kernels' headers only.
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include "boundary/terms/camera_sampled.h"
#include "boundary/terms/disk_intersection.h"
#include "boundary/terms/emitter_outline.h"
#include "kernels/parts.h"
#include "tasks/boundary_kind.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_camera_sampled_kernels(KernelTable& table) {
    table.boundary[kCameraSampledIndirect] = {lit_segments_forward<sample_from_camera>,
                                              lit_segments_backward<sample_from_camera>};
    table.boundary[kEmitterOutline] = {direct_forward<sample_emitter_outline>,
                                       direct_backward<sample_emitter_outline>};
    table.boundary[kDiskIntersection] = {direct_forward<sample_disk_intersection>,
                                         direct_backward<sample_disk_intersection>};
}

}  // namespace edgegrad::EDGEGRAD_ISA
