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
        const double x = columns[0][i], y = columns[1][i], z = columns[2][i], weight = columns[3][i];
        if (!(weight > 0.0) || !std::isfinite(x + y + z + weight)) continue;
        out->x_.push_back(x), out->y_.push_back(y), out->z_.push_back(z), out->weight_.push_back(weight);
    }
    const size_t found = out->x_.size();
    if (found < kFewestPlaces) return nullptr;
    std::vector<double> distance2(found);
    for (size_t i = 0; i < found; ++i) {
        for (size_t k = 0; k < found; ++k) {
            const double x = out->x_[k] - out->x_[i], y = out->y_[k] - out->y_[i],
                         z = out->z_[k] - out->z_[i];
            distance2[k] = x * x + y * y + z * z;
        }
        std::nth_element(distance2.begin(), distance2.begin() + kNeighbour, distance2.end());
        out->size2_.push_back(std::max(distance2[kNeighbour], 1e-30));
    }
    out->kept_ = scene.environment_image.sampled ? kKeptOfImages : kKept;
    return out;
}

double EdgeReach::of_segment(const EdgeEnds& ends) const {
    const Vector a = ends.a, t = ends.b - ends.a, middle = a + t * 0.5;
    const double length2 = dot(t, t);
    double sum = 0.0, nearest = HUGE_VAL;
    const size_t count = x_.size();
    for (size_t k = 0; k < count; ++k) {
        const double x = x_[k] - middle.x, y = y_[k] - middle.y, z = z_[k] - middle.z;
        const double r2 = x * x + y * y + z * z + size2_[k];
        sum += weight_[k] / r2;
        nearest = std::min(nearest, r2);
    }
    // A short segment is like its middle. Else integrate 1/(h^2 + (u - s)^2) over its length: s is the foot
    // of the place on the segment's line, and h its distance from the foot.
    if (length2 < nearest) return sum;
    const double length = std::sqrt(length2);
    sum = 0.0;
    for (size_t k = 0; k < count; ++k) {
        const double x = x_[k] - a.x, y = y_[k] - a.y, z = z_[k] - a.z;
        const double s = (x * t.x + y * t.y + z * t.z) / length;
        const double h = std::sqrt(std::max(x * x + y * y + z * z - s * s, 0.0) + size2_[k]);
        sum += weight_[k] * (std::atan((length - s) / h) + std::atan(s / h)) / (h * length);
    }
    return sum;
}

Candidates EdgeReach::weighted(const SceneView& scene, const Candidates& edges, int threads) const {
    const int64_t count = edges.size();
    std::vector<double> mass(static_cast<size_t>(count));
    parallel_for(threads, (count + kBlock - 1) / kBlock, nullptr, [&](int, int64_t block) {
        for (int64_t k = block * kBlock; k < std::min(count, (block + 1) * kBlock); ++k) {
            const auto i = static_cast<size_t>(k);
            const double reach = of_segment(ends_of(scene, edges, i));
            mass[i] = reach * (edges.cumulative[i + 1] - edges.cumulative[i]);
        }
    });
    double all = 0.0;
    for (double m : mass) all += m;
    Candidates out = edges;
    if (!(all > 0.0) || !std::isfinite(all)) return out;
    const double unit = (1.0 - kept_) * edges.mass() / all;
    for (size_t i = 0; i < mass.size(); ++i)
        out.cumulative[i + 1] =
            out.cumulative[i] + kept_ * (edges.cumulative[i + 1] - edges.cumulative[i]) + unit * mass[i];
    return out;
}

}  // namespace edgegrad
