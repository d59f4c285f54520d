#include "rl/agent_config.h"

#include "base/text.h"

namespace upswing {

std::string WidthsText(const std::vector<int64_t>& widths) {
  std::vector<std::string> texts;
  texts.reserve(widths.size());
  for (const int64_t width : widths) texts.push_back(std::to_string(width));
  return Join(texts, "-");
}

void WarnOfNoRate(double begin, double end, std::vector<std::string>& warnings) {
  if (begin == 0 && end == 0) {
    warnings.emplace_back("learning_rate and learning_rate_end are 0: the agent learns nothing");
  }
}

}  // namespace upswing
