#include "boundary/curves/learned_weights.h"

#include <algorithm>
#include <cmath>

#include "boundary/curves/segment_cells.h"
#include "tasks/boundary_task.h"

namespace edgegrad {
namespace {

// The fraction of a cell's samples, and of the squared errors of guesses, that one more gradient keeps. A
// larger fraction averages over more gradients, but adapts more slowly.
constexpr float kKept = 0.8f;
constexpr double kKeptSquare = 0.9;
// A guess is the mean over a segment's own cell, blended with the mean over `reach` segments to each side.
// The latter has the weight of `weight` samples. The wide guess is better where contributions are rare.
struct Neighbours {
    int64_t reach;
    double weight;
};
constexpr Neighbours kNeighbours[] = {{4, 2.0}, {32, 1e6}};
// The candidate fractions of the samples that follow the unlearned weights. They keep segments sampled whose
// guess is too low.
constexpr double kAlike[] = {0.15, 0.35, 0.6, 1.0};
double mixed(int mixture, float size) {
    return kAlike[mixture] + (1.0 - kAlike[mixture]) * static_cast<double>(size);
}
// Upper bound of a guess relative to the mean. It limits the harm of single outliers.
constexpr float kLargest = 16.0f;
// If cells are missing for more than this fraction of the weight, learning starts again.
constexpr double kMostUnknown = 0.25;
// About the number of cells beyond which an edge gets fewer direction cells.
constexpr double kMostCells = 1 << 20;

// The cell of an n x n grid that contains the first corner of a cell of an others x others grid.
SegmentCell cell_among(SegmentCell cell, int32_t others, int32_t n) {
    if (n == others) return cell;
    const int32_t place = cell.place();
    return {place / others * n / others * n + place % others * n / others, cell.chained()};
}

// By edge: the number of instances of its mesh, at least 1.
std::vector<uint32_t> edge_copies(const SceneTables& tables, const std::vector<int32_t>& instances,
                                  size_t edges) {
    std::vector<uint32_t> out;
    size_t mesh = 0;
    for (size_t edge = 0; edge < edges; ++edge) {
        const auto face = static_cast<int32_t>(tables.edge_faces[tables.edge_face_first[edge]]);
        while (face >= tables.mesh_first_face[mesh + 1]) ++mesh;
        out.push_back(static_cast<uint32_t>(std::max(1, instances[mesh])));
    }
    return out;
}

}  // namespace

bool LearnedWeights::is_consistent() const {
    if (direction_cells_ < 1 || direction_cells_ > 1 << 15 ||
        instance_number_.size() != instance_count_.size() || guess_ < 0 || guess_ >= kGuesses ||
        mixture_ < 0 || mixture_ >= kMixtures)
        return false;
    for (size_t i = 0; i < instance_number_.size(); ++i)
        if (instance_number_[i] < 0 || instance_number_[i] >= instance_count_[i]) return false;
    if (!first_.empty() && (first_.front() != 0 || !std::is_sorted(first_.begin(), first_.end())))
        return false;
    const auto cells = static_cast<size_t>(direction_cells_) * static_cast<size_t>(direction_cells_);
    const size_t parts = first_.empty() ? 0 : first_.back();
    return moment_.size() == parts * cells * (chains_ ? 2 : 1) && samples_.size() == moment_.size();
}

bool LearnedWeights::knows(const EdgeList& edges, const Candidates& candidates) const {
    if (!learned_ || first_.size() != static_cast<size_t>(edges.count()) + 1 ||
        instance_number_.size() != edges.tables.instance_mesh.size())
        return false;
    double unknown = 0.0;
    for (size_t i = 0; i < candidates.edge.size(); ++i)
        if (edges.is_edge(candidates.edge[i]) && parts(candidates.edge[i], -1) == 0)
            unknown += candidates.cumulative[i + 1] - candidates.cumulative[i];
    return unknown <= kMostUnknown * candidates.mass();
}

void LearnedWeights::begin(const EdgeList& edges, const Candidates& candidates, int32_t direction_cells,
                           bool chains, double requested) {
    const SceneTables& tables = edges.tables;
    // Every edge has all cells of directions, so many edges require few cells each.
    const double lists = static_cast<double>(std::max<int64_t>(1, candidates.size())) * (chains ? 2 : 1);
    direction_cells = std::clamp(static_cast<int32_t>(std::sqrt(std::max(requested, kMostCells) / lists)), 1,
                                 direction_cells);
    direction_cells_ = direction_cells, chains_ = chains, learned_ = false;
    guess_ = 1, mixture_ = 2, std::fill_n(&square_[0][0], kGuesses * kMixtures, 0.0);
    std::vector<int32_t> instances(static_cast<size_t>(tables.visible_meshes), 0);
    instance_number_.clear(), instance_count_.clear();
    for (int32_t mesh : tables.instance_mesh)
        instance_number_.push_back(instances[static_cast<size_t>(mesh)]++);
    for (int32_t mesh : tables.instance_mesh) instance_count_.push_back(instances[static_cast<size_t>(mesh)]);

    // Choose the number of parts of each edge in proportion to its weight
    const auto count = static_cast<size_t>(edges.count());
    first_.assign(count + 1, 0);
    const int32_t all = direction_cells * direction_cells * (chains ? 2 : 1);  // cells of a part
    const double each = requested / all;
    for (int64_t k = 0; k < candidates.size(); ++k) {
        const auto i = static_cast<size_t>(k), edge = static_cast<size_t>(candidates.edge[i]);
        if (edge >= count) continue;
        const double mass = candidates.cumulative[i + 1] - candidates.cumulative[i];
        const double length = std::max(1e-6, static_cast<double>(candidates.u1[i] - candidates.u0[i]));
        const double parts = std::round(each * std::min(1.0, mass / (candidates.mass() * length)));
        first_[edge] = std::max(first_[edge], static_cast<uint32_t>(std::clamp(parts, 1.0, 65536.0)));
    }
    // All instances of an edge get parts, though few of them may be candidates. If there are too many, edges
    // with instances get fewer parts, or none.
    const std::vector<uint32_t> copies =
        candidates.instance.empty() ? std::vector<uint32_t>(count, 1) : edge_copies(tables, instances, count);
    double copied = 0.0;  // cells of edges with several instances
    for (size_t edge = 0; edge < count; ++edge)
        if (copies[edge] > 1) copied += static_cast<double>(first_[edge]) * copies[edge] * all;
    const double kept = std::min(1.0, std::max(requested, kMostCells) / std::max(1.0, copied));
    // Assign consecutive parts to edges and their instances
    uint32_t next = 0;
    for (size_t edge = 0; edge < count; ++edge) {
        const uint32_t n = first_[edge];
        first_[edge] = next;
        next += copies[edge] > 1 ? static_cast<uint32_t>(kept * n) * copies[edge] : n;
    }
    first_[count] = next;
    moment_.assign(static_cast<size_t>(next) * static_cast<size_t>(all), 0.0f);
    samples_.assign(moment_.size(), 0.0f);
}

int32_t LearnedWeights::parts(int32_t edge, int32_t instance) const {
    const auto e = static_cast<size_t>(edge);
    if (e + 1 >= first_.size()) return 0;
    const int32_t instances = instance < 0 ? 1 : instance_count_[static_cast<size_t>(instance)];
    return static_cast<int32_t>(first_[e + 1] - first_[e]) / instances;
}

int64_t LearnedWeights::cell(int32_t edge, int32_t instance, float u, SegmentCell direction) const {
    const int32_t n = parts(edge, instance);
    if (n == 0) return -1;
    int64_t part = first_[static_cast<size_t>(edge)];
    if (instance >= 0) part += static_cast<int64_t>(instance_number_[static_cast<size_t>(instance)]) * n;
    part += std::clamp(static_cast<int32_t>(u * static_cast<float>(n)), 0, n - 1);
    const int32_t kind = chains_ && direction.chained() ? 1 : 0;
    return (part * (chains_ ? 2 : 1) + kind) * direction_cells_ * direction_cells_ + direction.place();
}

Candidates LearnedWeights::pieces(const Candidates& candidates) const {
    const auto instance = [](const Candidates& c, size_t i) {
        return c.instance.empty() ? -1 : c.instance[i];
    };
    Candidates out = cut(candidates, direction_cells_, chains_, [&](size_t i, std::vector<float>& u) {
        const int32_t n = parts(candidates.edge[i], instance(candidates, i));
        const float low = candidates.u0[i], high = candidates.u1[i], size = static_cast<float>(n);
        u.push_back(low);
        for (int32_t k = 1; k < n; ++k)
            if (const float at = static_cast<float>(k) / size; at > low && at < high) u.push_back(at);
        u.push_back(high);
    });
    // Look up the cell of each segment and guess the size of its samples
    std::vector<int64_t> cells;
    for (size_t i = 0; i < out.edge.size(); ++i) {
        cells.push_back(cell(out.edge[i], instance(out, i), 0.5f * (out.u0[i] + out.u1[i]), out.cell[i]));
        out.unlearned.push_back(out.cumulative[i + 1] - out.cumulative[i]);
    }
    for (int k = 0; k < kGuesses; ++k) out.guess[k] = guess(cells, out.unlearned, k);
    const std::vector<float>& best = out.guess[guess_];
    for (size_t i = 0; i < cells.size(); ++i)
        out.cumulative[i + 1] = out.cumulative[i] + out.unlearned[i] * mixed(mixture_, best[i]);
    return out;
}

std::vector<float> LearnedWeights::guess(const std::vector<int64_t>& cells, const std::vector<double>& masses,
                                         int which) const {
    // Neighbours on the list are neighbours in the picture or about the edge.
    const auto [reach, weight] = kNeighbours[which];
    const auto count = static_cast<int64_t>(cells.size());
    std::vector<double> moments{0.0}, samples{0.0};
    const auto value = [](const std::vector<float>& of, int64_t c) {
        return c < 0 ? 0.0 : static_cast<double>(of[static_cast<size_t>(c)]);
    };
    for (int64_t c : cells) {
        moments.push_back(moments.back() + value(moment_, c));
        samples.push_back(samples.back() + value(samples_, c));
    }
    std::vector<float> out(cells.size());
    // Blend each segment's own mean square with that of its neighbours
    double sum = 0.0, mass = 0.0;
    for (int64_t k = 0; k < count; ++k) {
        const auto i = static_cast<size_t>(k);
        const auto low = static_cast<size_t>(std::max<int64_t>(0, k - reach));
        const auto high = static_cast<size_t>(std::min(count, k + reach + 1));
        const double seen = samples[high] - samples[low];
        out[i] = -1.0f;  // unknown
        if (seen <= 0.0) continue;
        const double around = std::max(0.0, moments[high] - moments[low]) / seen;
        const double square =
            (value(moment_, cells[i]) + weight * around) / (value(samples_, cells[i]) + weight);
        out[i] = static_cast<float>(std::sqrt(square));
        sum += static_cast<double>(out[i]) * masses[i], mass += masses[i];
    }
    // Normalise by the weighted mean
    const auto mean = static_cast<float>(mass > 0.0 ? sum / mass : 0.0);
    for (float& size : out) size = mean > 0.0f && size >= 0.0f ? std::min(size / mean, kLargest) : 1.0f;
    return out;
}

void LearnedWeights::age() {
    for (float& m : moment_) m *= kKept;
    for (float& n : samples_) n *= kKept;
}

void LearnedWeights::learn(const Candidates& segments, const SampleRecord& record, int64_t count,
                           double scale, double total) {
    learned_ = true;
    const double relative = total > 0.0 ? 1.0 / (scale * total) : 0.0;
    const bool guessed = !segments.unlearned.empty();
    // Add the samples to their cells and score each guess
    double square[kGuesses][kMixtures] = {};
    for (int64_t k = 0; k < count; ++k) {
        const auto i = static_cast<size_t>(record.entry[k]);
        const double mass = guessed ? segments.unlearned[i] : segments.segment_mass(i);
        const double size = static_cast<double>(record.contribution[k]) * relative;
        const int64_t at =
            cell(segments.edge[i], segments.instance.empty() ? -1 : segments.instance[i], record.u[k],
                 cell_among(record.cell[k], segments.direction_cells, direction_cells_));
        if (at >= 0) {
            const double each = size * static_cast<double>(record.density[k]) / mass;
            samples_[static_cast<size_t>(at)] += 1.0f;
            moment_[static_cast<size_t>(at)] += static_cast<float>(std::min(each * each, 1e30));
        }
        if (!guessed || size == 0.0) continue;
        // With n samples of density d' instead of d, sum F^2/(d d') estimates the mean square under d'.
        const double now = (segments.cumulative[i + 1] - segments.cumulative[i]) / mass * size * size;
        for (int g = 0; g < kGuesses; ++g)
            for (int m = 0; m < kMixtures; ++m) square[g][m] += now / mixed(m, segments.guess[g][i]);
    }
    if (!guessed) return;
    // Update the mean square of each guess and mixture
    for (int g = 0; g < kGuesses; ++g) {
        for (int m = 0; m < kMixtures; ++m) {
            double all = 0.0;
            for (size_t i = 0; i < segments.unlearned.size(); ++i)
                all += segments.unlearned[i] * mixed(m, segments.guess[g][i]);
            square_[g][m] = kKeptSquare * square_[g][m] + square[g][m] * all / segments.mass();
        }
    }
    // Select the best one
    for (int g = 0; g < kGuesses; ++g)
        for (int m = 0; m < kMixtures; ++m)
            if (square_[g][m] < square_[guess_][mixture_]) guess_ = g, mixture_ = m;
}

}  // namespace edgegrad
