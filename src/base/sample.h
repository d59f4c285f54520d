#pragma once

#include <cstdint>
#include <span>
#include <vector>

/// Descriptive statistics of a sample of numbers.
namespace upswing {

/// Quartiles of a sample.
struct Quartiles {
  double low = 0, median = 0, high = 0;
};

/// The quantile at `share` of a sorted sample that is not empty, by linear interpolation between
/// order statistics. Infinite values are allowed.
double Quantile(std::span<const double> sorted, double share);

/// Quartiles of a sample; zeros if it is empty.
Quartiles QuartilesOf(std::vector<double> values);

/// A closed interval.
struct Interval {
  double low = 0, high = 1;
};

/// 95% confidence interval of a proportion (Wilson, 1927) after `successes` of `trials`; [0, 1]
/// without trials.
Interval WilsonInterval(int64_t successes, int64_t trials);

/// Mean and sample standard deviation.
struct Moments {
  double mean = 0, deviation = 0;
};
/// Moments of a sample; zeros if it is empty.
Moments MomentsOf(std::span<const double> values);

}  // namespace upswing
