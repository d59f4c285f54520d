// The checkpoint: the whole state of a training, which is then resumed.

#include "core/error.h"
#include "core/safetensors.h"
#include "fuzz/target.h"
#include "fuzz/tiny_training.h"
#include "run/this_host.h"

namespace upswing {

namespace {

/// Two trainings with the same settings, kept from one input to the next: loading overwrites the
/// whole state, and making a training takes far longer than loading one.
struct Trainings {
  explicit Trainings(const Config& config)
      : first(config, ThisHost(1)), second(config, ThisHost(1)) {}
  Training first, second;
};

/// Those that a checkpoint belongs to: its settings stand in another file; here its metadata have
/// a key that says which they are.
Trainings& TrainingsOf(const Tensors& file) {
  static Trainings in_mujoco(TinyConfig("mujoco"));
  static Trainings sac(TinyConfig("closed-form", "sac")), ppo(TinyConfig("closed-form", "ppo"));
  static Trainings in_closed_form(TinyConfig("closed-form"));
  if (file.metadata.contains("sac")) return sac;
  if (file.metadata.contains("ppo")) return ppo;
  return file.metadata.contains("mujoco") ? in_mujoco : in_closed_form;
}

}  // namespace

bool TryInput(std::string_view input) {
  const auto bytes = BytesOf(input);
  Tensors file;
  if (!Accepts([&] { file = ReadSafetensors({bytes.begin(), bytes.end()}, kInputName); })) {
    return false;
  }
  Trainings& trainings = TrainingsOf(file);
  Training& training = trainings.first;
  Training& again = trainings.second;
  if (!Accepts([&] { training.State(Archive::Loader(file)); })) return false;

  // What was loaded can be saved, loaded again, and resumed.
  Tensors saved;
  training.State(Archive::Saver(saved));
  Expect(Accepts([&] { again.State(Archive::Loader(saved)); }), "to load what was saved");
  try {
    again.Step();
  } catch (const Error& error) {
    Expect(error.exit_code() == 1, "a training that fails to end with exit code 1");
  }
  return true;
}

}  // namespace upswing
