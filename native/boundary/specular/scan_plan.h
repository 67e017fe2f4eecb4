// The number and the distribution of scan lines over tiles of the picture. A first pass with lines everywhere
// guides a second one, and is no part of the estimate.
#pragma once

#include <vector>

#include "boundary/specular/bounds.h"
#include "tasks/scan_task.h"

namespace edgegrad {

// The size of a crossing: its jump times the swept part of its line, for a unit motion across the edge. It
// does not depend on the requested parameters, so that both modes use the same lines.
struct IntersectionSize {
    int64_t line;  // of the pass
    float size;
};

class ScanPlan {
 public:
    // About `lines` lines per pixel and direction over the film, in two passes if `guided`, else in one.
    ScanPlan(const FilmRectangle& film, double lines, bool guided, uint32_t seed);

    int32_t line_segments() const { return scan_line_segments(tile_); }
    int passes() const { return guided_ ? 2 : 1; }
    int64_t total(int pass) const;  // segments
    // Distributes the second pass by the crossings of the first, keeping about the same number of segments.
    void guide(const std::vector<std::vector<IntersectionSize>>& sizes);

    // Segments [first, first + count) of a pass.
    ScanTask task(int pass, int64_t first, int64_t count) const;

 private:
    // By tile: the lines of each direction, and the number of segments before the tile.
    struct Pass {
        std::vector<int32_t> lines;
        std::vector<int64_t> first;
    };
    void set_lines(int pass, const std::vector<double>& requested);
    int32_t whole_lines(double requested) const;
    int64_t tiles() const { return static_cast<int64_t>(columns_) * rows_; }

    FilmRectangle film_;
    float tile_;  // side of a tile, pixels
    int32_t columns_, rows_;
    bool guided_;
    uint32_t seed_;
    Pass pass_[2];
    double second_ = 0.0;  // mean number of lines per tile of the second pass
};

}  // namespace edgegrad
