#include "pendulum/control_period.h"

#include <cmath>

#include "base/error.h"
#include "base/text.h"

namespace upswing {

int64_t PeriodsIn(double seconds, double period) { return std::llround(seconds / period); }

void ExpectWholePeriods(const std::string& name, double seconds, double period,
                        const std::string& hint) {
  constexpr double kRounding = 1e-6;  // of a period
  const double periods = seconds / period, below = std::floor(periods);
  if (std::abs(periods - std::round(periods)) <= kRounding) return;
  throw BadInput(Concat(name, ": expected a multiple of ", FormatNumber(period),
                        ", the control period, got \"", FormatNumber(seconds),
                        "\"; the nearest are ", below * period, " and ", (below + 1) * period,
                        hint));
}

double InWholePeriods(const std::string& name, double seconds, double period) {
  constexpr double kRound = 1e-4, kRounding = 1e-6;  // s, of kRound
  const double parts = period / kRound;
  if (std::abs(parts - std::round(parts)) > kRounding) {
    return static_cast<double>(PeriodsIn(seconds, period)) * period;
  }
  ExpectWholePeriods(name, seconds, period);
  return seconds;
}

}  // namespace upswing
