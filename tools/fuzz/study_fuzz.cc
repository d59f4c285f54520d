// Target: a study file.
#include "runs/study_plan.h"
#include "tools/fuzz/target.h"

namespace upswing {

bool TryInput(std::string_view input) {
  return Accepts([&] { (void)ParseStudy(input, kInputName); });
}

}  // namespace upswing
