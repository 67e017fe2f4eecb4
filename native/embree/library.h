// Loads Embree from the shared library inside the `embreex` wheel.
#pragma once

#include <string>

#include "embree/api.h"

namespace edgegrad::embree {

// Opens the library at `path` (once per process) and returns its functions.
// Throws std::runtime_error if it can't be opened, lacks a function, or is not Embree 4.
const Api& load(const std::string& path);

// Version of the loaded library as "4.4.0"; needs load() before.
std::string version();

}  // namespace edgegrad::embree
