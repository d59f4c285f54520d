// Target: a table of torques, which `simulate --torque` reads.
#include <algorithm>
#include <cmath>

#include "base/csv.h"
#include "tools/fuzz/target.h"

namespace upswing {

bool TryInput(std::string_view input) {
  std::vector<CsvColumn> columns;
  if (!Accepts([&] { columns = ReadCsv(input, {"torque"}, kInputName); })) return false;
  Expect(std::ranges::all_of(columns.at(0).values, [](double x) { return std::isfinite(x); }),
         "finite torques");
  return true;
}

}  // namespace upswing
