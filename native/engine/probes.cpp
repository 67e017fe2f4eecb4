// Single functions of the path tracer on an engine's scene: its light sampling for tests, and rays.
#include <stdexcept>

#include "engine/call_scene.h"
#include "engine/engine.h"
#include "kernels/dispatch.h"

namespace edgegrad {

void Engine::probe_lights(const LightProbes& probes) const {
    require_settled();
    with_probes(kernels_).light_samples(PreparedScene(api_, &bvh(), tables_, nullptr, false, lights()).view(),
                                        probes);
}

void Engine::probe_directions(const DirectionProbes& probes) const {
    require_settled();
    with_probes(kernels_).light_directions(
        PreparedScene(api_, &bvh(), tables_, nullptr, false, lights()).view(), probes);
}

void Engine::trace(const RayBatch& rays, int32_t* face, float* distance) const {
    require_settled();
    kernels_.ray_batch(PreparedScene(api_, &bvh(), tables_, nullptr, false, nullptr).view(), rays, face,
                       distance);
}

void Engine::probe_environment(const EnvironmentProbes& probes) const {
    require_settled();
    const PreparedScene prepared(api_, &bvh(), tables_, nullptr, false, lights());
    if (!prepared.view().environment_image.pixels)
        throw std::invalid_argument("the environment has no image");
    with_probes(kernels_).environment(prepared.view(), probes);
}

}  // namespace edgegrad
