#include "report/statistics.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <numeric>

#include "base/rng.h"

namespace upswing {
namespace {

constexpr double kZ95 = 1.959963984540054;  // 97.5% quantile of the standard normal

/// Variance of U / (m n) if the probability is p: that of Hanley and McNeil (1982) for
/// exponentially distributed scores. (m + n) / 2 - 1 replaces both m - 1 and n - 1 (Newcombe,
/// 2006).
double ImprovementVariance(double p, double m, double n) {
  const double others = (m + n) / 2 - 1;
  return p * (1 - p) * (1 + others * ((1 - p) / (2 - p) + p / (1 + p))) / (m * n);
}

/// Draws as many scores as `sorted` has, with replacement, and keeps them sorted.
void Resample(const std::vector<double>& sorted, Rng& rng, std::vector<double>& drawn) {
  std::vector<uint32_t> times(sorted.size());
  for (size_t k = 0; k < sorted.size(); ++k) ++times[rng.Below(sorted.size())];
  drawn.clear();
  for (size_t i = 0; i < sorted.size(); ++i) drawn.insert(drawn.end(), times[i], sorted[i]);
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

int64_t ResamplesOf(int64_t scores, int64_t most) {
  constexpr int64_t kMany = 1000;
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
  int64_t scores = 0;
  for (std::vector<double>& stratum : strata) {
    if (stratum.size() < 2) return std::nullopt;
    std::ranges::sort(stratum);
    scores += std::ssize(stratum);
  }
  Rng rng(0, "bootstrap");
  Strata resample = strata;
  std::vector<double> values(static_cast<size_t>(ResamplesOf(scores, resamples)));
  for (double& value : values) {
    for (size_t s = 0; s < strata.size(); ++s) Resample(strata[s], rng, resample[s]);
    value = statistic(resample);
  }
  std::ranges::sort(values);
  const Interval interval{Quantile(values, 0.025), Quantile(values, 0.975)};
  if (interval.low == interval.high) return std::nullopt;
  return interval;
}

Interval ImprovementScoreInterval(double estimate, size_t m, size_t n) {
  const auto inside = [&](double p) {
    const double off = estimate - p;
    const double variance = ImprovementVariance(p, static_cast<double>(m), static_cast<double>(n));
    return off * off <= kZ95 * kZ95 * variance;
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

Estimate EstimateIqm(const std::vector<double>& scores, int64_t resamples) {
  const auto iqm = [](const Strata& s) { return InterquartileMean(s[0]); };
  return {InterquartileMean(scores), BootstrapInterval({scores}, iqm, resamples)};
}

Estimate EstimateIqmDifference(const std::vector<double>& x, const std::vector<double>& y) {
  const auto difference = [](const Strata& s) {
    return InterquartileMean(s[0]) - InterquartileMean(s[1]);
  };
  return {difference({x, y}), BootstrapInterval({x, y}, difference)};
}

Estimate EstimatePairedDifference(std::span<const double> x, std::span<const double> y) {
  std::vector<double> differences;
  std::ranges::transform(x, y, std::back_inserter(differences), std::minus<>());
  const auto mean = [](const Strata& s) { return MomentsOf(s[0]).mean; };
  return {mean({differences}), BootstrapInterval({differences}, mean)};
}

Estimate EstimateImprovement(const std::vector<double>& x, const std::vector<double>& y) {
  const auto probability = [](const Strata& s) { return ProbabilityOfImprovement(s[0], s[1]); };
  Estimate e{probability({x, y}), BootstrapInterval({x, y}, probability)};
  if (!e.interval && x.size() > 1 && y.size() > 1) {
    e.interval = ImprovementScoreInterval(e.value, x.size(), y.size());
  }
  return e;
}

}  // namespace upswing
