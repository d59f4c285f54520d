#include "lab/controllers.h"

#include <algorithm>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

/// A controller's name and how it is made.
struct Controller {
  const char* name;
  std::shared_ptr<const Policy> (*make)(const ControllerConfig& config);
};

constexpr Controller kControllers[] = {
    {"lqr", [](const ControllerConfig& config) -> std::shared_ptr<const Policy> {
       return std::make_shared<LqrPolicy>(config.lqr, config.plant);
     }}};

/// The settings that differ, each as name and value.
std::vector<std::string> Differences(const Options& now, const Options& usual) {
  std::vector<std::string> texts;
  for (size_t k = 0; k < now.all().size(); ++k) {
    const Option& option = now.all()[k];
    if (option.text() == usual.all()[k].text()) continue;
    texts.push_back(Concat(option.name, " ", option.plain_text()));
  }
  return texts;
}

}  // namespace

std::vector<std::string> ControllerNames() {
  std::vector<std::string> names;
  for (const Controller& controller : kControllers) names.emplace_back(controller.name);
  return names;
}

bool IsController(const std::string& name) {
  return std::ranges::any_of(kControllers, [&](const Controller& c) { return name == c.name; });
}

std::shared_ptr<const Policy> MakeController(const std::string& name,
                                             const ControllerConfig& config) {
  for (const Controller& controller : kControllers) {
    if (name == controller.name) return controller.make(config);
  }
  throw BadInput(Concat("expected a controller, one of ", Join(ControllerNames(), ", "), ", got \"",
                        name, "\""));
}

std::string TitleOf(const std::string& name, ControllerConfig config) {
  ControllerConfig usual;
  std::vector<std::string> texts = Differences(OptionsOf(config), OptionsOf(usual));
  const auto plant = Differences(OptionsOf(config.plant), OptionsOf(usual.plant));
  if (!plant.empty()) texts.push_back(Concat("for ", Join(plant, " and ")));
  return texts.empty() ? name : Concat(name, " (", Join(texts, ", "), ")");
}

}  // namespace upswing
