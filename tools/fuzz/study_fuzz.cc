// Target: a study file.
#include "runs/study_file.h"
#include "tools/fuzz/target.h"

namespace upswing {

bool TryInput(std::string_view input) {
  StudyFile study;
  StudyOutline outline;
  // Study files of other versions have a readable outline, too.
  (void)Accepts([&] { outline = ParseStudyOutline(input, kInputName); });
  if (!Accepts([&] { study = ParseStudy(input, kInputName); })) return false;
  Expect(outline.title == study.title && outline.variants.size() == study.variants.size(),
         "an outline of the same study");
  return true;
}

}  // namespace upswing
