// The kernels of boundaries whose samples start at the camera, of one instruction set. They use only parts of
// other kernels' headers.
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include "boundary/samples/direct_samples.h"
#include "boundary/terms/camera_sampled_shadow.h"
#include "boundary/terms/seen_places.h"
#include "kernels/parts.h"
#include "tasks/boundary_kind.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_camera_sampled_kernels(KernelTable& table) {
    table.boundary[kCameraSampledIndirect] = {lit_segments_forward<sample_from_camera>,
                                              lit_segments_backward<sample_from_camera>};
    table.boundary[kCameraSampledShadow] = {direct_forward<sample_shadow_from_camera>,
                                            direct_backward<sample_shadow_from_camera>};
    table.seen_places = find_seen_places;
    table.edge_reach = find_edge_reach;
}

}  // namespace edgegrad::EDGEGRAD_ISA
