#include "shading/bsdf/albedo_tables.h"

namespace edgegrad {

#include "shading/bsdf/albedo_tables.inc"

}  // namespace edgegrad
