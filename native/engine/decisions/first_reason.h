// Reasons by which decisions on parts are made.
#pragma once

#include <initializer_list>

#include "engine/decisions/decisions.h"

namespace edgegrad {

// The first reason other than kNeeded.
inline Reason first_of(std::initializer_list<Reason> reasons) {
    for (Reason r : reasons)
        if (r != Reason::kNeeded) return r;
    return Reason::kNeeded;
}

inline Reason unless(bool needed, Reason reason) { return needed ? Reason::kNeeded : reason; }

}  // namespace edgegrad
