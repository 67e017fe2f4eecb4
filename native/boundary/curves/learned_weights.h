// What samples along edges have been worth to gradients, kept from one gradient to the next of a fit: then no
// first pass has to find it out, and what many iterations have found is surer than what one has.
//
// With F(k) what sample k would bring if all of its piece were like it, the best number of samples on a piece
// is in proportion to the root of the mean of F^2. That mean is kept per unit of the candidates' mass, so
// that it stays valid while vertices move; by cell: a part of an edge, and of directions about it. Old
// samples count less and less. The total is divided out of each gradient's samples, since adjoints shrink
// while a fit goes on.
#pragma once

#include "boundary/curves/candidates.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"

namespace edgegrad {

class LearnedWeights {
 public:
    // Whether it knows anything of these edges, and enough of the candidates.
    bool knows(const EdgeList& edges, const Candidates& candidates) const;

    // Begins with about `wanted` cells for the candidates: edges are cut into parts, each with as many cells
    // of directions, and where there are `chains` (candidates.h) as many again.
    void begin(const EdgeList& edges, const Candidates& candidates, int32_t direction_cells, bool chains,
               double requested);
    // The candidates as pieces of single cells, by what has been learned of them.
    Candidates pieces(const Candidates& candidates) const;
    // Learns from `count` samples, each scaled by `scale`, on some pieces; `total`: what all of them are
    // worth.
    void learn(const Candidates& pieces, const SampleRecord& record, int64_t count, double scale,
               double total);
    // Before the samples of one more gradient.
    void age();

 private:
    int64_t cell(int32_t edge, int32_t instance, float u, SegmentCell direction) const;
    std::vector<float> guess(const std::vector<int64_t>& cells, const std::vector<double>& masses,
                             int which) const;
    int32_t parts(int32_t edge, int32_t instance) const;  // 0: nothing is learned of it

    // By edge: its first part; parts of the copies of one edge follow each other. Edges that were no
    // candidates at the beginning have none, nor have lines along which surfaces pierce each other.
    std::vector<uint32_t> first_;
    std::vector<int32_t> copy_, copies_;  // by instance: which copy of its mesh it is, and of how many
    int32_t direction_cells_ = 1;
    bool chains_ = false;
    // By cell: the sum of the squares of samples, and their number.
    std::vector<float> moment_, samples_;
    bool learned_ = false;  // anything since the beginning
    // The mean square of samples if they were distributed by each guess, and by each part of them that goes
    // to all mass alike.
    static constexpr int kGuesses = 2, kMixtures = 4;
    double square_[kGuesses][kMixtures] = {};
    int guess_ = 1, mixture_ = 2;  // the best of them
};

// What gradients of one view of a scene have learned.
struct LearnedSampling {
    LearnedWeights weights[kBoundaryKinds];
    // By term: its samples in terms of those that it has unless told otherwise, and how many the last
    // gradient took.
    double share[kDerivativeTerms] = {1.0, 1.0, 1.0, 1.0};
    double taken[kDerivativeTerms] = {};
};

}  // namespace edgegrad
