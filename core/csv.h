#pragma once

#include <concepts>
#include <string>
#include <string_view>
#include <vector>

#include "core/text.h"

namespace upswing {

/// A column of numbers from a CSV table.
struct CsvColumn {
  std::string name;
  std::vector<double> values;  // one for each row
};

/// The columns called `names` of a CSV text: a line of names, then rows of cells. A cell may be in
/// double quotes, within which a comma is part of the text and two quotes stand for one. A
/// byte-order mark at the beginning, lines that begin with #, empty lines and the contents of other
/// columns are ignored. Messages begin with `where` (a path) and the line. Throws BadInput if a
/// column is missing, a row has another number of cells than the first line, a quote is not closed
/// in its line, or a cell is not a finite number.
std::vector<CsvColumn> ReadCsv(std::string_view text, const std::vector<std::string>& names,
                               const std::string& where);

/// Builds a CSV text. The names of the first row's cells become its first line.
class CsvTable {
 public:
  /// Adds a cell to the row: a text, Printable and in quotes where a reader needs them, or a
  /// number. A number that is not known is an empty text.
  void Add(std::string_view name, std::string_view text);
  void Add(std::string_view name, double number) { Add(name, FormatNumber(number)); }
  void Add(std::string_view name, std::integral auto number) { Add(name, Concat(number)); }
  /// Ends a row, which has a cell.
  void EndRow();

  std::string text() const { return names_ + rows_; }

 private:
  std::string names_, rows_;
  bool first_ = true;  // row
};

}  // namespace upswing
