// Target: the checkpoint, which holds the whole state of a training and then resumes it.

#include "base/error.h"
#include "base/safetensors.h"
#include "runs/this_host.h"
#include "tools/fuzz/target.h"
#include "tools/fuzz/tiny_training.h"

namespace upswing {

namespace {

/// Two trainings with the same settings, reused for all inputs. Loading overwrites their whole
/// state, and constructing a training takes far longer than loading one.
struct Trainings {
  explicit Trainings(const Config& config)
      : first(config, ThisHost(1)), second(config, ThisHost(1)) {}
  Training first, second;
};

/// The trainings that a checkpoint belongs to. The program keeps its settings in another file; here
/// a metadata key names them.
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

  // A loaded state can be saved, loaded again, and resumed.
  Tensors saved;
  training.State(Archive::Saver(saved));
  Expect(Accepts([&] { again.State(Archive::Loader(saved)); }), "to load the saved state");
  try {
    again.Step();
  } catch (const Error& error) {
    Expect(error.exit_code() == 1, "a training that fails to end with exit code 1");
  }
  return true;
}

}  // namespace upswing
