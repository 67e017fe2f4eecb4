// A grid of cells through which light beams pass (boundary/caustics/traced_beams.h), which aims directions
// from there.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "tasks/boundary_task.h"
#include "util/double_vector.h"

namespace edgegrad {

struct Beam {
    Vector light, last, first, end;
    double weight, distance;  // as in BeamPaths

    bool is_distant() const { return !(distance < std::numeric_limits<double>::infinity()); }
};

// Cells of space with the points at which their beams begin or end.
class BeamGrid {
 public:
    BeamGridView view() const;
    // The flux of beams at a place.
    double flux(Vector p) const;
    double side() const { return side_; }

 private:
    friend class BeamGridBuilder;
    int64_t cell_of(Vector p) const;  // -1: outside

    std::vector<int32_t> slot_;
    std::vector<float> targets_;
    std::vector<double> flux_;  // by slot: the summed weight of the beams
    std::array<double, 3> low_{};
    double side_ = 1.0;
    std::array<int32_t, 3> count_{};
};

// Places a grid about beams, and fills its cells with those that pass through them.
class BeamGridBuilder {
 public:
    BeamGridBuilder(const std::vector<Beam>& beams, int threads) : beams_(beams), threads_(threads) {
        place();
    }

    // Marks the cells of a segment. Only marked cells are filled.
    void mark(Vector a, Vector b) {
        visit_cells(a, b, [&](size_t cell) { marked_[cell] = 1; });
    }
    // Beams pass from `from(beam)` to `to(beam)`. `candidates(beam)` are points at which directions may be
    // aimed from the cells that it passes; those about which the directions of a cell vary least are taken.
    using Place = std::function<Vector(const Beam&)>;
    using Places = std::function<std::array<Vector, 3>(const Beam&)>;
    BeamGrid fill(const Place& from, const Place& to, const Places& candidates) const;

 private:
    struct Kept {
        size_t at = 0;  // cell
        double flux = 0.0;
        double key[kBeamTargets];
        int32_t beam[kBeamTargets];
        int32_t count = 0;
    };

    void place();
    static void keep(Kept& cell, double key, int32_t beam);
    void visit_cells(Vector a, Vector b, const std::function<void(size_t)>& visit) const;
    Vector middle(size_t cell) const;
    bool aim(Vector middle, const std::vector<std::vector<Vector>>& choices, float* targets) const;

    const std::vector<Beam>& beams_;
    const int threads_;
    BeamGrid grid_;
    std::vector<uint8_t> marked_;  // by cell
};

}  // namespace edgegrad
