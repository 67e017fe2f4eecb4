// Sweeps over recorded chains, which carry the derivatives of a chain's last ray to the parameters.
#pragma once

#include "engine/terms/term.h"
#include "tasks/adjoint_task.h"

namespace edgegrad {

class ChainSweeps {
 public:
    explicit ChainSweeps(const TermRun& run);
    ChainSweeps(const ChainSweeps&) = delete;
    ChainSweeps& operator=(const ChainSweeps&) = delete;

    // The places at which the last rays of the chains touch something.
    ChainCrossings& crossings() const { return crossings_; }
    VertexMemory& vertices() const { return *sweep_.vertices; }
    // Call once their number is known.
    void set_count(int count);
    int count() const { return image_.samples; }
    // Differentiates the distance of each last ray from what it touches by the place in the picture, if the
    // camera's floats change by `shift`.
    void differentiate_by_place(const double* shift, float* by_place);
    // The size of a crossing: its jump times the motion across its line, for a unit motion of the light or
    // edge.
    float size(int i) const;
    // Adds the derivatives of the jumps of radiance to the splats or to the gradient of the run.
    void differentiate();

 private:
    void forward();
    void backward();

    const TermRun& run_;
    ImageTask image_{};
    DroppedSamples dropped_;  // stays empty: these vertices have no light
    AdjointTask sweep_;
    ChainCrossings& crossings_;
};

}  // namespace edgegrad
