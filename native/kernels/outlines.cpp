// The kernels of lights' outlines, of one instruction set.
#include "boundary/light_outline.h"
#include "kernels/parts.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_outline_kernels(KernelTable& table) {
    table.boundary[kLightOutline] = {direct_forward<sample_outline>, direct_backward<sample_outline>};
}

}  // namespace edgegrad::EDGEGRAD_ISA
