// Learned weights of edge segments, kept from one gradient of a fit to the next. With them no first pass is
// needed, and the estimates of many iterations are more accurate than those of one.
//
// Let F(k) be the estimate of the term if all of its segment were like sample k. The optimal number of
// samples on a segment is proportional to the root of the mean of F^2. This mean is stored per unit of
// weight, so that it stays valid while vertices move. It is stored by cell, a part of an edge times a cell of
// directions about it. The influence of old samples decays exponentially. The total is divided out of each
// gradient's samples, because adjoints shrink as a fit converges.
#pragma once

#include "boundary/curves/candidates.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"

namespace edgegrad {

class LearnedWeights {
 public:
    // Whether the weights know these edges and enough of the candidates.
    bool knows(const EdgeList& edges, const Candidates& candidates) const;

    // Starts with about `requested` cells for the candidates. Edges are cut into parts, each with the same
    // number of direction cells. `chains` (segment_cells.h) doubles the cells.
    void begin(const EdgeList& edges, const Candidates& candidates, int32_t direction_cells, bool chains,
               double requested);
    // The candidates cut into segments of single cells, weighted by what has been learned.
    Candidates pieces(const Candidates& candidates) const;
    // Learns from `count` samples on some segments. Their contributions are multiplied by `scale`. `total` is
    // the sum of all contributions.
    void learn(const Candidates& segments, const SampleRecord& record, int64_t count, double scale,
               double total);
    // Decays the stored samples; call before those of the next gradient.
    void age();

    // Calls visit(name, member) for everything that is stored, to save and to restore it.
    template <typename Weights, typename Visit>
    static void members(Weights& w, const Visit& visit) {
        visit("first", w.first_), visit("instance_number", w.instance_number_);
        visit("instance_count", w.instance_count_), visit("direction_cells", w.direction_cells_);
        visit("chains", w.chains_), visit("moment", w.moment_), visit("samples", w.samples_);
        visit("learned", w.learned_), visit("square", w.square_);
        visit("guess", w.guess_), visit("mixture", w.mixture_);
    }
    // Whether restored members fit together, so that no cell lies outside of the arrays.
    bool is_consistent() const;

 private:
    int64_t cell(int32_t edge, int32_t instance, float u, SegmentCell direction) const;
    std::vector<float> guess(const std::vector<int64_t>& cells, const std::vector<double>& masses,
                             int which) const;
    int32_t parts(int32_t edge, int32_t instance) const;  // 0: nothing is stored

    // By edge: its first part. The parts of an edge's instances are consecutive. Edges that were no
    // candidates at the start have no parts. Neither have intersections of surfaces.
    std::vector<uint32_t> first_;
    // By instance: its number among the instances of its mesh, and the number of these instances.
    std::vector<int32_t> instance_number_, instance_count_;
    int32_t direction_cells_ = 1;
    bool chains_ = false;
    // By cell: the sum of squared samples, and the number of samples.
    std::vector<float> moment_, samples_;
    bool learned_ = false;  // since begin()
    // The mean squared sample under each guess, mixed with the unlearned weights in each of the fractions
    // kAlike.
    static constexpr int kGuesses = 2, kMixtures = 4;
    double square_[kGuesses][kMixtures] = {};
    int guess_ = 1, mixture_ = 2;  // the best of them
};

// What the gradients of one view of a scene have learned.
struct LearnedSampling {
    LearnedWeights weights[kBoundaryKinds];
    // By term: the factor on its default number of samples, and the number that the last gradient took.
    double share[kDerivativeTerms] = {1.0, 1.0, 1.0, 1.0};
    double taken[kDerivativeTerms] = {};
};

}  // namespace edgegrad
