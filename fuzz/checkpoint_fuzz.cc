// The checkpoint: the whole state of a training, which is then resumed.
#include <cmath>

#include "core/error.h"
#include "core/file.h"
#include "fuzz/target.h"
#include "fuzz/tiny_training.h"

namespace upswing {

bool TryInput(std::string_view input) {
  static ThreadPool pool(1);
  const auto bytes = BytesOf(input);
  TensorFile file;
  if (!Accepts([&] { file = TensorFile::Parse({bytes.begin(), bytes.end()}, kInputName); })) {
    return false;
  }
  // The settings stand in another file; here the metadata say which of two trainings this is.
  const bool mujoco = file.metadata.contains("mujoco");
  const Config config = TinyConfig(mujoco ? "mujoco" : "closed-form");
  TinyTraining training(config, pool);
  if (!Accepts([&] { training.State(Archive::Loader(file)); })) return false;

  // What was loaded can be saved, loaded again, and resumed.
  TensorFile saved;
  training.State(Archive::Saver(saved));
  TinyTraining again(config, pool);
  Expect(Accepts([&] { again.State(Archive::Loader(saved)); }), "to load what was saved");
  try {
    again.Step();
  } catch (const Error& error) {
    Expect(error.exit_code() == 1, "a training that fails to end with exit code 1");
  }
  return true;
}

}  // namespace upswing
