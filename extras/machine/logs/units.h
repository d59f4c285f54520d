#pragma once

#include <string>
#include <string_view>

/// Units of the columns of a log. Quantities are "time", "angle", "velocity" and "torque".
namespace upswing::machine {

/// A unit by its name.
struct ColumnUnit {
  std::string name;
  double scale = 1;  // SI units in it
};

/// The SI unit of a quantity.
ColumnUnit SiUnit(std::string_view quantity);

/// The unit of a quantity with this name. Throws BadInput, which begins with `place`, if there is
/// none.
ColumnUnit UnitNamed(const std::string& name, std::string_view quantity, const std::string& place);

/// The unit that the end of a column's name states, such as `q1 [deg]`, `q1 (deg)` or `time_ms`;
/// the SI unit if it states none. Throws BadInput if brackets have another text than a unit or an
/// index, and if the name has another word for a unit, such as `u_oz-in` or `angleDegrees`.
ColumnUnit UnitInName(const std::string& column, std::string_view quantity,
                      const std::string& place);

}  // namespace upswing::machine
