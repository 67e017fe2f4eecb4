// The kernels of one instruction set; compiled once for each with its own EDGEGRAD_ISA and
// EDGEGRAD_WIDTH (CMakeLists.txt).
#include "kernels.h"

#include "boundary/primary.h"
#include "boundary/shadow.h"
#include "path/interior.h"
#include "path/radiance.h"
#include "shading/bsdf/kernel.h"
#include "shading/light_probes.h"
#include "texture/kernel.h"

#define EG_STRING2(x) #x
#define EG_STRING(x) EG_STRING2(x)

namespace edgegrad::EDGEGRAD_ISA {

extern const KernelTable kernel_table;
const KernelTable kernel_table = {
    EG_STRING(EDGEGRAD_ISA),  W,
    radiance_kernel,          interior_forward_kernel,
    interior_backward_kernel, primary_forward_kernel,
    primary_backward_kernel,  shadow_forward_kernel,
    shadow_backward_kernel,   texture_kernel,
    bsdf_kernel,              light_samples_kernel,
    light_directions_kernel,
};

}  // namespace edgegrad::EDGEGRAD_ISA
