// Where in the picture scan lines are, and how many: in tiles, of which a first pass with lines everywhere
// tells what a second one finds there.
#pragma once

#include <vector>

#include "boundary/specular/bounds.h"
#include "tasks/scan_task.h"

namespace edgegrad {

// What a crossing is worth, whatever is asked for: its jump times what a motion of one unit across the edge
// sweeps of its line.
struct IntersectionSize {
    int64_t line;  // of the pass
    float size;
};

class ScanPlan {
 public:
    // About `lines` lines per pixel, of each direction, over the film; `guided`: in two passes, else in one.
    ScanPlan(const FilmRectangle& film, double lines, bool guided, uint32_t seed);

    int passes() const { return guided_ ? 2 : 1; }
    int64_t total(int pass) const;  // segments
    // Between the passes, by the first one's crossings. About as many segments are left for the second.
    void guide(const std::vector<std::vector<IntersectionSize>>& sizes);

    // Segments [first, first + count) of a pass.
    ScanTask task(int pass, int64_t first, int64_t count) const;

 private:
    // Lines of each direction, by tile, and the segments before each tile's.
    struct Pass {
        std::vector<int32_t> lines;
        std::vector<int64_t> first;
    };
    void set_lines(int pass, const std::vector<double>& requested);
    int64_t tiles() const { return static_cast<int64_t>(columns_) * rows_; }

    FilmRectangle film_;
    int32_t columns_, rows_;
    bool guided_;
    uint32_t seed_;
    Pass pass_[2];
    double second_ = 0.0;  // lines of the second one, in a tile's mean
};

}  // namespace edgegrad
