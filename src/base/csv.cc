#include "base/csv.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.h"

namespace upswing {
namespace {

constexpr size_t kMostColumns = 4096;

/// A line of a table. The error begins with the line's place.
struct Line {
  std::string_view text;
  const std::string* where;
  int number;
  char separator;            // of the cells; ' ': any number of blanks
  std::string_view comment;  // the last one before the line

  Error Bad(std::string_view what) const {
    return BadInput(Concat(*where, ":", number, ": ", what));
  }
};

/// The end of the cell that begins at `at`: a separator outside quotes, or the end of the line.
size_t EndOfCell(const Line& line, size_t at) {
  bool quoted = false;
  for (; at < line.text.size() && (quoted || line.text[at] != line.separator); ++at) {
    if (line.text[at] == '"') quoted = !quoted;  // two quotes in a row change nothing
  }
  if (quoted) throw line.Bad(Concat("expected a closing quote, got \"", line.text, "\""));
  return at;
}

/// Replaces `cells` by the cells of a row, without surrounding blanks. They are views, because a
/// string for each cell would take many times the memory of the file.
void FindCells(const Line& line, std::vector<std::string_view>& cells) {
  cells.clear();
  for (size_t begin = 0; begin <= line.text.size();) {
    if (cells.size() == kMostColumns) {
      throw line.Bad(Concat("expected at most ", kMostColumns, " columns, got more"));
    }
    const size_t end = EndOfCell(line, begin);
    cells.push_back(Trim(line.text.substr(begin, end - begin)));
    begin = end + 1;
    while (line.separator == ' ' && begin < line.text.size() && line.text[begin] == ' ') ++begin;
  }
}

bool IsQuoted(std::string_view cell) {
  return cell.size() > 1 && cell.front() == '"' && cell.back() == '"';
}

std::string_view WithoutQuotes(std::string_view cell) {
  return IsQuoted(cell) ? cell.substr(1, cell.size() - 2) : cell;
}

/// The text that a cell stands for.
std::string TextOf(std::string_view cell) {
  const std::string text(WithoutQuotes(cell));
  return IsQuoted(cell) ? Replaced(text, "\"\"", "\"") : text;
}

/// Moves to the next line that the readers do not ignore, and takes it from `rest`; false if there
/// is none.
bool FindLine(std::string_view& rest, Line& line) {
  while (!rest.empty()) {
    line.text = TakeLine(rest);
    ++line.number;
    const bool is_comment = line.text.starts_with('#') || line.text.starts_with('%') ||
                            line.text.starts_with("//") ||
                            (line.text.starts_with(';') && line.separator != ';');
    if (!line.text.empty() && !is_comment) return true;
    if (is_comment) line.comment = line.text;
  }
  return false;
}

/// Sets the separator of a line of names.
void FindSeparator(Line& line) {
  for (const char separator : {',', ';', '\t', ' '}) {
    line.separator = separator;
    if (EndOfCell(line, 0) < line.text.size()) return;
  }
  line.separator = ',';
}

/// Moves from the first row of a table without names back to the comment before it, if that has a
/// name for each cell: NumPy's savetxt writes names so.
void TakeNamesOfComment(std::string_view& rest, Line& line) {
  const size_t begin = line.comment.find_first_not_of("#%/;");
  if (begin == line.comment.npos) return;
  std::vector<std::string_view> cells;
  FindCells(line, cells);
  const size_t width = cells.size();
  const auto is_number = [](std::string_view cell) { return ParseNumber(cell).has_value(); };
  if (!std::ranges::all_of(cells, is_number)) return;
  Line names = line;
  names.text = Trim(line.comment.substr(begin));
  FindSeparator(names);
  FindCells(names, cells);
  if (cells.size() != width || std::ranges::any_of(cells, is_number)) return;
  rest = {line.text.data(), rest.data() + rest.size()};
  line = names;
  --line.number;
}

/// Moves to the line of names and sets the separator; false if there is none. Skips a byte-order
/// mark. The line `sep=;` of spreadsheets names the separator.
bool FindNames(std::string_view& rest, Line& line) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  if (rest.starts_with("\xff\xfe") || rest.starts_with("\xfe\xff")) {
    throw BadInput(Concat(*line.where, ": expected text in UTF-8, got UTF-16: save it as UTF-8"));
  }
  if (rest.starts_with("PK") || rest.substr(0, 4096).find('\0') != rest.npos) {
    throw BadInput(Concat(*line.where, ": expected a CSV text, got ",
                          rest.starts_with("PK") ? "a zip archive or spreadsheet" : "binary data",
                          ": export it as CSV"));
  }
  if (rest.starts_with(kMark)) rest.remove_prefix(kMark.size());
  if (!FindLine(rest, line)) return false;
  if (line.text.starts_with("sep=") && line.text.size() <= 5) {
    line.separator = line.text.size() == 5 ? line.text.back() : '\t';  // TakeLine trims a tab
    return FindLine(rest, line);
  }
  FindSeparator(line);
  TakeNamesOfComment(rest, line);
  return true;
}

/// The number in a cell. Where commas do not separate cells, one may stand before the decimals.
std::optional<double> NumberIn(std::string_view cell, const Line& line) {
  const bool has_comma = line.separator != ',' && cell.find(',') != cell.npos;
  const auto number = ParseNumber(has_comma ? Replaced(cell, ",", ".") : cell);
  return number && std::isfinite(*number) ? number : std::nullopt;
}

/// What a reader may do about a cell of the column `name` that is no number.
std::string HintFor(std::string_view cell, std::string_view name) {
  if (cell == name) return ": the names again; split the file here";
  const auto number = ParseNumber(cell);
  if (cell.empty() || (number && !std::isfinite(*number))) {
    return ": a missing value; remove or fill its row";
  }
  const bool has_digit = std::ranges::any_of(cell, [](char c) { return c >= '0' && c <= '9'; });
  if (!has_digit) return ": if the line has units or a summary, put # before it";
  std::string digits(cell);
  for (const char* separator : {",", ".", " ", "'", "_"}) digits = Replaced(digits, separator, "");
  return ParseNumber(digits) ? ": remove separators of thousands" : "";
}

/// What may be wrong with a line of names that lacks a column.
std::string NamesHint(const std::vector<std::string_view>& cells, std::string_view line) {
  if (std::ranges::any_of(cells, [](auto cell) { return ParseNumber(cell).has_value(); })) {
    return ": the first line needs the names";
  }
  const bool other = cells.size() == 1 && line.find('|') != line.npos;
  return other ? ": separate cells by commas, semicolons or tabs" : "";
}

/// `"NAME" in ` for the cell that may be the name of a missing column; empty if there is none. The
/// cells of the `wanted` columns are not.
std::string SimilarIn(const std::vector<std::string_view>& cells, const std::string& missing,
                      const std::vector<std::string>& wanted) {
  for (const std::string_view cell : cells) {
    const std::string name = TextOf(cell);
    if (cells.size() == 1 || std::ranges::count(wanted, name) > 0) continue;
    if (!DidYouMean(name, {missing}).empty()) return Concat("\"", name, "\" in ");
  }
  return "";
}

/// A text that a spreadsheet takes for no formula, also where it separates cells by semicolons: a '
/// stands before =, +, - and @.
std::string NoFormula(const std::string& text) {
  std::string safe;
  bool begins = true;  // a cell; blanks before its text do not count
  for (const char c : text) {
    if (begins && std::string_view("=+-@").find(c) != std::string_view::npos) safe += '\'';
    begins = c == ';' || (begins && c == ' ');
    safe += c;
  }
  return safe;
}

/// A text as a cell: Printable, which keeps the row on one line, without a formula, and in quotes
/// if necessary.
std::string CellOf(std::string_view given) {
  std::string text = Printable(given);
  if (!ParseNumber(text)) text = NoFormula(text);
  if (text.find_first_of(",\"") == text.npos) return text;
  return Concat("\"", Replaced(text, "\"", "\"\""), "\"");
}

}  // namespace

std::vector<std::string> CsvNames(std::string_view text, const std::string& where) {
  Line line{{}, &where, 0, ',', {}};
  std::vector<std::string_view> cells;
  if (FindNames(text, line)) FindCells(line, cells);
  std::vector<std::string> names;
  for (const std::string_view cell : cells) names.push_back(TextOf(cell));
  return names;
}

std::vector<CsvColumn> ReadCsv(std::string_view text, const std::vector<std::string>& names,
                               const std::string& where) {
  std::vector<CsvColumn> columns;
  for (const std::string& name : names) columns.push_back({name, {}});
  Line line{{}, &where, 0, ',', {}};
  std::vector<std::string_view> cells;
  if (!FindNames(text, line)) return columns;
  FindCells(line, cells);
  const size_t width = cells.size();
  std::vector<size_t> places;  // indices of the wanted columns in a row
  for (const std::string& name : names) {
    const auto found = std::ranges::find(cells, name, TextOf);
    if (found == cells.end()) {
      const std::string hint = NamesHint(cells, line.text);
      throw line.Bad(Concat("expected a column \"", name, "\", got ",
                            hint.empty() ? SimilarIn(cells, name, names) : "", "\"",
                            line.text.substr(0, 200), "\"", hint));
    }
    const auto times = std::ranges::count(cells, name, TextOf);
    if (times > 1) {
      throw line.Bad(Concat("expected one column \"", Printable(name), "\", got ", times));
    }
    places.push_back(static_cast<size_t>(found - cells.begin()));
  }
  const bool torn = !text.ends_with('\n');
  const auto cut_off = [&] { return text.empty() && torn; };
  constexpr const char* kCutOff = ": the last line is cut off; remove it";
  while (FindLine(text, line)) {
    FindCells(line, cells);
    if (cells.size() != width) {
      throw line.Bad(
          Concat("expected ", width, " columns, got ", cells.size(), cut_off() ? kCutOff : ""));
    }
    for (size_t i = 0; i < places.size(); ++i) {
      const std::string_view cell = WithoutQuotes(cells[places[i]]);
      const auto number = NumberIn(cell, line);
      if (!number) {
        throw line.Bad(Concat(names[i], ": expected a finite number, got \"", Printable(cell), "\"",
                              cut_off() ? kCutOff : HintFor(cell, names[i])));
      }
      columns[i].values.push_back(*number);
    }
  }
  return columns;
}

void CsvTable::Add(std::string_view name, std::string_view text) {
  if (first_) names_ += CellOf(name) + ',';
  rows_ += CellOf(text) + ',';
}

void CsvTable::EndRow() {
  if (first_) names_.back() = '\n';
  rows_.back() = '\n';
  first_ = false;
}

}  // namespace upswing
