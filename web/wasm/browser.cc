// What setup asks of io and mujoco, in a browser: there are no files, memory has a limit of its
// own, and MuJoCo is another module, which this one does not know. Whatever needs them is refused.
#include "core/error.h"
#include "core/text.h"
#include "io/file.h"
#include "io/machine.h"
#include "io/streams.h"
#include "mujoco/engines.h"
#include "mujoco/model.h"
#include "setup/loaded_policy.h"

namespace upswing {
namespace {

constexpr size_t kPage = 65536;              // bytes of WebAssembly's unit of memory
constexpr size_t kMemoryLimit = 512u << 20;  // bytes, the same as in build.py

}  // namespace

int64_t AvailableMemory() {
  return static_cast<int64_t>(kMemoryLimit - kPage * __builtin_wasm_memory_size(0));
}

std::string InputName(const std::string& path) { return path; }

std::string ReadOwnFile(const std::filesystem::path& path, size_t /*most_bytes*/) {
  throw BadInput(Concat(path.string(), ": a page has no files"));
}

LoadedPolicy LoadPolicy(const std::filesystem::path& path) {
  throw BadInput(Concat(path.string(), ": a page has no files"));
}

const Engine kMuJoCo{"mujoco", [](const PhysicsConfig&) -> std::unique_ptr<Physics> {
                       throw BadInput("physics: expected closed-form, as a page learns in that");
                     }};

std::vector<std::string> EngineNames() { return {kMuJoCo.name, kClosedForm.name}; }

const Engine& FindEngine(std::string_view name, const std::string& where) {
  if (name == kClosedForm.name) return kClosedForm;
  if (name == kMuJoCo.name) return kMuJoCo;
  throw BadInput(
      Concat(where, ": expected one of ", Join(EngineNames(), ", "), ", got \"", name, "\""));
}

ModelPtr LoadModel(const std::string& /*mjcf*/, const std::string& /*where*/) {
  throw BadInput("it was trained on a model of its own, which this page does not have");
}

Plant PlantOf(const mjModel& /*model*/) { return {}; }  // of none: LoadModel has thrown

}  // namespace upswing

extern "C" void mj_deleteModel(mjModel* /*model*/) {}
