#include "boundary/samples/sample_plan.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"
#include "tasks/seed_tags.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace edgegrad {
namespace {

// The weight of the first pass's estimate in the mean. It is small because the error of systematic samples
// falls faster than their number grows (native/TUNING.md).
constexpr float kFirstWeight = 0.04f;
constexpr int64_t kMostShares = int64_t{1} << 20;
// Upper bound of recorded samples per pass; it limits memory.
constexpr int64_t kMostRecords = int64_t{1} << 20;
// Neighbours to each side from which a share's sample size is estimated. More neighbours reduce noise, but
// blur narrow features.
constexpr int64_t kReach = 4;
// Candidate fractions of the second pass that are distributed evenly. They keep shares sampled whose size the
// neighbours underestimate.
constexpr double kAlike[] = {0.2, 0.35, 0.6, 1.0};
// Upper bound of a share's size relative to the mean. It limits the harm of single outliers.
constexpr double kLargest = 16.0;
// The least density of samples on shares of mean size, relative to that of a single pass. A larger value
// takes more samples where they are concentrated on few shares.
constexpr double kDensity = 2.5;

}  // namespace

SamplePlan::SamplePlan(std::shared_ptr<const Candidates> candidates, double requested, double most,
                       const RenderOptions& options, BoundaryKind kind, bool guided, float factor)
    : candidates_(std::move(candidates)), options_(options), kind_(kind), guided_(guided), factor_(factor) {
    const double all = candidates_->size() == 0 ? 0.0 : std::ceil(std::min(requested, most));
    total_[0] = static_cast<int64_t>(all);
    if (!guided_ || total_[0] == 0) return;
    total_[0] = std::min(kMostShares, static_cast<int64_t>(std::ceil(kBoundaryTable[kind].first_pass * all)));
    total_[1] = std::max<int64_t>(1, static_cast<int64_t>(all) - total_[0]);
    score_.assign(static_cast<size_t>(total_[0]), 0.0f);
}

void SamplePlan::guide() {
    // The optimal density of samples is proportional to the root of their mean square. This is estimated from
    // neighbours on the list, which are neighbours in the picture.
    const auto shares = static_cast<int64_t>(score_.size());
    std::vector<double> squares(score_.size() + 1);
    const auto square = [&](int64_t k) {
        return static_cast<double>(score_[static_cast<size_t>(k)]) *
               static_cast<double>(score_[static_cast<size_t>(k)]);
    };
    for (int64_t k = 0; k < shares; ++k)
        squares[static_cast<size_t>(k) + 1] = squares[static_cast<size_t>(k)] + square(k);
    std::vector<double> with(score_.size()),
        without(score_.size());  // with and without the share's own sample
    double mean_with = 0.0, mean_without = 0.0;
    for (int64_t k = 0; k < shares; ++k) {
        const int64_t low = std::max<int64_t>(0, k - kReach), high = std::min(shares, k + kReach + 1);
        const double sum =
            std::max(0.0, squares[static_cast<size_t>(high)] - squares[static_cast<size_t>(low)]);
        const auto n = static_cast<double>(high - low);
        mean_with += with[static_cast<size_t>(k)] = std::sqrt(sum / n);
        mean_without += without[static_cast<size_t>(k)] =
            std::sqrt(std::max(0.0, sum - square(k)) / std::max(1.0, n - 1.0));
    }
    mean_with /= static_cast<double>(shares), mean_without /= static_cast<double>(shares);
    const auto relative = [](double size, double mean) {
        return mean > 0.0 ? std::min(size / mean, kLargest) : 1.0;
    };
    std::vector<double> relative_with(with.size());
    for (size_t i = 0; i < with.size(); ++i) {
        relative_with[i] = relative(with[i], mean_with);
        without[i] = relative(without[i], mean_without);
    }
    // Choose the even fraction by cross-validation. The score is the second moment of the first pass' samples
    // under the guide that their neighbours suggest, times the total of that guide. The inner loop over all
    // fractions vectorises.
    constexpr size_t kParts = std::size(kAlike);
    double moments[kParts] = {}, totals[kParts] = {}, inverses[kParts] = {}, weight = 0.0;
    for (int64_t k = 0; k < shares; ++k) {
        const auto i = static_cast<size_t>(k);
        const double size = square(k), own = without[i], all = with[i], guided = relative_with[i];
        for (size_t j = 0; j < kParts; ++j) {
            const double a = kAlike[j], g = a + (1.0 - a) * own;
            moments[j] += size / g, totals[j] += g;
            inverses[j] += all / (a + (1.0 - a) * guided);
        }
        weight += all;
    }
    double best = 0.0, alike = 1.0, part = 1.0;
    for (size_t j = 0; j < kParts; ++j) {
        const double moment = moments[j] * (totals[j] / static_cast<double>(shares));
        if (best == 0.0 || moment < best) {
            best = moment, alike = kAlike[j];
            part = weight > 0.0 ? std::min(1.0, kDensity * inverses[j] / weight) : 0.1;
        }
    }
    // Build the guide and reduce the number of samples where it concentrates them
    guide_.resize(score_.size() + 1);
    for (size_t k = 0; k < relative_with.size(); ++k)
        guide_[k + 1] = guide_[k] + alike + (1.0 - alike) * relative_with[k];
    total_[1] = std::max<int64_t>(1, static_cast<int64_t>(std::ceil(part * static_cast<double>(total_[1]))));
}

double SamplePlan::noise() const {
    double sum = 0.0;
    for (size_t k = 1; k < score_.size(); ++k) {
        const double step = static_cast<double>(score_[k]) - static_cast<double>(score_[k - 1]);
        sum += 0.5 * step * step;
    }
    return std::sqrt(sum * static_cast<double>(score_.size())) / static_cast<double>(scale(0));
}

void SamplePlan::thin(double part) {
    total_[1] = std::max<int64_t>(1, static_cast<int64_t>(std::ceil(part * static_cast<double>(total_[1]))));
}

BoundaryTask SamplePlan::task(int pass, int64_t first, int64_t count) {
    BoundaryTask t{};
    const Candidates& list = *candidates_;
    t.edge = list.edge.data();
    t.instance = list.instance.empty() ? nullptr : list.instance.data();
    t.u0 = list.u0.data();
    t.u1 = list.u1.data();
    t.cell = list.cell.empty() ? nullptr : list.cell.data();
    t.direction_cells = list.direction_cells;
    t.parts = list.parts.empty() ? nullptr : list.parts.data();
    t.cumulative = list.cumulative.data();
    t.entries = list.size();
    t.first = first;
    t.count = count;
    t.total = total_[pass];
    t.max_depth = options_.max_depth;
    t.seed = options_.seed ^ (pass == 0 ? 0u : kSecondPassSeed);
    t.kind = kind_;
    t.limits = options_.limits;
    t.camera_sampled = options_.camera_sampled_alpha;
    t.guide = pass == 0 ? nullptr : guide_.data();
    t.shares = guided_ ? total_[0] : 1;
    t.scale = scale(pass) * factor_;
    t.score = guided_ && pass == 0 ? score_.data() : nullptr;
    t.record = view(pass);
    return t;
}

float SamplePlan::scale(int pass) const {
    return !guided_ ? 1.0f : pass == 0 ? kFirstWeight : 1.0f - kFirstWeight;
}

SampleRecord SamplePlan::view(int pass) const {
    Record& r = records_[pass];
    if (r.contribution.empty()) return {};
    return {r.shift, r.contribution.data(), r.density.data(), r.u.data(), r.entry.data(), r.cell.data()};
}

void SamplePlan::record() {
    for (int pass = 0; pass < passes(); ++pass) {
        Record& r = records_[pass];
        while ((total_[pass] - 1) >> r.shift >= kMostRecords) ++r.shift;
        const auto count = static_cast<size_t>(((total_[pass] - 1) >> r.shift) + 1);
        r.contribution.assign(count, 0.0f);
        r.density.resize(count), r.u.resize(count), r.entry.resize(count), r.cell.resize(count);
    }
}

void SamplePlan::teach(LearnedWeights& masses) const {
    double total = 0.0;
    for (const Record& r : records_)
        for (float w : r.contribution) total += std::ldexp(static_cast<double>(w), r.shift);
    masses.age();
    for (int pass = 0; pass < passes(); ++pass)
        masses.learn(*candidates_, view(pass), ((total_[pass] - 1) >> records_[pass].shift) + 1,
                     static_cast<double>(scale(pass)), total);
}

}  // namespace edgegrad
