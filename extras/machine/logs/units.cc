#include "extras/machine/logs/units.h"

#include <algorithm>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"

namespace upswing::machine {
namespace {

/// A unit that a column may have.
struct LogUnit {
  const char* name;
  const char* quantity;
  double scale;  // SI units in it
};
constexpr double kTurn = 2 * std::numbers::pi;
constexpr LogUnit kUnits[] = {{"s", "time", 1},
                              {"ms", "time", 1e-3},
                              {"us", "time", 1e-6},
                              {"ns", "time", 1e-9},
                              {"rad", "angle", 1},
                              {"deg", "angle", kTurn / 360},
                              {"turn", "angle", kTurn},
                              {"rad/s", "velocity", 1},
                              {"deg/s", "velocity", kTurn / 360},
                              {"turn/s", "velocity", kTurn},
                              {"rpm", "velocity", kTurn / 60},
                              {"Nm", "torque", 1},
                              {"N·m", "torque", 1},
                              {"mNm", "torque", 1e-3},
                              {"mN·m", "torque", 1e-3}};

/// Words for units at the end of names, as Normalized gives them. A text has words with blanks
/// between.
using Words = std::span<const char* const>;
constexpr const char* kTimeSi[] = {"s sec secs second seconds"};
constexpr const char* kTimeOthers[] = {
    "ms msec msecs millis millisec millisecond milliseconds",
    "us usec usecs micros microsec microsecond microseconds",
    "ns nsec nsecs nanos nanosecond nanoseconds", "min mins minute minutes hr hrs hour hours day",
    "days tick ticks count counts cycles sample samples frame frames hz"};
constexpr const char* kTimeCertain[] = {"ms msec millis milliseconds us usec micros microseconds",
                                        "ns nsec nsecs nanos nanoseconds ticks"};
constexpr const char* kAngleSi[] = {"rad rads radian radians"};
constexpr const char* kAngleOthers[] = {
    "deg degs degree degrees mdeg millideg millidegrees rad/s deg/s rpm",
    "mrad mrads millirad urad microrad grad grads gon arcmin arcsec mm cm",
    "turn turns rev revs revolution revolutions rotations",
    "count counts cnt cnts tick ticks pulse pulses cpr ppr lsb steps qc quadcounts increments bits",
    "pct percent % volt volts mv"};
constexpr const char* kAngleCertain[] = {"deg degs degree degrees mrad counts ticks"};
constexpr const char* kVelocitySi[] = {"rad/s rads rad/sec rad/second radian/s radians/s",
                                       "radians/sec radians/second radps radpersec radpersecond"};
constexpr const char* kVelocityOthers[] = {
    "rad radian radians deg degs degree degrees mrad/s urad/s mdeg/s rad/min deg/min",
    "deg/s deg/sec deg/second degree/s degrees/s degrees/sec degrees/second degps dps",
    "degpersec degpersecond turn turns turn/s turns/s turns/sec m/s mm/s",
    "rev rev/s revs/s revs rps rev/min rpm krpm erpm hz volt volts mv pct percent %",
    "count counts count/s counts/s counts/sec cps tick ticks tick/s ticks/s pulses pulses/s"};
constexpr const char* kVelocityCertain[] = {"rpm dps deg degs degree degrees counts ticks"};
constexpr const char* kTorqueSi[] = {"nm newtonmeter newtonmeters newtonmetre newtonmetres"};
constexpr const char* kTorqueOthers[] = {
    "mnm millinm millinewtonmeter millinewtonmeters unm knm nmm ncm newton newtons",
    "kg kgcm kgfcm kgm kgfm gcm gfcm ozin ozfin inoz",
    "lbin lbfin inlb inlbf inlbs lbft lbfft ftlb ftlbs ftlbf",
    "ma ua amp amps ampere amperes milliamp milliamps mamp mamps mv volt volts mw watt watts",
    "pct percent % duty dutycycle pwm pu permil permille normalized normalised",
    "count counts cnt cnts tick ticks lsb bits"};
constexpr const char* kTorqueCertain[] = {"mnm ncm ozin ma amps ampere amperes volts",
                                          "pwm duty percent counts ticks"};

/// The words of a quantity.
struct UnitWords {
  const char* quantity;
  Words si;       // of the SI unit
  Words others;   // of other units, also of those in kUnits
  Words certain;  // of other units that also count at the begin or in the middle of a name
};
constexpr UnitWords kWords[] = {{"time", kTimeSi, kTimeOthers, kTimeCertain},
                                {"angle", kAngleSi, kAngleOthers, kAngleCertain},
                                {"velocity", kVelocitySi, kVelocityOthers, kVelocityCertain},
                                {"torque", kTorqueSi, kTorqueOthers, kTorqueCertain}};

const UnitWords& WordsOf(std::string_view quantity) {
  return *std::ranges::find(kWords, quantity, &UnitWords::quantity);
}

bool Has(Words words, std::string_view word) {
  return std::ranges::any_of(words, [&](const char* text) {
    const std::vector<std::string_view> pieces = Split(text, ' ');
    return std::ranges::find(pieces, word) != pieces.end();
  });
}

bool IsLower(char c) { return c >= 'a' && c <= 'z'; }
bool IsUpper(char c) { return c >= 'A' && c <= 'Z'; }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }
/// Whether a byte is of a word, such as of `µs`, `°` or `%`.
bool IsOfWord(char c) {
  return IsLower(c) || IsUpper(c) || IsDigit(c) || c == '%' || static_cast<unsigned char>(c) >= 128;
}

/// A word for a unit in one spelling: `ozin` of `oz-in` and `OZ.in`, `deg/s` of `°_per_s [0]`.
std::string Normalized(std::string text) {
  while (!text.empty() && (!IsOfWord(text.back()) || IsDigit(text.back()))) text.pop_back();
  for (char& c : text) {
    if (IsUpper(c)) c = static_cast<char>(c - 'A' + 'a');
  }
  for (const char* micro : {"µ", "μ"}) text = Replaced(text, micro, "u");
  text = Replaced(text, "°", "deg");
  for (const char* per : {"_per_", " per ", "-per-", ".per."}) text = Replaced(text, per, "/");
  for (const char* dot : {"·", "⋅", " ", "_", ".", "-", "*", "^", "(", ")", "[", "]"}) {
    text = Replaced(text, dot, "");
  }
  return text;
}

/// Where a word for a unit may begin in the name of a column.
enum class Begin { kNone, kName, kAfterSeparator, kInWord };

Begin BeginAt(std::string_view name, size_t at) {
  if (!IsOfWord(name[at])) return Begin::kNone;
  if (at == 0) return Begin::kName;
  const char before = name[at - 1], now = name[at];
  if (!IsOfWord(before)) return Begin::kAfterSeparator;
  const bool camel = IsLower(before) && IsUpper(now);
  const bool after_digit = IsDigit(before) && !IsDigit(now);
  const bool symbol = now == '%' || name.substr(at).starts_with("°");
  return camel || after_digit || symbol ? Begin::kInWord : Begin::kNone;
}

/// Whether a text is a letter for a unit, which only counts after a separator. Joints may have the
/// names A and V, but seldom.
bool IsLetterOf(std::string_view text, std::string_view quantity) {
  while (!text.empty() && !IsOfWord(text.back())) text.remove_suffix(1);
  if (quantity == "time") return text == "h";
  return text == "V" || (quantity == "torque" && (text == "A" || text == "W" || text == "N"));
}

/// Whether separators divide a name, without an index at its end.
bool HasParts(std::string name) {
  while (!name.empty() && (!IsOfWord(name.back()) || IsDigit(name.back()))) name.pop_back();
  return !std::ranges::all_of(name, IsOfWord);
}

/// The word for a unit at the end of a name, the longest one; empty if there is none, or if it is
/// of the SI unit.
std::string OtherUnitAtEnd(const std::string& name, std::string_view quantity) {
  const UnitWords& words = WordsOf(quantity);
  for (size_t at = 0; at < name.size(); ++at) {
    const Begin begin = BeginAt(name, at);
    if (begin == Begin::kNone) continue;
    const std::string text = name.substr(at), word = Normalized(text);
    // In `u_N.m`, the name of the quantity is no part of the unit.
    if (begin == Begin::kName && HasParts(name)) continue;
    const bool is_letter = word.size() == 1 && word != "%";
    if (is_letter && begin == Begin::kAfterSeparator && IsLetterOf(text, quantity)) return text;
    if (is_letter && (quantity != "time" || begin == Begin::kInWord)) continue;
    if (Has(words.si, word)) return "";
    if (Has(words.others, word)) return text;
  }
  // Without a separator: `angledeg`.
  const std::string all = Normalized(name);
  for (const char* word :
       {"deg", "degrees", "degree", "rpm", "counts", "ticks", "millis", "micros"}) {
    if (!all.ends_with(word) || !Has(words.others, word)) continue;
    const auto before = std::ranges::find_if_not(name.rbegin(), name.rend(), IsOfWord);
    return {before.base(), name.end()};
  }
  return "";
}

/// A word for another unit than SI's that stands anywhere in a name; empty if there is none.
std::string OtherUnitWithin(const std::string& name, std::string_view quantity) {
  const UnitWords& words = WordsOf(quantity);
  std::string word;
  for (const char c : name + " ") {
    if (IsOfWord(c)) {
      word += c;
      continue;
    }
    if (Has(words.certain, Normalized(word))) return word;
    word.clear();
  }
  return "";
}

std::string NamesOf(std::string_view quantity) {
  std::vector<std::string> names;
  for (const LogUnit& unit : kUnits) {
    if (quantity == unit.quantity) names.emplace_back(unit.name);
  }
  return Join(names, ", ");
}

/// How to state a word for a known unit, such as `DEG`; empty for other words.
std::string Example(const std::string& column, const std::string& word, std::string_view quantity) {
  for (const LogUnit& unit : kUnits) {
    if (quantity != unit.quantity || Normalized(word) != Normalized(unit.name)) continue;
    return Concat(", as in {column = \"", Printable(column), "\", unit = \"", unit.name, "\"}");
  }
  return "";
}

std::optional<ColumnUnit> Find(std::string_view name, std::string_view quantity) {
  for (const LogUnit& unit : kUnits) {
    if (quantity == unit.quantity && name == unit.name) return ColumnUnit{unit.name, unit.scale};
  }
  return std::nullopt;
}

}  // namespace

ColumnUnit SiUnit(std::string_view quantity) {
  const LogUnit& unit = *std::ranges::find(kUnits, quantity, &LogUnit::quantity);
  return {quantity == "torque" ? "N·m" : unit.name, 1};
}

ColumnUnit UnitNamed(const std::string& name, std::string_view quantity, const std::string& place) {
  if (const auto unit = Find(name, quantity)) return *unit;
  throw BadInput(Concat(place, "unit: expected ", NamesOf(quantity), ", got \"", name, "\""));
}

ColumnUnit UnitInName(const std::string& column, std::string_view quantity,
                      const std::string& place) {
  std::string name = column;
  const bool has_brackets = name.ends_with(']') || name.ends_with(')');
  if (has_brackets) name.pop_back();
  const size_t before = name.find_last_of(has_brackets ? "[(" : "_ ");
  std::string other;
  if (before != std::string::npos) {
    const std::string end = name.substr(before + 1);
    if (const auto unit = Find(end, quantity)) return *unit;
    if (has_brackets && !ParseNumber(end)) other = end;
  }
  if (other.empty()) other = OtherUnitAtEnd(column, quantity);
  if (other.empty()) other = OtherUnitWithin(column, quantity);
  if (other.empty()) return SiUnit(quantity);
  while (other.size() > 1 && !IsOfWord(other.back())) other.pop_back();
  throw BadInput(Concat(place, "expected one of the units ", NamesOf(quantity), ", or a factor",
                        Example(column, other, quantity), ", got the unit \"", Printable(other),
                        "\""));
}

}  // namespace upswing::machine
