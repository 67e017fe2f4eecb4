#include "embree/library.h"

#include <atomic>
#include <exception>
#include <map>
#include <mutex>
#include <new>
#include <stdexcept>
#include <thread>

#include "util/parallel.h"

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

namespace edgegrad::embree {
namespace {

constexpr int kMajor = 4;

void* open_library(const std::string& path) {
#ifdef _WIN32
    void* handle = reinterpret_cast<void*>(LoadLibraryA(path.c_str()));
    if (!handle) throw std::runtime_error("can't load Embree from " + path);
#else
    int flags = RTLD_NOW | RTLD_LOCAL;
#ifdef RTLD_DEEPBIND
    // Blender's executable has its own libembree4 and libtbb in the global scope. Without deep binding the
    // wheel's Embree would use those. Only this handle is bound deeply: for Python extension modules deep
    // binding mixes allocators and crashes. Sanitizers do not support it.
#ifndef EDGEGRAD_SANITIZED
    flags |= RTLD_DEEPBIND;
#endif
#endif
    void* handle = dlopen(path.c_str(), flags);
    if (!handle) throw std::runtime_error("can't load Embree from " + path + ": " + dlerror());
#endif
    return handle;
}

template <typename F>
void resolve(void* handle, const char* name, F& function) {
#ifdef _WIN32
    function = reinterpret_cast<F>(GetProcAddress(reinterpret_cast<HMODULE>(handle), name));
#else
    function = reinterpret_cast<F>(dlsym(handle, name));
#endif
    if (!function) throw std::runtime_error(std::string("Embree's library has no function ") + name);
}

Api resolve_all(void* handle) {
    Api api{};
    resolve(handle, "rtcNewDevice", api.new_device);
    resolve(handle, "rtcReleaseDevice", api.release_device);
    resolve(handle, "rtcGetDeviceError", api.device_error);
    resolve(handle, "rtcGetDeviceProperty", api.device_property);
    resolve(handle, "rtcNewScene", api.new_scene);
    resolve(handle, "rtcReleaseScene", api.release_scene);
    resolve(handle, "rtcSetSceneFlags", api.set_scene_flags);
    resolve(handle, "rtcSetSceneBuildQuality", api.set_scene_quality);
    resolve(handle, "rtcCommitScene", api.commit_scene);
    resolve(handle, "rtcNewGeometry", api.new_geometry);
    resolve(handle, "rtcReleaseGeometry", api.release_geometry);
    resolve(handle, "rtcCommitGeometry", api.commit_geometry);
    resolve(handle, "rtcSetGeometryBuildQuality", api.set_geometry_quality);
    resolve(handle, "rtcSetSharedGeometryBuffer", api.set_shared_buffer);
    resolve(handle, "rtcUpdateGeometryBuffer", api.update_buffer);
    resolve(handle, "rtcSetGeometryEnableFilterFunctionFromArguments", api.enable_argument_filter);
    resolve(handle, "rtcSetGeometryMask", api.set_geometry_mask);
    resolve(handle, "rtcSetGeometryUserPrimitiveCount", api.set_primitive_count);
    resolve(handle, "rtcSetGeometryUserData", api.set_user_data);
    resolve(handle, "rtcSetGeometryBoundsFunction", api.set_bounds_function);
    resolve(handle, "rtcSetGeometryInstancedScene", api.set_instanced_scene);
    resolve(handle, "rtcSetGeometryTransform", api.set_transform);
    resolve(handle, "rtcAttachGeometryByID", api.attach_geometry_by_id);
    resolve(handle, "rtcIntersect1", api.intersect1);
    resolve(handle, "rtcIntersect4", api.intersect4);
    resolve(handle, "rtcIntersect8", api.intersect8);
    resolve(handle, "rtcIntersect16", api.intersect16);
    resolve(handle, "rtcOccluded1", api.occluded1);
    resolve(handle, "rtcOccluded4", api.occluded4);
    resolve(handle, "rtcOccluded8", api.occluded8);
    resolve(handle, "rtcOccluded16", api.occluded16);
    return api;
}

std::mutex mutex;
bool loaded = false;
Api functions;
std::string loaded_version;
// Embree calls the monitor from all threads of a build. It cancels the build by returning false.
using Monitor = bool (*)(void*, double);
void (*set_progress_monitor)(SceneHandle, Monitor, void*);
std::map<int, Device> devices;  // by number of threads

}  // namespace

const Api& load(const std::string& path) {
    std::lock_guard lock(mutex);
    if (loaded) return functions;
    void* const handle = open_library(path);
    const Api api = resolve_all(handle);
    resolve(handle, "rtcSetSceneProgressMonitorFunction", set_progress_monitor);
    Device device = api.new_device("threads=1");
    if (!device) throw std::runtime_error("Embree can't create a device");
    const auto major = api.device_property(device, kVersionMajor);
    const auto minor = api.device_property(device, kVersionMinor);
    const auto patch = api.device_property(device, kVersionPatch);
    loaded_version = std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(patch);
    if (major != kMajor) {
        api.release_device(device);
        throw std::runtime_error("the embreex wheel has Embree " + loaded_version + ", but version " +
                                 std::to_string(kMajor) + " is needed; install another embreex");
    }
    devices[1] = device;
    functions = api;
    loaded = true;
    return functions;
}

Device device(int threads) {
    std::lock_guard lock(mutex);
    const auto place = devices.try_emplace(threads, nullptr).first;
    if (!place->second) place->second = functions.new_device(("threads=" + std::to_string(threads)).c_str());
    if (place->second) return place->second;
    if (functions.device_error(nullptr) == kErrorOutOfMemory) throw std::bad_alloc();
    throw std::runtime_error("Embree can't create a device");
}

void commit_scene(SceneHandle scene) {
    struct Build {
        std::thread::id caller = std::this_thread::get_id();
        std::atomic<bool> stop{false};
        std::exception_ptr error;
    } build;
    const auto goes_on = [](void* data, double) noexcept {
        Build& b = *static_cast<Build*>(data);
        if (std::this_thread::get_id() == b.caller && !b.stop) {
            try {
                may_cancel();
            } catch (...) {
                b.error = std::current_exception();
                b.stop = true;
            }
        }
        return !b.stop;
    };
    set_progress_monitor(scene, goes_on, &build);
    functions.commit_scene(scene);
    set_progress_monitor(scene, nullptr, nullptr);
    if (build.error) std::rethrow_exception(build.error);
}

std::string version() {
    std::lock_guard lock(mutex);
    return loaded_version;
}

}  // namespace edgegrad::embree
