#include "shading/bsdf/tables/albedo_tables.h"

namespace edgegrad {

// clang-format off
#include "shading/bsdf/tables/albedo_tables.inc"
#include "shading/bsdf/tables/sheen_tables.inc"

}  // namespace edgegrad
