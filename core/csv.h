#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace upswing {

/// A column of numbers from a CSV table.
struct CsvColumn {
  std::string name;
  std::vector<double> values;  // a row each
};

/// The columns called `names` of a CSV text: a line of names, then rows of cells. A cell may stand
/// in double quotes, in which a comma is one of its characters, and a quote where there are two. A
/// byte-order mark at the beginning, lines that begin with # and empty lines are skipped, and so
/// are other columns, whatever is in them. `where` (a path) begins messages, which give the line
/// too. Throws BadInput if a column is missing, a row has another number of cells than the names, a
/// quote is not closed in its line, or a cell is no finite number.
std::vector<CsvColumn> ReadCsv(std::string_view text, const std::vector<std::string>& names,
                               const std::string& where);

}  // namespace upswing
