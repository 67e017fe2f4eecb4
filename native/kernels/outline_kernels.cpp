// The kernels of lights' outlines, of one instruction set.
#include "boundary/terms/intersection_outline.h"
#include "kernels/parts.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_outline_kernels(KernelTable& table) {
    table.boundary[kLightOutline] = {direct_forward<sample_outline>, direct_backward<sample_outline>};
    table.boundary[kPiercedOutline] = {direct_forward<sample_pierced_outline>,
                                       direct_backward<sample_pierced_outline>};
}

}  // namespace edgegrad::EDGEGRAD_ISA
