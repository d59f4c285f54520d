#pragma once

#include <concepts>
#include <string>
#include <string_view>
#include <vector>

#include "base/text.h"

namespace upswing {

/// A column of numbers from a CSV table.
struct CsvColumn {
  std::string name;
  std::vector<double> values;  // one for each row
};

/// Reads the columns called `names` from a CSV text: a line of names, then rows of cells.
///
/// Commas separate the cells; if the line of names has none, semicolons, tabs or blanks do, and a
/// number may have a decimal comma. A cell may be in double quotes. Within the quotes, a separator
/// is part of the text and two quotes stand for one. The reader ignores a byte-order mark, empty
/// lines, comments (lines that begin with #, %, // or ;), and the cells of other columns. A first
/// line such as `sep=;`, which spreadsheets write, names the separator. If the first row has
/// numbers only, the comment before it has the names, as NumPy's savetxt writes them.
///
/// Throws BadInput if a column is missing or named twice, a quote is not closed in its line, or a
/// cell is not a finite number. Also throws it if a row and the line of names differ in their
/// number of cells, or have thousands. Messages begin with `where` (a path) and the line.
std::vector<CsvColumn> ReadCsv(std::string_view text, const std::vector<std::string>& names,
                               const std::string& where);

/// The names of the columns: the cells of the first line that ReadCsv does not ignore. Empty
/// without such a line. Throws BadInput if a quote is not closed, or for thousands of columns.
std::vector<std::string> CsvNames(std::string_view text, const std::string& where);

/// Builder of a CSV text. The cell names of the first row become the first line of the text.
class CsvTable {
 public:
  /// Adds a cell to the row. Names and texts are made Printable and put in quotes if necessary. A
  /// text that a spreadsheet would take for a formula begins with a '. An empty text stands for an
  /// unknown number.
  void Add(std::string_view name, std::string_view text);
  void Add(std::string_view name, double number) { Add(name, FormatNumber(number)); }
  void Add(std::string_view name, std::integral auto number) { Add(name, Concat(number)); }
  /// Ends a row, which must have at least one cell.
  void EndRow();

  std::string text() const { return names_ + rows_; }

 private:
  std::string names_, rows_;
  bool first_ = true;  // whether the current row is the first
};

}  // namespace upswing
