// Loads Embree from the shared library inside the `embreex` wheel.
#pragma once

#include <string>

#include "embree/api.h"

namespace edgegrad::embree {

constexpr int kErrorOutOfMemory = 4;  // RTC_ERROR_OUT_OF_MEMORY

// Opens the library at `path` (once per process) and returns its functions. Throws std::runtime_error if it
// cannot be opened, lacks a function, or is not Embree 4.
const Api& load(const std::string& path);

// The process's device with this number of threads. load() must have been called. A device is never released,
// because releasing allocates memory where exceptions are not allowed. Throws std::bad_alloc or
// std::runtime_error if no device can be made.
Device device(int threads);

// Commits a scene. Meanwhile asks the caller whether to continue (util/parallel.h), and throws what the
// caller throws. The scene is unusable then.
void commit_scene(SceneHandle scene);

// Version of the loaded library, such as "4.4.0". load() must have been called.
std::string version();

}  // namespace edgegrad::embree
