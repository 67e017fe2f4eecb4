// The kernels of lights' outlines, of one instruction set.
#include "boundary/terms/intersection_outline.h"
#include "kernels/parts.h"
#include "tasks/boundary_kind.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_outline_kernels(KernelTable& table) {
    table.boundary[kLightOutline] = {direct_forward<sample_outline>, direct_backward<sample_outline>};
    table.boundary[kIntersectionOutline] = {direct_forward<sample_intersection_outline>,
                                            direct_backward<sample_intersection_outline>};
}

}  // namespace edgegrad::EDGEGRAD_ISA
