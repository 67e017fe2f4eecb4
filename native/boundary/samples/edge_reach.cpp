#include "boundary/samples/edge_reach.h"

#include <algorithm>
#include <cmath>

#include "boundary/curves/segment_cells.h"
#include "boundary/samples/sample_plan.h"
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
// Points on a segment at most, where it is not short.
constexpr double kMostPoints = 64.0;
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
    std::vector<Place>& found = out->places_;
    for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
        const Vector x{columns[0][i], columns[1][i], columns[2][i]};
        const double weight = columns[3][i];
        if (weight > 0.0 && std::isfinite(x.x + x.y + x.z + weight)) found.push_back({x, 0.0, weight});
    }
    if (found.size() < kFewestPlaces) return nullptr;
    std::vector<double> distance2(found.size());
    for (Place& place : found) {
        for (size_t k = 0; k < found.size(); ++k) {
            const Vector way = found[k].position - place.position;
            distance2[k] = dot(way, way);
        }
        std::nth_element(distance2.begin(), distance2.begin() + kNeighbour, distance2.end());
        place.size2 = std::max(distance2[kNeighbour], 1e-30);
    }
    out->kept_ = scene.environment_image.sampled ? kKeptOfImages : kKept;
    return out;
}

bool EdgeReach::serves(const LightView& lights) {
    bool distant = false;
    for (int32_t k = 0; k < lights.top; ++k) distant |= lights.nodes[k].radius < 0.0f;
    return distant && lights.top <= kMostLights;
}

// `reach(e, nearest2)` is the reach of a point, and bounds the squared distance to the nearest place.
template <typename Reach>
Candidates EdgeReach::weighted_by(const SceneView& scene, const Candidates& edges, int threads, double kept,
                                  const Reach& reach) const {
    const int64_t count = edges.size();
    std::vector<double> mass(static_cast<size_t>(count));
    const auto of_segment = [&](const EdgeEnds& ends) {
        const Vector t = ends.b - ends.a;
        double nearest2 = HUGE_VAL;
        const double middle = reach(ends.a + t * 0.5, nearest2);
        // A short segment is like its middle
        if (dot(t, t) <= nearest2) return middle;
        const int points = static_cast<int>(std::min(2.0 * std::sqrt(dot(t, t) / nearest2), kMostPoints));
        double sum = 0.0;
        for (int k = 0; k < points; ++k) sum += reach(ends.a + t * ((k + 0.5) / points), nearest2);
        return sum / points;
    };
    parallel_for(threads, (count + kBlock - 1) / kBlock, nullptr, [&](int, int64_t block) {
        for (int64_t k = block * kBlock; k < std::min(count, (block + 1) * kBlock); ++k) {
            const auto i = static_cast<size_t>(k);
            mass[i] = of_segment(ends_of(scene, edges, i)) * (edges.cumulative[i + 1] - edges.cumulative[i]);
        }
    });
    double all = 0.0;
    for (double m : mass) all += m;
    Candidates out = edges;
    if (!(all > 0.0) || !std::isfinite(all)) return out;
    const double unit = (1.0 - kept) * edges.mass() / all;
    for (size_t i = 0; i < mass.size(); ++i)
        out.cumulative[i + 1] =
            out.cumulative[i] + kept * (edges.cumulative[i + 1] - edges.cumulative[i]) + unit * mass[i];
    return out;
}

Candidates EdgeReach::weighted(const SceneView& scene, const Candidates& edges, int threads) const {
    return weighted_by(scene, edges, threads, kept_, [&](Vector e, double& nearest2) {
        double sum = 0.0;
        for (const Place& place : places_) {
            const Vector way = place.position - e;
            const double r2 = dot(way, way) + place.size2;
            sum += place.weight / r2;
            nearest2 = std::min(nearest2, r2);
        }
        return sum;
    });
}

Candidates EdgeReach::weighted_for_lights(const SceneView& scene, const Candidates& edges,
                                          const LightView& lights, int threads) const {
    return weighted_by(scene, edges, threads, kKept, [&](Vector e, double& nearest2) {
        double sum = 0.0, all = 0.0;
        for (int32_t k = 0; k < lights.top; ++k) {
            const LightNode& n = lights.nodes[k];
            Vector travels = vector_at(n.axis);
            double arrives = std::max(static_cast<double>(n.power), 1e-30), spread = n.sin_o;
            if (n.radius >= 0.0f) {
                const Vector way = e - vector_at(n.center);
                const double r = std::sqrt(dot(way, way)) + static_cast<double>(n.radius) + 1e-30;
                arrives = std::max(static_cast<double>(n.intensity(static_cast<float>(r))), 1e-30) / (r * r);
                spread = n.radius / r, travels = way * (1.0 / r);
            }
            all += arrives;
            for (const Place& place : places_) {
                const Vector way = place.position - e;
                const double along = std::max(dot(way, travels), 0.0), penumbra = spread * along;
                const double r2 = dot(way, way) - along * along + penumbra * penumbra + place.size2;
                sum += arrives * place.weight / r2;
                nearest2 = std::min(nearest2, r2);
            }
        }
        return sum / all;
    });
}

}  // namespace edgegrad
