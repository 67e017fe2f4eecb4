#include <algorithm>

#include "engine/terms/boundary_terms.h"
#include "engine/terms/caustic_term.h"
#include "util/parallel.h"

namespace edgegrad {

// The sum has the least variance if the number of samples of each term is proportional to the standard
// deviation of one sample (Neyman 1934). The error of systematic samples falls faster than that of random
// ones, so terms keep somewhat more samples than this rule says.
double guide_second_passes(const BoundaryTerms& terms) {
    constexpr double kLeast = 0.02, kSlack = 2.0;
    std::vector<double> noise;
    double most = 0.0;
    for (const auto& term : terms) {
        SamplePlan& plan = term->plan();
        if (plan.passes() < 2) continue;
        may_cancel();
        plan.guide();
        noise.push_back(plan.noise());
        most = std::max(most, noise.back() / static_cast<double>(plan.total(1)));
    }
    if (!(most > 0.0)) return 0.0;
    double variance = 0.0;
    size_t k = 0;
    for (const auto& term : terms) {
        SamplePlan& plan = term->plan();
        if (plan.passes() < 2) continue;
        const double sample = noise[k++];
        const double needed = sample / static_cast<double>(plan.total(1));
        plan.thin(std::clamp(kSlack * needed / most, std::max(kLeast, least_of_caustics(plan.kind())), 1.0));
        variance += sample * sample / static_cast<double>(plan.total(1));
    }
    return variance;
}

}  // namespace edgegrad
