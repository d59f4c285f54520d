#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/csv.h"
#include "base/text.h"
#include "judge/grade.h"

namespace upswing {

// Defined by CMake from judge/grade_page.html.
std::string_view GradePageTemplate();

namespace {

std::string Decimals(double x) { return fmt::format("{:.2f}", x); }

/// Adds the figures of a grade as texts: `add(name, text)`.
template <typename Add>
void AddFigures(const Grade& grade, const Add& add) {
  const Evaluation& e = grade.nominal;
  add("episodes", Concat(e.episodes));
  add("successes", Concat(e.successes));
  add("return", Decimals(e.reward_sum.mean));
  add("plants", Concat(grade.random.episodes));
  add("plant_successes", Concat(grade.random.successes));
  add("torque_variation", Decimals(e.torque_variation.mean));
  add("energy_used", Decimals(e.work.mean));
}

}  // namespace

std::string GradesCsv(const std::vector<Grade>& grades) {
  CsvTable csv;
  for (const Grade& grade : grades) {
    const bool known = grade.refused.empty();
    csv.Add("rank", known ? Concat(grade.rank) : "");
    csv.Add("name", grade.name);
    csv.Add("file", grade.file);
    AddFigures(grade, [&](std::string_view name, const std::string& text) {
      csv.Add(name, known ? text : "");
    });
    csv.Add("note", known ? grade.note : "");
    csv.Add("refused", OneLine(grade.refused));
    csv.EndRow();
  }
  return csv.text();
}

std::string GradesPage(const std::vector<Grade>& grades, const GradeConfig& config) {
  nlohmann::ordered_json page;
  page["seed"] = config.seed;
  page["rows"] = nlohmann::ordered_json::array();
  for (const Grade& grade : grades) {
    nlohmann::ordered_json row;
    row["name"] = Printable(grade.name);
    row["rank"] = grade.rank;
    if (!grade.refused.empty()) row["refused"] = OneLine(grade.refused);
    if (!grade.note.empty()) row["note"] = Printable(grade.note);
    AddFigures(grade, [&](const char* name, const std::string& text) { row[name] = text; });
    // Every second state, in thousandths of a radian.
    auto& motion = row["motion"] = nlohmann::ordered_json::array();
    for (size_t k = 0; k < grade.motion.size(); k += 2) {
      motion.push_back(std::lround(1000 * grade.motion[k].q1));
      motion.push_back(std::lround(1000 * grade.motion[k].q2));
    }
    page["rows"].push_back(std::move(row));
  }
  // In ASCII and without "<", the document cannot end the script element that holds it.
  const std::string json = Replaced(page.dump(-1, ' ', true), "<", "\\u003c");
  return Replaced(std::string(GradePageTemplate()), "@DATA@", json);
}

}  // namespace upswing
