#pragma once

#include <cstdint>
#include <string>

namespace upswing {

/// Number of control periods of `period` seconds in `seconds`, rounded to the nearest.
int64_t PeriodsIn(double seconds, double period);

/// Throws BadInput, with a message that begins with `name`, unless `seconds` is a whole number of
/// control periods of `period` seconds, up to rounding. `hint` ends the message.
void ExpectWholePeriods(const std::string& name, double seconds, double period,
                        const std::string& hint = "");

/// A length in whole control periods (s). Periods of plants of another size are no round numbers,
/// so no round length is a multiple of theirs: it becomes the nearest one. Of other periods, throws
/// as ExpectWholePeriods does.
double InWholePeriods(const std::string& name, double seconds, double period);

}  // namespace upswing
