#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "study/study_plan.h"

namespace upswing {

/// What a study file asks for.
struct StudyFile {
  std::string title;              // may be empty
  std::vector<Variant> variants;  // in the order in which they stand in the file; at least one
  std::vector<int64_t> seeds;     // empty: the file names none
  std::optional<Keep> keep;       // nothing: the file does not say
};

/// Reads the text of a study file; the path of a model is relative to its folder. `where` is its
/// path.
/// Throws BadInput with the line.
StudyFile ParseStudy(std::string_view text, const std::string& where);

/// What identifies a study, without its settings.
struct StudyOutline {
  std::string title;
  std::vector<std::string> variants;  // names
};

/// Reads only the outline, which is the same in files of other versions of the program. Throws
/// BadInput.
StudyOutline ParseStudyOutline(std::string_view text, const std::string& where);

}  // namespace upswing
