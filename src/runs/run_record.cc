#include "runs/run_record.h"

#include "base/csv.h"
#include "base/error.h"
#include "base/solved.h"
#include "base/steps.h"
#include "base/text.h"
#include "os/file.h"
#include "rl/train/evaluate.h"
#include "runs/run_folder.h"

namespace upswing {

namespace fs = std::filesystem;

std::vector<EvaluationRow> ReadEvaluations(const fs::path& run, bool may_be_cut) {
  const fs::path path = run / RunFolder::kEvaluations;
  if (!fs::exists(path)) return {};
  return ParseEvaluations(ReadOwnFile(path), path.string(), may_be_cut);
}

std::vector<EvaluationRow> ParseEvaluations(std::string text, const std::string& where,
                                            bool may_be_cut) {
  if (!text.empty() && !text.ends_with('\n')) {
    if (!may_be_cut) {
      throw BadInput(Concat(where, ": expected a finished run, got a half-written last line ",
                            "(train --resume repairs it)"));
    }
    text.erase(text.rfind('\n') + 1);  // erases everything if there is no complete line
  }
  const auto columns =
      ReadCsv(text,
              {"step", "seconds", "success_rate", "mean_return", "rms_torque", "torque_variation",
               "torque_variation_upright", "value", "discounted_return"},
              where);
  std::vector<EvaluationRow> rows;
  for (size_t i = 0; i < columns[0].values.size(); ++i) {
    const auto cell = [&](size_t column) { return columns[column].values[i]; };
    constexpr double kMostSteps = 1e15;
    if (!(cell(0) >= 0 && cell(0) <= kMostSteps)) {
      throw BadInput(Concat(where, ": row ", i + 1, ": expected a number of steps, got ",
                            FormatNumber(cell(0))));
    }
    rows.push_back({static_cast<int64_t>(cell(0)), cell(1), cell(2), cell(3), cell(4), cell(5),
                    cell(2) > 0 ? cell(6) : EvaluationRow::kUnknown, ValueRatio(cell(7), cell(8))});
    if (i > 0 && (rows[i].step <= rows[i - 1].step || rows[i].seconds < rows[i - 1].seconds)) {
      throw BadInput(Concat(where, ": expected increasing steps and seconds, got ",
                            rows[i - 1].step, " and ", rows[i].step, " steps, ",
                            FormatNumber(rows[i - 1].seconds), " and ",
                            FormatNumber(rows[i].seconds), " s in rows ", i, " and ", i + 1));
    }
  }
  return rows;
}

std::optional<size_t> SolvedAt(const RunRecord& run) {
  const TrainConfig& train = run.config.train;
  const EvaluationRule rule = run.config.Spec().evaluation;
  int64_t streak = 0;
  size_t first = 0;
  for (size_t i = 0; i < run.evaluations.size(); ++i) {
    const EvaluationRow& row = run.evaluations[i];
    if (!IsDue(row.step - train.envs, row.step, train.eval_every)) continue;
    const bool solved = CountsAsSolved(rule.Passed(row.success_rate, row.mean_return), streak);
    if (streak == 1) first = i;
    if (solved) return first;
  }
  return std::nullopt;
}

bool Finished(const RunRecord& run) {
  if (run.evaluations.empty()) return false;
  return IsFinished(run.evaluations.back().step, run.config.train.steps, SolvedAt(run).has_value(),
                    run.config.train.stop_when_solved);
}

}  // namespace upswing
