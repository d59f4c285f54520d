#include "core/csv.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"

namespace upswing {

std::vector<CsvColumn> ReadCsv(std::string_view text, const std::vector<std::string>& names,
                               const std::string& where) {
  std::vector<CsvColumn> columns;
  for (const std::string& name : names) columns.push_back({name, {}});
  std::vector<size_t> places;  // of the wanted columns in a row
  size_t width = 0;            // cells of a row; 0: the line of names is yet to come
  int line_number = 0;
  for (const std::string_view line : Split(text, '\n')) {
    ++line_number;
    if (line.empty() || line.starts_with('#')) continue;
    const std::vector<std::string_view> cells = Split(line, ',');
    const std::string place = Concat(where, ":", line_number, ": ");
    if (width == 0) {
      for (const std::string& name : names) {
        const auto found = std::ranges::find(cells, name);
        if (found == cells.end()) {
          throw BadInput(Concat(place, "expected a column \"", name, "\", got \"", line, "\""));
        }
        places.push_back(static_cast<size_t>(found - cells.begin()));
      }
      width = cells.size();
      continue;
    }
    if (cells.size() != width) {
      throw BadInput(Concat(place, "expected ", width, " columns, got ", cells.size()));
    }
    for (size_t i = 0; i < places.size(); ++i) {
      const std::string_view cell = cells[places[i]];
      const auto number = ParseNumber(cell);
      if (!number || !std::isfinite(*number)) {
        throw BadInput(Concat(place, names[i], ": expected a finite number, got \"", cell, "\""));
      }
      columns[i].values.push_back(*number);
    }
  }
  return columns;
}

}  // namespace upswing
