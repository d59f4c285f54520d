#include "core/csv.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

/// The end of the cell that begins at `line[at]`: a comma outside quotes, or the end of the line.
size_t EndOfCell(std::string_view line, size_t at, const std::string& place) {
  bool quoted = false;
  for (; at < line.size() && (quoted || line[at] != ','); ++at) {
    if (line[at] == '"') quoted = !quoted;  // two quotes in a row change nothing
  }
  if (quoted) throw BadInput(Concat(place, "expected a closing quote, got \"", line, "\""));
  return at;
}

/// The cells of a row, without surrounding blanks and quotes.
std::vector<std::string> CellsOf(std::string_view line, const std::string& place) {
  std::vector<std::string> cells;
  for (size_t begin = 0; begin <= line.size();) {
    const size_t end = EndOfCell(line, begin, place);
    std::string_view cell = Trim(line.substr(begin, end - begin));
    const bool quoted = cell.size() > 1 && cell.front() == '"' && cell.back() == '"';
    if (quoted) cell = cell.substr(1, cell.size() - 2);
    cells.emplace_back();
    for (size_t i = 0; i < cell.size(); ++i) {
      cells.back() += cell[i];
      if (quoted && cell.substr(i, 2) == "\"\"") ++i;
    }
    begin = end + 1;
  }
  return cells;
}

/// Whether the readers ignore this line.
bool IsIgnored(std::string_view line) { return line.empty() || line.starts_with('#'); }

std::string_view WithoutByteOrderMark(std::string_view text) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
  return text;
}

}  // namespace

std::vector<std::string> CsvNames(std::string_view text, const std::string& where) {
  text = WithoutByteOrderMark(text);
  for (int number = 1; !text.empty(); ++number) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = Trim(text.substr(0, end));
    if (!IsIgnored(line)) return CellsOf(line, Concat(where, ":", number, ": "));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return {};
}

std::vector<CsvColumn> ReadCsv(std::string_view text, const std::vector<std::string>& names,
                               const std::string& where) {
  std::vector<CsvColumn> columns;
  columns.reserve(names.size());
  for (const std::string& name : names) columns.push_back({name, {}});
  std::vector<size_t> places;  // indices of the wanted columns in a row
  size_t width = 0;            // number of cells in a row; 0 before the line of names
  int line_number = 0;
  for (const std::string_view line : Split(WithoutByteOrderMark(text), '\n')) {
    ++line_number;
    if (IsIgnored(line)) continue;
    const std::string place = Concat(where, ":", line_number, ": ");
    const std::vector<std::string> cells = CellsOf(line, place);
    if (width == 0) {
      for (const CsvColumn& column : columns) {
        const auto found = std::ranges::find(cells, column.name);
        if (found == cells.end()) {
          throw BadInput(
              Concat(place, "expected a column \"", column.name, "\", got \"", line, "\""));
        }
        const auto times = std::ranges::count(cells, column.name);
        if (times > 1) {
          throw BadInput(
              Concat(place, "expected one column \"", Printable(column.name), "\", got ", times));
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
      const std::string& cell = cells[places[i]];
      const auto number = ParseNumber(cell);
      if (!number || !std::isfinite(*number)) {
        throw BadInput(
            Concat(place, columns[i].name, ": expected a finite number, got \"", cell, "\""));
      }
      columns[i].values.push_back(*number);
    }
  }
  return columns;
}

void CsvTable::Add(std::string_view name, std::string_view given) {
  if (first_) names_ += Concat(name, ',');
  const std::string text = Printable(given);  // keeps the row on one line
  if (text.find_first_of(",\"") == text.npos) {
    rows_ += Concat(text, ',');
    return;
  }
  rows_ += '"';
  for (const char c : text) rows_ += c == '"' ? "\"\"" : std::string(1, c);
  rows_ += "\",";
}

void CsvTable::EndRow() {
  if (first_) names_.back() = '\n';
  rows_.back() = '\n';
  first_ = false;
}

}  // namespace upswing
