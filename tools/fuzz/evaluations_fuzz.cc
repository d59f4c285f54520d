// Target: the table of a run's evaluations, which `compare` and `export` read.
#include "runs/run_record.h"
#include "tools/fuzz/target.h"

namespace upswing {

bool TryInput(std::string_view input) {
  RunRecord run{"", Config(), ""};
  // The last line of an unfinished run may be cut off; a finished run's must be complete.
  const bool whole =
      Accepts([&] { run.evaluations = ParseEvaluations(std::string(input), kInputName, false); });
  const bool cut =
      Accepts([&] { run.evaluations = ParseEvaluations(std::string(input), kInputName, true); });
  Expect(cut || !whole, "a whole table where a cut one may be");
  (void)Finished(run);
  return whole;
}

}  // namespace upswing
