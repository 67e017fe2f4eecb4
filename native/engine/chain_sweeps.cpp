#include "engine/chain_sweeps.h"

#include <cmath>

namespace edgegrad {
namespace {

float column(const float* const (&v)[3], const float* const (&w)[3], int i) {
    return v[0][i] * w[0][i] + v[1][i] * w[1][i] + v[2][i] * w[2][i];
}
float length(const float* const (&v)[3], int i) { return std::sqrt(column(v, v, i)); }

// A sum smaller than this fraction of its terms is rounding. A shadow on a face whose plane contains the
// light does not move in the picture, but rounding finds edges all over it.
constexpr float kRounding = 1e-5f;

}  // namespace

ChainSweeps::ChainSweeps(const TermRun& run)
    : run_(run),
      sweep_(run.memory.adjoint.task(image_, run.work())),
      crossings_(run.memory.chains.view(sweep_.camera)) {
    image_.pixel_count = 1;
    image_.weight = 1.0f;
    AdjointWorkspace::release(run.work());
    sweep_.geometry = sweep_.camera_moves = true;
    sweep_.dropped = &dropped_;
    sweep_.tables = &run.tables;
}

void ChainSweeps::set_count(int count) { image_.samples = count; }

void ChainSweeps::differentiate_by_place(const double* shift, float* by_place) {
    DifferentiableTables camera;
    camera.add(run_.scene.camera.position, kCameraFloats, 0, kCameraFloats, 1, 1, nullptr, shift);
    sweep_.tables = &camera;
    run_.kernels.path_forward(run_.scene, sweep_, run_.work().radiance);
    sweep_.tables = &run_.tables;
    const ChainCrossings& c = crossings_;
    for (int i = 0; i < count(); ++i) {
        const float g = column(c.by_point, sweep_.position, i) + column(c.by_direction, sweep_.direction, i);
        const float most = length(c.by_point, i) * length(sweep_.position, i) +
                           length(c.by_direction, i) * length(sweep_.direction, i);
        by_place[i] = std::abs(g) > kRounding * most ? g : 0.0f;
    }
}

float ChainSweeps::size(int i) const {
    const ChainCrossings& c = crossings_;
    // Of suns, whose outlines have no place, only the ray's direction counts.
    const float slope = length(c.by_point, i);
    return length(c.jump, i) * (slope > 0.0f ? slope : length(c.by_direction, i));
}

void ChainSweeps::differentiate() { run_.is_forward() ? forward() : backward(); }

void ChainSweeps::forward() {
    const ChainCrossings& c = crossings_;
    Workspace& work = run_.work();
    run_.kernels.path_forward(run_.scene, sweep_, work.radiance);
    for (int i = 0; i < count(); ++i)
        work.radiance[0][i] =
            column(c.by_point, sweep_.position, i) + column(c.by_direction, sweep_.direction, i);
    DerivativeView tangent = run_.view;
    tangent.camera_requested = false;  // the chain's part contains the camera's
    Splats splats = run_.splats;
    run_.kernels.chain_forward(run_.scene, c, count(), work, tangent, splats);
}

void ChainSweeps::backward() {
    const ChainCrossings& c = crossings_;
    DerivativeView gradient = run_.view;
    gradient.camera_requested = false;
    float* seeds = run_.work().radiance[0];
    run_.kernels.chain_backward(run_.scene, c, count(), run_.adjoint, gradient, seeds);
    for (int i = 0; i < count(); ++i) {
        for (int k = 0; k < 3; ++k) {
            sweep_.position[k][i] = seeds[i] * c.by_point[k][i];
            sweep_.direction[k][i] = seeds[i] * c.by_direction[k][i];
        }
    }
    sweep_.seeded = true;
    const float none[3] = {0.0f, 0.0f, 0.0f};  // the jump already contains the radiance of chains
    run_.kernels.path_backward(run_.scene, sweep_, none);
}

}  // namespace edgegrad
