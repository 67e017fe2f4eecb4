// Loads Embree from the shared library inside the `embreex` wheel.
#pragma once

#include <string>

#include "embree/api.h"

namespace edgegrad::embree {

constexpr int kErrorOutOfMemory = 4;  // RTC_ERROR_OUT_OF_MEMORY

// Opens the library at `path` (once per process) and returns its functions.
// Throws std::runtime_error if it can't be opened, lacks a function, or is not Embree 4.
const Api& load(const std::string& path);

// The process's device for so many threads; needs load() before. It is never released: releasing one
// allocates memory where it may not throw. Throws std::bad_alloc or std::runtime_error if there is none.
Device device(int threads);

// Commits a scene; asks the caller meanwhile whether to go on (util/parallel.h) and throws what it throws.
// The scene can't be used then.
void commit_scene(SceneHandle scene);

// Version of the loaded library as "4.4.0"; needs load() before.
std::string version();

}  // namespace edgegrad::embree
