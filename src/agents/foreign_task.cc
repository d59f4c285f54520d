#include "agents/foreign_task.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/json.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr std::string_view kBeginning = "gymnasium/";  // of a foreign task's name
constexpr int64_t kMostInputs = 65536, kMostActions = 1024, kMostEpisodeSteps = 100'000'000;
constexpr double kMostAction = 1e6;  // largest size of an action
constexpr size_t kLongestName = 50;

/// A list of 0 to kMostActions numbers. Throws BadInput.
std::vector<double> Numbers(const nlohmann::json& object, const char* name) {
  std::vector<double> numbers;
  for (const nlohmann::json& item : JsonList(object, name, kMostActions)) {
    if (!item.is_number() || std::abs(item.get<double>()) > kMostAction) {
      throw BadInput(Concat("\"", name, "\": expected numbers within ±", kMostAction));
    }
    numbers.push_back(item.get<double>());
  }
  return numbers;
}

ForeignTask ParseObject(const std::string& text) {
  const nlohmann::json object = ParseJsonObject(text);
  ForeignTask task;
  task.name = JsonText(object, "name");
  if (task.name.empty() || task.name.size() > kLongestName || Printable(task.name) != task.name) {
    throw BadInput(Concat("\"name\": expected 1 to ", kLongestName, " characters on one line"));
  }
  task.obs_size = static_cast<int>(JsonInteger(object, "observations", 1, kMostInputs));
  task.action_limit = Numbers(object, "action_limit");
  task.choices = Numbers(object, "choices");
  const bool positive = std::ranges::all_of(task.action_limit, [](double x) { return x > 0; });
  if (task.action_limit.empty() || !positive) {
    throw BadInput("\"action_limit\": expected positive numbers, at least one");
  }
  if (!task.choices.empty() && (task.choices.size() < 2 || task.action_limit.size() > 1)) {
    throw BadInput("\"choices\": expected none, or at least 2 of a single action");
  }
  task.episode_steps = JsonInteger(object, "episode_steps", 1, kMostEpisodeSteps);
  if (object.contains("solved_return")) task.solved_return = JsonNumber(object, "solved_return");
  return task;
}

}  // namespace

ForeignTask ForeignTask::Parse(const std::string& text, const std::string& where) {
  try {
    return ParseObject(text);
  } catch (const Error& error) {
    throw BadInput(Concat(where, ": ", error.what()));
  }
}

EnvSpec ForeignTask::Spec(int num_envs) const {
  EnvSpec spec;
  spec.task = Concat(kBeginning, name);
  spec.num_envs = num_envs;
  spec.obs_size = obs_size;
  spec.action_limit = action_limit;
  spec.choices = choices;
  spec.action_unit = "";
  spec.step_seconds = 1;
  spec.evaluation.seconds = static_cast<double>(episode_steps);
  spec.evaluation.return_seconds = static_cast<double>(episode_steps);
  spec.evaluation.solved_return = solved_return.value_or(std::numeric_limits<double>::infinity());
  return spec;
}

bool IsForeign(std::string_view task) { return task.starts_with(kBeginning); }

std::unique_ptr<VectorEnv> MakeEnv(const EnvConfig& config) {
  if (config.environment.empty()) return std::make_unique<PendulumEnv>(config);
  if (config.make_foreign) return config.make_foreign(config);
  throw BadInput(Concat(SpecOf(config).task,
                        ": expected a task of the program, got an environment ",
                        "of Gymnasium, which only Python makes and steps (upswing.train and "
                        "upswing.evaluate with env)"));
}

EnvSpec SpecOf(const EnvConfig& config) {
  if (config.environment.empty()) return PendulumSpec(config);
  return ForeignTask::Parse(config.environment, "environment").Spec(config.num_envs);
}

}  // namespace upswing
