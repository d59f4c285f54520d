#include "report/statistics.h"

#include <algorithm>
#include <numeric>

#include "base/rng.h"

namespace upswing {
namespace {

/// Scores of all tasks together.
std::vector<double> Pooled(std::span<const std::vector<double>> strata) {
  std::vector<double> pooled;
  for (const std::vector<double>& stratum : strata) {
    pooled.insert(pooled.end(), stratum.begin(), stratum.end());
  }
  return pooled;
}

constexpr double kZ95 = 1.959963984540054;  // 97.5% quantile of the standard normal

/// Variance of the mean of U / (m n) over the tasks, if the probability is p on each task. This is
/// the variance of Hanley and McNeil (1982) for exponentially distributed scores. (m + n) / 2 - 1
/// replaces both m - 1 and n - 1 (Newcombe, 2006).
double ImprovementVariance(double p, const Strata& x, const Strata& y) {
  double sum = 0;
  for (size_t task = 0; task < x.size(); ++task) {
    const auto m = static_cast<double>(x[task].size());
    const auto n = static_cast<double>(y[task].size());
    const double others = (m + n) / 2 - 1;
    sum += p * (1 - p) * (1 + others * ((1 - p) / (2 - p) + p / (1 + p))) / (m * n);
  }
  const auto tasks = static_cast<double>(x.size());
  return sum / (tasks * tasks);
}

/// Estimates a statistic of two agents. The resamples of their strata are independent.
Estimate EstimateOfTwo(const Strata& x, const Strata& y,
                       const std::function<double(std::span<const std::vector<double>>,
                                                  std::span<const std::vector<double>>)>& figure,
                       int64_t resamples) {
  Strata both = x;
  both.insert(both.end(), y.begin(), y.end());
  const auto statistic = [&](const Strata& strata) {
    const std::span<const std::vector<double>> all = strata;
    return figure(all.first(x.size()), all.subspan(x.size()));
  };
  return {statistic(both), BootstrapInterval(both, statistic, resamples)};
}

/// Draws as many scores as `sorted` has, with replacement, and keeps them sorted.
void Resample(const std::vector<double>& sorted, Rng& rng, std::vector<double>& drawn) {
  std::vector<uint32_t> times(sorted.size());
  for (size_t k = 0; k < sorted.size(); ++k) ++times[rng.Below(sorted.size())];
  // Most scores are drawn at most four times. Always write four copies, because a branch would be
  // unpredictable. Later scores overwrite surplus copies, and the end is cut off.
  constexpr size_t kUsual = 4;
  drawn.resize(sorted.size() + kUsual);
  size_t next = 0;
  for (size_t i = 0; i < sorted.size(); ++i) {
    std::fill_n(drawn.begin() + static_cast<ptrdiff_t>(next), kUsual, sorted[i]);
    for (size_t k = kUsual; k < times[i]; ++k) drawn[next + k] = sorted[i];
    next += times[i];
  }
  drawn.resize(sorted.size());
}

void SortUnlessSorted(std::vector<double>& values) {
  if (!std::ranges::is_sorted(values)) std::ranges::sort(values);
}

std::vector<double> Sorted(std::span<const double> values) {
  std::vector<double> sorted(values.begin(), values.end());
  SortUnlessSorted(sorted);
  return sorted;
}

}  // namespace

int64_t ResamplesOf(const Strata& strata, int64_t most) {
  constexpr int64_t kMany = 1000;
  int64_t scores = 0;
  for (const std::vector<double>& stratum : strata) scores += std::ssize(stratum);
  return most * kMany / std::max(kMany, scores);
}

double InterquartileMean(std::vector<double> values) {
  SortUnlessSorted(values);
  const size_t cut = values.size() / 4;
  const std::span middle = std::span(values).subspan(cut, values.size() - 2 * cut);
  return std::accumulate(middle.begin(), middle.end(), 0.0) / static_cast<double>(middle.size());
}

double ProbabilityOfImprovement(std::span<const double> x, std::span<const double> y) {
  const std::vector<double> as = Sorted(x), bs = Sorted(y);
  double u = 0;
  // Ends of the scores below a, and of the scores not above a.
  auto lower = bs.begin(), not_higher = bs.begin();
  for (const double a : as) {
    while (lower != bs.end() && *lower < a) ++lower;
    while (not_higher != bs.end() && *not_higher <= a) ++not_higher;
    u += static_cast<double>(lower - bs.begin()) + 0.5 * static_cast<double>(not_higher - lower);
  }
  return u / (static_cast<double>(x.size()) * static_cast<double>(y.size()));
}

std::optional<Interval> BootstrapInterval(Strata strata,
                                          const std::function<double(const Strata&)>& statistic,
                                          int64_t resamples) {
  for (std::vector<double>& stratum : strata) {
    if (stratum.size() < 2) return std::nullopt;
    std::ranges::sort(stratum);
  }
  Rng rng(0, "bootstrap");
  Strata resample = strata;
  std::vector<double> values(static_cast<size_t>(ResamplesOf(strata, resamples)));
  for (double& value : values) {
    for (size_t s = 0; s < strata.size(); ++s) Resample(strata[s], rng, resample[s]);
    value = statistic(resample);
  }
  std::ranges::sort(values);
  const Interval interval{Quantile(values, 0.025), Quantile(values, 0.975)};
  if (interval.low == interval.high) return std::nullopt;
  return interval;
}

Interval ImprovementScoreInterval(double estimate, const Strata& x, const Strata& y) {
  const auto inside = [&](double p) {
    const double off = estimate - p;
    return off * off <= kZ95 * kZ95 * ImprovementVariance(p, x, y);
  };
  // The last p inside the interval on the way from the estimate to `end`, by bisection to the last
  // digit.
  const auto farthest = [&](double end) {
    double in = estimate, out = end;
    for (int i = 0; i < 60; ++i) {
      const double middle = (in + out) / 2;
      (inside(middle) ? in : out) = middle;
    }
    return in;
  };
  return {farthest(0), farthest(1)};
}

Estimate EstimateIqm(const Strata& scores, int64_t resamples) {
  const auto iqm = [](const Strata& strata) { return InterquartileMean(Pooled(strata)); };
  return {iqm(scores), BootstrapInterval(scores, iqm, resamples)};
}

Estimate EstimateIqmDifference(const Strata& x, const Strata& y, int64_t resamples) {
  const auto difference = [](auto a, auto b) {
    return InterquartileMean(Pooled(a)) - InterquartileMean(Pooled(b));
  };
  return EstimateOfTwo(x, y, difference, resamples);
}

Estimate EstimateImprovement(const Strata& x, const Strata& y, int64_t resamples) {
  const auto mean_probability = [](auto a, auto b) {
    double sum = 0;
    for (size_t task = 0; task < a.size(); ++task) {
      sum += ProbabilityOfImprovement(a[task], b[task]);
    }
    return sum / static_cast<double>(a.size());
  };
  Estimate e = EstimateOfTwo(x, y, mean_probability, resamples);
  const auto repeated = [](const std::vector<double>& runs) { return runs.size() > 1; };
  if (!e.interval && std::ranges::all_of(x, repeated) && std::ranges::all_of(y, repeated)) {
    e.interval = ImprovementScoreInterval(e.value, x, y);
  }
  return e;
}

}  // namespace upswing
