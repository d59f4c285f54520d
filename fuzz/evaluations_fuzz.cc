// The table of a run's evaluations, as `compare` and `export` read it.
#include "fuzz/target.h"
#include "run/run_record.h"

namespace upswing {

bool TryInput(std::string_view input) {
  RunRecord run{"", Config(), ""};
  // The last line of an unfinished run may be cut off; that of others must be whole.
  const bool whole =
      Accepts([&] { run.evaluations = ParseEvaluations(std::string(input), kInputName, false); });
  const bool cut =
      Accepts([&] { run.evaluations = ParseEvaluations(std::string(input), kInputName, true); });
  Expect(cut || !whole, "a whole table where a cut one may be");
  (void)Finished(run);
  return whole;
}

}  // namespace upswing
