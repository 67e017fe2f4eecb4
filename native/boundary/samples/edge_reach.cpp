#include "boundary/samples/edge_reach.h"

#include <algorithm>
#include <cmath>

#include "boundary/curves/segment_cells.h"
#include "boundary/samples/sample_plan.h"
#include "scene/lights/light_list.h"
#include "tasks/block_sizes.h"
#include "tasks/seed_tags.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Paths of the picture, and the fewest places that are enough.
constexpr int kPaths = 64, kFewestPlaces = 8;
// A place stands for its surroundings up to this nearest of the other places.
constexpr size_t kNeighbour = 4;
// The part of the weights that is kept. Directions towards an image of the environment are sampled by the
// image. So its shadows also come from afar.
constexpr double kKept = 0.2, kKeptOfImages = 0.5;
constexpr int64_t kBlock = 1 << 12;
// Lights at most, for the reach of their light.
constexpr int32_t kMostLights = 4;

}  // namespace

std::shared_ptr<const EdgeReach> EdgeReach::find(const SceneView& scene, const EdgeList& edges,
                                                 const RenderOptions& options) {
    RenderOptions own = options;
    own.seed = kReachSeed;  // the same for all calls, so that learned weights stay valid
    SamplePlan plan(std::make_shared<const Candidates>(over_picture(kPaths, false)), kPaths, kPaths, own,
                    kCameraSampledIndirect, false);
    const int64_t count = std::min(plan.total(0), kBoundaryChunk);
    std::vector<float> columns[4];
    for (auto& c : columns) c.resize(static_cast<size_t>(kBoundaryChunk));
    SeenPlaces places{{columns[0].data(), columns[1].data(), columns[2].data()}, columns[3].data()};
    edges.kernels.seen_places(scene, plan.task(0, 0, count), places);

    auto out = std::make_shared<EdgeReach>();
    for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
        const float x = columns[0][i], y = columns[1][i], z = columns[2][i], weight = columns[3][i];
        if (!(weight > 0.0f) || !std::isfinite(x + y + z + weight)) continue;
        for (int c = 0; c < 3; ++c) out->position_[c].push_back(columns[c][i]);
        out->weight_.push_back(weight);
    }
    const size_t found = out->weight_.size();
    if (found < kFewestPlaces) return nullptr;
    std::vector<float> distance2(found);
    for (size_t i = 0; i < found; ++i) {
        for (size_t k = 0; k < found; ++k) {
            distance2[k] = 0.0f;
            for (const auto& p : out->position_) distance2[k] += (p[k] - p[i]) * (p[k] - p[i]);
        }
        std::nth_element(distance2.begin(), distance2.begin() + kNeighbour, distance2.end());
        out->size2_.push_back(std::clamp(distance2[kNeighbour], 1e-30f, 1e36f));
    }
    out->kept_ = scene.environment_image.sampled ? kKeptOfImages : kKept;
    return out;
}

bool EdgeReach::serves(const LightView& lights) {
    bool distant = false;
    for (int32_t k = 0; k < lights.top; ++k) distant |= lights.nodes[k].radius < 0.0f;
    return distant && lights.top <= kMostLights;
}

Candidates EdgeReach::weighted_by(EdgeReachTask task, const SceneView& scene, const EdgeList& list,
                                  const Candidates& edges, double kept) const {
    task.places = static_cast<int32_t>(weight_.size());
    for (int c = 0; c < 3; ++c) task.position[c] = position_[c].data();
    task.size2 = size2_.data(), task.weight = weight_.data();
    const int64_t count = edges.size(), blocks = (count + kBlock - 1) / kBlock;
    std::vector<float> reach(static_cast<size_t>(blocks * kBlock));
    parallel_for(list.threads, blocks, nullptr, [&](int, int64_t block) {
        // Copy a block into whole packets
        const int64_t first = block * kBlock, size = std::min(kBlock, count - first);
        std::vector<int32_t> edge(kBlock, edges.edge[static_cast<size_t>(first)]), instance(kBlock, -1);
        std::vector<float> u0(kBlock, 0.0f), u1(kBlock, 0.0f);
        std::copy_n(edges.edge.begin() + first, size, edge.begin());
        std::copy_n(edges.u0.begin() + first, size, u0.begin());
        std::copy_n(edges.u1.begin() + first, size, u1.begin());
        if (!edges.instance.empty()) std::copy_n(edges.instance.begin() + first, size, instance.begin());
        EdgeReachTask own = task;
        own.edge = edge.data(), own.instance = edges.instance.empty() ? nullptr : instance.data();
        own.u0 = u0.data(), own.u1 = u1.data(), own.count = size;
        own.reach = reach.data() + first;
        list.kernels.edge_reach(scene, own);
    });
    const auto mass = [&](size_t i) { return edges.cumulative[i + 1] - edges.cumulative[i]; };
    double all = 0.0;
    for (size_t i = 0; i < static_cast<size_t>(count); ++i) all += static_cast<double>(reach[i]) * mass(i);
    Candidates out = edges;
    if (!(all > 0.0) || !std::isfinite(all)) return out;
    const double unit = (1.0 - kept) * edges.mass() / all;
    for (size_t i = 0; i < static_cast<size_t>(count); ++i)
        out.cumulative[i + 1] = out.cumulative[i] + (kept + unit * static_cast<double>(reach[i])) * mass(i);
    return out;
}

Candidates EdgeReach::weighted(const SceneView& scene, const EdgeList& list, const Candidates& edges) const {
    return weighted_by({}, scene, list, edges, kept_);
}

Candidates EdgeReach::weighted_for_lights(const SceneView& scene, const EdgeList& list,
                                          const Candidates& edges) const {
    const LightView& lights = list.lights->view();
    EdgeReachTask task{};
    task.lights = lights.nodes, task.light_count = lights.top;
    return weighted_by(task, scene, list, edges, kKept);
}

}  // namespace edgegrad
