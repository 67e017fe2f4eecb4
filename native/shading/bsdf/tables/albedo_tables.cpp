#include "shading/bsdf/tables/albedo_tables.h"

namespace edgegrad {

// clang-format off
#include "shading/bsdf/tables/albedo_tables.inc"
#include "shading/bsdf/tables/sheen_tables.inc"
#include "shading/bsdf/tables/film_table.inc"

}  // namespace edgegrad
