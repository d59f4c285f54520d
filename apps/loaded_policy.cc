#include "apps/loaded_policy.h"

#include "core/error.h"
#include "core/text.h"
#include "sim/model.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// The observations of policies that remember so many steps.
ObservationInfo ObservationOf(int64_t memory) {
  ObservationInfo observation{
      {"cos q1", "sin q1", "w1", "cos q2", "sin q2", "w2", "energy", "height"},
      {kMaxVelocity1, kMaxVelocity2},
      {}};
  if (memory > 0) {
    observation.memory = {
        memory, {"change of w1", "change of w2", "torque"}, kMemoryVelocity, kMemoryTorque};
  }
  return observation;
}

/// Throws BadInput unless its observations are those that this program makes. Names are for people.
void CheckObservation(const LoadedPolicy& loaded, const std::string& where) {
  const int inputs = loaded.policy.shape().inputs;
  const int remembered = inputs - kObservationSize;
  if (remembered < 0 || remembered % kMemorySize != 0 || loaded.memory() > kMostMemory) {
    throw BadInput(Concat(where, ": expected a policy of ", kObservationSize, " observations and ",
                          kMemorySize, " for each of at most ", kMostMemory,
                          " steps of memory, got ", inputs));
  }
  const auto& given = loaded.policy.info().observation;
  if (!given) throw BadInput(Concat(where, ": no metadata \"observation\""));
  const ObservationInfo expected = ObservationOf(loaded.memory());
  const auto same_memory = [&] {
    if (!given->memory || !expected.memory) return !given->memory && !expected.memory;
    return given->memory->steps == expected.memory->steps &&
           given->memory->velocity == expected.memory->velocity &&
           given->memory->torque == expected.memory->torque;
  };
  if (given->max_velocity != expected.max_velocity || !same_memory()) {
    throw BadInput(Concat(where,
                          ": metadata \"observation\": expected the scales of "
                          "docs/policy-format.md and a memory of ",
                          loaded.memory(), " steps, as the network has inputs"));
  }
}

/// The plant of a policy's training. Throws BadInput.
Plant TrainingPlant(const PolicyInfo& info, const std::string& where) {
  Plant plant;
  const std::string place = Concat(where, ": metadata \"plant\"");
  const Options options = OptionsOf(plant);
  for (const Option& option : options.all()) {
    const auto found = info.plant.find(option.name);
    if (found == info.plant.end()) throw BadInput(Concat(place, ": no ", option.name));
    option.Set(FormatNumber(found->second), Concat(place, ": ", option.name));
  }
  return plant;
}

}  // namespace

LoadedPolicy LoadPolicy(const fs::path& path) {
  fs::path file = path;
  if (fs::is_directory(path)) {
    file = path / "policy.safetensors";
    if (fs::exists(path / "config.toml") && !fs::exists(file)) {
      throw BadInput(Concat(path.string(), ": this run has no policy: expected ",
                            "policy.safetensors, which its first evaluation writes"));
    }
  }
  if (!fs::exists(file)) {
    throw BadInput(
        Concat(file.string(), ": no such file; expected a policy.safetensors or a run ", "folder"));
  }
  return ReadPolicy(TensorFile::Load(file));
}

LoadedPolicy ReadPolicy(const TensorFile& file) {
  const std::string& where = file.path();
  LoadedPolicy loaded{where, Policy::From(file), Plant(), ""};
  const PolicyInfo& info = loaded.policy.info();
  CheckObservation(loaded, where);
  if (info.control_period != kControlPeriod) {
    throw BadInput(Concat(where, ": metadata \"control_period\": expected ", kControlPeriod,
                          " s, for which this program holds a torque, got ",
                          info.control_period ? FormatNumber(*info.control_period) : "none"));
  }
  loaded.plant = TrainingPlant(info, where);
  loaded.mjcf = info.model;
  if (!loaded.mjcf.empty()) LoadModel(loaded.mjcf, Concat(where, ": metadata \"model\""));
  return loaded;
}

PolicyInfo InfoOf(const Config& config) {
  PolicyInfo info;
  info.agent = config.agent;
  info.seed = config.train.seed;
  info.upswing_version = UPSWING_VERSION;
  info.config = ConfigToml(config, true);
  for (const auto& [name, value] : PlantValues(config.plant)) info.plant[name] = value;
  info.control_period = kControlPeriod;
  info.observation = ObservationOf(config.memory);
  info.model = config.mjcf;
  return info;
}

}  // namespace upswing
