#include "shading/bsdf/albedo_tables.h"

namespace edgegrad {

// clang-format off
#include "shading/bsdf/albedo_tables.inc"
#include "shading/bsdf/sheen_tables.inc"

}  // namespace edgegrad
