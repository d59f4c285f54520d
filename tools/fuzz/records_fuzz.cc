// Target: a study's plan.json, the result seedN.done of a run, the facts in a run's log, and a
// page's agents.json. Each input is tried as each of them.
#include <nlohmann/json.hpp>

#include "base/json.h"
#include "extras/deploy/export.h"
#include "runs/finished_run.h"
#include "runs/run_record.h"
#include "runs/study_plan.h"
#include "tools/fuzz/target.h"

namespace upswing {

using namespace deploy;

bool TryInput(std::string_view input) {
  (void)RunConditions::OfLog(input);

  FinishedRun run;
  const bool is_run = Accepts([&] { run = FinishedRun::Parse(input); });
  if (is_run) (void)Accepts([&] { (void)ParseEvaluations(run.evaluations, kInputName, false); });

  StudyPlan plan;
  std::vector<std::string> marks;
  const bool is_plan = Accepts([&] { plan = PlanIn(ParseJsonObject(input, 4), marks); });
  Expect(!is_plan || (!plan.seeds.empty() && marks.size() == plan.variants.size()),
         "seeds, and a mark for each variant");

  nlohmann::ordered_json index;
  const bool is_index = Accepts([&] { index = ParsePageIndex(input, kInputName); });
  Expect(!is_index || ParsePageIndex(index.dump(1), kInputName) == index,
         "to read the list that was written");
  return is_run || is_plan || is_index;
}

}  // namespace upswing
