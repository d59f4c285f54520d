// Target: a machine's log, as gzip or text. A line === ends a TOML text that names its columns.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "extras/machine/logs/check.h"
#include "os/gzip.h"
#include "tools/fuzz/target.h"

namespace upswing {

using namespace machine;

namespace {

constexpr std::string_view kEndOfColumns = "\n===\n";
constexpr size_t kMostBytes = 1 << 20;  // larger texts only take longer

std::vector<MachineLog> Parse(std::string_view input) {
  const std::string text =
      IsGzip(input) ? Gunzip(input, kInputName, kMostBytes) : std::string(input);
  const size_t end = text.find(kEndOfColumns);
  if (end == text.npos) return ParseLog(text, nullptr, kInputName);
  const LogColumns columns = ParseLogColumns(text.substr(0, end), kInputName);
  return ParseLog(std::string_view(text).substr(end + kEndOfColumns.size()), &columns, kInputName);
}

bool IsFinite(const std::vector<Joints>& values) {
  return std::ranges::all_of(
      values, [](const Joints& x) { return std::isfinite(x[0]) && std::isfinite(x[1]); });
}

}  // namespace

bool TryInput(std::string_view input) {
  std::vector<MachineLog> pieces;
  if (!Accepts([&] { pieces = Parse(input); })) return false;
  int rows = 0;
  for (const MachineLog& piece : pieces) {
    Expect(piece.first_row == rows + 1 && piece.rows() >= 2, "pieces in a row");
    rows += piece.rows();
    Expect(std::ranges::is_sorted(piece.time), "a clock that does not go back");
    for (const auto* values :
         {&piece.angle, &piece.velocity, &piece.commanded, &piece.measured, &piece.push}) {
      Expect(IsFinite(*values) && (values->empty() || values->size() == piece.time.size()),
             "finite numbers, one for each row");
    }
  }
  const LogCheck check = CheckLog(kInputName, pieces);
  for (const Finding& finding : check.findings) {
    if (!finding.rows) continue;
    Expect(finding.rows->first >= 1 && finding.rows->last <= rows &&
               finding.rows->first <= finding.rows->last,
           "rows of the file");
  }
  Expect(!CheckJson(std::span(&check, 1)).empty(), "a description");
  return true;
}

}  // namespace upswing
