#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "base/sample.h"

/// Statistics over independent runs. Source: Agarwal, Schwarzer, Castro, Courville and Bellemare
/// (2021), "Deep Reinforcement Learning at the Edge of the Statistical Precipice".
/// docs/results/seeds.md has the formulas. A score may be infinite (a run that never solved its
/// task), but not NaN.
namespace upswing {

inline constexpr int64_t kResamples = 10000;  // default limit on bootstrap resamples

/// Scores in groups that a bootstrap resamples separately.
using Strata = std::vector<std::vector<double>>;

/// Number of resamples of a bootstrap: `most`, or fewer in inverse proportion if there are more
/// than 1,000 scores. More scores already give narrow intervals.
int64_t ResamplesOf(int64_t scores, int64_t most = kResamples);

/// An estimated statistic with its 95% interval. There is no interval if a stratum has fewer than
/// two scores or if all resamples agree. The scores then give no information about the error.
struct Estimate {
  double value = 0;
  std::optional<Interval> interval = {};
};

/// Mean of the middle half: of n values without the floor(n/4) smallest and the floor(n/4) largest.
/// It is infinite if the middle half contains an infinite value. `values` must not be empty.
double InterquartileMean(std::vector<double> values);

/// Share of the pairs with x > y, where ties count half: Mann and Whitney's U over the number of
/// pairs. Neither x nor y may be empty.
double ProbabilityOfImprovement(std::span<const double> x, std::span<const double> y);

/// 95% interval of a statistic by the stratified percentile bootstrap (Efron, 1979).
///
/// Each resample draws from each stratum as many scores as it has, with replacement. The statistic
/// gets them sorted. The interval reaches from the 2.5% to the 97.5% quantile of the statistic over
/// ResamplesOf resamples.
///
/// The same scores give the same interval, regardless of their order within a stratum. Returns
/// nothing if a stratum has fewer than two scores, or if the interval has no width.
std::optional<Interval> BootstrapInterval(Strata strata,
                                          const std::function<double(const Strata&)>& statistic,
                                          int64_t resamples = kResamples);

/// 95% score interval of a probability of improvement (Newcombe, 2006, method 5). `estimate` is its
/// value over all pairs of one of `m` runs and one of `n` others.
///
/// The interval contains each probability from which the estimate is at most 1.96 standard
/// deviations away. Unlike the bootstrap interval, it has a width even if all pairs agree.
Interval ImprovementScoreInterval(double estimate, size_t m, size_t n);

/// Interquartile mean over runs.
Estimate EstimateIqm(const std::vector<double>& scores, int64_t resamples = kResamples);

/// Interquartile mean of `x` minus interquartile mean of `y`. All scores must be finite.
Estimate EstimateIqmDifference(const std::vector<double>& x, const std::vector<double>& y);

/// Mean of x[i] - y[i], where both scores are from the same episode. Resamples draw whole pairs, so
/// what an episode does to both scores cancels. Without pairs the value is 0.
Estimate EstimatePairedDifference(std::span<const double> x, std::span<const double> y);

/// Probability that a run of `x` has a higher score than a run of `y`. If the bootstrap interval
/// has no width, the interval is ImprovementScoreInterval.
Estimate EstimateImprovement(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace upswing
