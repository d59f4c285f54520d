#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/sample.h"

/// Figures over independent runs, as Agarwal, Schwarzer, Castro, Courville and Bellemare (2021),
/// "Deep Reinforcement Learning at the Edge of the Statistical Precipice", recommend them.
/// docs/howto/compare.md has the formulas. A score may be infinite (a run that never solved its
/// task), but not NaN.
namespace upswing {

inline constexpr int64_t kResamples = 10000;  // of a bootstrap interval, at most

/// Scores of one agent: for each task, which is a stratum, the scores of its runs.
using Strata = std::vector<std::vector<double>>;

/// How many resamples a bootstrap takes: `most`, or fewer in inverse proportion where there are
/// more than 1,000 scores, whose intervals are narrow.
int64_t ResamplesOf(const Strata& strata, int64_t most = kResamples);

/// A figure with its 95% interval; none if a stratum has less than two runs, or if all resamples
/// agree, as the runs then give no information about the error.
struct Estimate {
  double value = 0;
  std::optional<Interval> interval = {};
};

/// Mean of the middle half: of n values without the floor(n/4) smallest and largest ones. Infinite
/// if an infinite value is among them. `values` is not empty.
double InterquartileMean(std::vector<double> values);

/// Share of the pairs with x > y, ties as half (Mann and Whitney's U over the number of pairs).
/// Neither is empty.
double ProbabilityOfImprovement(std::span<const double> x, std::span<const double> y);

/// 95% interval of a statistic by the stratified percentile bootstrap (Efron, 1979): each resample
/// draws as many scores from each stratum as it has, with replacement, and the interval reaches
/// from the 2.5% to the 97.5% quantile of the statistic over ResamplesOf resamples, which it gets
/// sorted. The same scores give
/// the same interval, regardless of their order within a stratum. Nothing if a stratum has less
/// than two, or if the interval would have no width.
std::optional<Interval> BootstrapInterval(Strata strata,
                                          const std::function<double(const Strata&)>& statistic,
                                          int64_t resamples = kResamples);

/// 95% score interval of a probability of improvement (Newcombe, 2006, method 5) that is `estimate`
/// over all pairs of a run of x and one of y; tasks are strata. Unlike the bootstrap's it has a
/// width where all pairs agree, too: it holds each probability for which the estimate would not be
/// farther off than 1.96 standard deviations.
Interval ImprovementScoreInterval(double estimate, const Strata& x, const Strata& y);

/// Interquartile mean over the runs of all tasks.
Estimate EstimateIqm(const Strata& scores, int64_t resamples = kResamples);

/// Interquartile mean of `x` minus that of `y`; scores are finite.
Estimate EstimateIqmDifference(const Strata& x, const Strata& y, int64_t resamples = kResamples);

/// Probability that a run of `x` has the higher score than one of `y` on the same task, as a mean
/// over the tasks. Where the bootstrap's interval would have no width it is
/// ImprovementScoreInterval.
Estimate EstimateImprovement(const Strata& x, const Strata& y, int64_t resamples = kResamples);

}  // namespace upswing
