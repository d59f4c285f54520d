#include "agents/loaded_policy.h"

#include <algorithm>
#include <cmath>

#include "agents/training.h"
#include "base/error.h"
#include "base/text.h"
#include "nn/network_policy.h"
#include "pendulum/observation.h"

namespace upswing {
namespace {

/// Inputs of the memory.
int RememberedInputs(const LoadedPolicy& loaded) {
  return loaded.policy->obs_size() - kObservationSize -
         (loaded.identifies() ? kIdentifiedSize : 0) - (loaded.seeks_any_pose() ? kGoalSize : 0);
}

/// Throws BadInput unless the policy's observations are those of this program's double pendulum.
/// Names of observations are not compared, because they are only for people.
void CheckObservation(const LoadedPolicy& loaded, const std::string& where) {
  const int inputs = loaded.policy->obs_size();
  const int remembered = RememberedInputs(loaded);
  if (remembered < 0 || remembered % kMemorySize != 0 || loaded.memory() > kMostMemory) {
    throw BadInput(Concat(
        where, ": expected a policy of ", kObservationSize, " observations, ",
        loaded.identifies() ? Concat(kIdentifiedSize, " of identification, ") : "",
        loaded.seeks_any_pose() ? Concat(kGoalSize, " of the goal, ") : "", "and ", kMemorySize,
        " for each of at most ", kMostMemory, " steps of memory, got ", inputs));
  }
  const auto& given = loaded.policy->info().observation;
  if (!given) throw BadInput(Concat(where, ": no metadata \"observation\""));
  const ObservationInfo expected = ObservationInfoOf(loaded.scale(), loaded.memory(),
                                                     loaded.identifies(), loaded.seeks_any_pose());
  const auto same = [](double a, double b) { return std::abs(a - b) <= 1e-12 * std::abs(b); };
  const auto same_memory = [&] {
    if (!given->memory || !expected.memory) return !given->memory && !expected.memory;
    return given->memory->steps == expected.memory->steps &&
           same(given->memory->velocity, expected.memory->velocity) &&
           same(given->memory->torque, expected.memory->torque);
  };
  if (given->goal.size() != expected.goal.size()) {
    throw BadInput(Concat(where, ": metadata \"observation\": goal: expected ", kGoalSize,
                          " names, got ", given->goal.size()));
  }
  const bool same_scale =
      !given->identified || given->identified->scale == expected.identified->scale;
  const bool same_velocity = std::ranges::equal(given->max_velocity, expected.max_velocity, same);
  if (!same_velocity || !same_scale || !same_memory()) {
    throw BadInput(
        Concat(where,
               ": metadata \"observation\": expected the names and scales of this version "
               "and a memory of ",
               loaded.memory(), " steps, as the network's inputs have, got others"));
  }
}

/// Throws BadInput unless the policy is for the double pendulum of this program, or a foreign task,
/// whose spaces only its environment knows.
void CheckTask(const LoadedPolicy& loaded, const std::string& where) {
  const auto& period = loaded.policy->info().control_period;
  if (loaded.is_foreign()) {
    if (!period) throw BadInput(Concat(where, ": no metadata \"control_period\""));
    return;
  }
  if (loaded.task != kDoublePendulum) {
    throw BadInput(Concat(where, ": metadata \"task\": expected ", kDoublePendulum, ", got \"",
                          loaded.task, "\""));
  }
  if (!period || *period < kShortestPeriod || *period > kLongestPeriod) {
    throw BadInput(Concat(where, ": metadata \"control_period\": expected ", kShortestPeriod,
                          " to ", kLongestPeriod, " s, got ",
                          period ? FormatNumber(*period) : "none"));
  }
  if (loaded.policy->action_size() != 1) {
    throw BadInput(Concat(where, ": expected 1 number per action, as in ", loaded.task, ", got ",
                          loaded.policy->action_size()));
  }
  CheckObservation(loaded, where);
}

/// The plant of a policy's training. Throws BadInput.
Plant TrainingPlant(const PolicyInfo& info, const std::string& where) {
  Plant plant;
  const std::string place = Concat(where, ": metadata \"plant\"");
  for (const PlantParameter& parameter : std::span(kPlantParameters).first(kMainParameters)) {
    if (!info.plant.contains(parameter.name)) {
      throw BadInput(Concat(place, ": no ", parameter.name));
    }
  }
  const Options options = OptionsOf(plant);
  for (const auto& [name, value] : info.plant) {
    if (options.Get(name) != nullptr) continue;
    throw BadInput(Concat(place, ": expected parameters of a plant, got \"", Printable(name), "\"",
                          DidYouMean(name, NamesOf(options.all()))));
  }
  for (const Option& option : options.all()) {
    const auto found = info.plant.find(option.name);
    if (found == info.plant.end()) continue;  // it has its default; see PlantValues
    option.Set(FormatNumber(found->second), Concat(place, ": ", option.name));
  }
  return plant;
}

}  // namespace

void ExpectNoCheckpoint(const Tensors& file) {
  const auto format = file.metadata.find("format");
  if (format == file.metadata.end() || format->second != kCheckpointFormat) return;
  throw BadInput(Concat(file.where(),
                        ": expected a policy, got the checkpoint of a training, from which `train "
                        "--resume` continues; the policy is policy.safetensors in the run folder"));
}

LoadedPolicy ReadPolicy(const Tensors& file) {
  ExpectNoCheckpoint(file);
  const std::string& where = file.where();
  if (const auto model = file.metadata.find("model");
      model != file.metadata.end() && !model->second.empty()) {
    throw BadInput(
        Concat(where,
               ": metadata \"model\": expected none, got an MJCF model; this version has "
               "plants of numbers only"));
  }
  const auto policy = std::make_shared<const NetworkPolicy>(NetworkPolicy::From(file));
  const PolicyInfo& info = policy->info();
  const std::string task = info.task.empty() ? kDoublePendulum : info.task;
  LoadedPolicy loaded{where, where, policy, task, Plant()};
  CheckTask(loaded, where);
  if (loaded.is_foreign()) return loaded;
  loaded.plant = TrainingPlant(info, where);
  return loaded;
}

std::optional<LoadedPolicy> ForOtherSize(const LoadedPolicy& loaded, const Plant& plant) {
  const Scale ratio = CarryOver(loaded.plant, plant);
  const auto* network = dynamic_cast<const NetworkPolicy*>(loaded.policy.get());
  if (ratio == Scale() || (network == nullptr && !loaded.design_for)) return std::nullopt;
  LoadedPolicy carried = loaded;
  carried.plant = plant;
  carried.carried_over = ratio;
  if (network == nullptr) {
    carried.policy = loaded.design_for(plant);
    return carried;
  }
  const Scale scale = loaded.scale() * ratio;
  PolicyInfo info = network->info();
  info.control_period = loaded.control_period() * ratio.time;
  SetScale(scale, info);
  info.observation =
      ObservationInfoOf(scale, loaded.memory(), loaded.identifies(), loaded.seeks_any_pose());
  carried.policy =
      std::make_shared<const NetworkPolicy>(network->WithTorques(ratio.torque, std::move(info)));
  return carried;
}

void ExpectPendulum(const LoadedPolicy& loaded) {
  if (!loaded.is_foreign()) return;
  throw BadInput(Concat(Printable(loaded.name), ": expected a policy of ", kDoublePendulum,
                        ", got one of ", loaded.task,
                        ", an environment that only Python steps (upswing.evaluate with env)"));
}

int LoadedPolicy::memory() const {
  return is_foreign() ? 0 : RememberedInputs(*this) / kMemorySize;
}

bool LoadedPolicy::identifies() const {
  const auto& observation = policy->info().observation;
  return !is_foreign() && observation && observation->identified;
}

bool LoadedPolicy::seeks_any_pose() const {
  const auto& observation = policy->info().observation;
  return !is_foreign() && observation && !observation->goal.empty();
}

PolicyInfo InfoOf(const Config& config) {
  PolicyInfo info;
  info.agent = config.agent;
  info.seed = config.train.seed;
  info.upswing_version = UPSWING_VERSION;
  info.config = ConfigToml(config, true);
  const EnvSpec spec = config.Spec();
  info.task = spec.task;
  info.control_period = spec.step_seconds;
  if (config.is_foreign()) return info;
  for (const auto& [name, value] : PlantValues(config.plant)) info.plant[name] = value;
  SetScale(config.scale(), info);
  info.observation =
      ObservationInfoOf(config.scale(), config.memory, config.identify, config.any_pose);
  return info;
}

}  // namespace upswing
