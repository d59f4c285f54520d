#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "runs/study_plan.h"

namespace upswing {

/// Contents of a study file.
struct StudyFile {
  std::string title;              // may be empty
  std::vector<Variant> variants;  // at least one, in the order of the file
  std::vector<int64_t> seeds;     // empty: not in the file
  std::optional<Keep> keep;       // nothing: not in the file
};

/// Parses the text of a study file. `where` is its path; the path of a model is relative to its
/// folder. Throws BadInput with the line.
StudyFile ParseStudy(std::string_view text, const std::string& where);

/// Title and variant names of a study, without its settings.
struct StudyOutline {
  std::string title;
  std::vector<std::string> variants;  // names
};

/// Parses only the outline, which has the same format in all versions of the program. Throws
/// BadInput.
StudyOutline ParseStudyOutline(std::string_view text, const std::string& where);

}  // namespace upswing
