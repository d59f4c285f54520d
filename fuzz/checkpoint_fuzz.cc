// The checkpoint: the whole state of a training, which is then resumed.

#include "core/error.h"
#include "core/safetensors.h"
#include "fuzz/target.h"
#include "fuzz/tiny_training.h"

namespace upswing {

namespace {

/// Two trainings with the same settings, kept from one input to the next: loading overwrites the
/// whole state, and making a training takes far longer than loading one.
struct Trainings {
  explicit Trainings(const std::string& physics)
      : first(TinyConfig(physics), 1), second(TinyConfig(physics), 1) {}
  Training first, second;
};

Trainings& TrainingsIn(bool mujoco) {
  static Trainings in_mujoco("mujoco");
  static Trainings in_closed_form("closed-form");
  return mujoco ? in_mujoco : in_closed_form;
}

}  // namespace

bool TryInput(std::string_view input) {
  const auto bytes = BytesOf(input);
  Tensors file;
  if (!Accepts([&] { file = ReadSafetensors({bytes.begin(), bytes.end()}, kInputName); })) {
    return false;
  }
  // The settings stand in another file; here the metadata say which of two trainings this is.
  Trainings& trainings = TrainingsIn(file.metadata.contains("mujoco"));
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
