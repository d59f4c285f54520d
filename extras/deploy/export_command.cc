#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "agents/arguments.h"
#include "agents/controllers.h"
#include "agents/loaded_policy.h"
#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "cli/commands.h"
#include "extras/deploy/c_header.h"
#include "extras/deploy/export.h"
#include "judge/trial.h"
#include "os/streams.h"
#include "runs/find_policy.h"

namespace upswing::deploy {
namespace {

namespace fs = std::filesystem;

struct ExportArguments {
  std::vector<std::string> policies;
  PolicyArguments controller;  // settings of a controller
  std::string plant;           // on which a learned policy acts; empty: its own
  std::string page, id, onnx, c, prefix;
  int64_t checkpoints = 0;
  bool overwrite = false;
};

/// Throws BadInput for the controller hybrid, which has no export. Comes before GetPolicy, which
/// asks for --swing-up. A file or folder of that name is a policy.
void RefuseHybrid(const std::string& name) {
  std::error_code error;
  if (name != "hybrid" || fs::exists(name, error)) return;
  throw BadInput(
      "hybrid: expected a single policy or controller, got one that consists of two; export the "
      "policy that swings up, and lqr with --c, each by itself");
}

/// The single policy that `flag` exports, carried over to the plant of --plant if that has another
/// size.
LoadedPolicy SinglePolicy(const ExportArguments& a, const char* flag) {
  if (a.policies.size() != 1) {
    throw BadInput(Concat(flag, ": expected a policy or a run folder, got ",
                          a.policies.empty() ? "none" : std::to_string(a.policies.size())));
  }
  PolicyArguments policy = a.controller;
  policy.name = a.policies.front();
  RefuseHybrid(policy.name);
  if (a.plant.empty()) return GetPolicy(policy);
  if (IsController(policy.name)) {
    throw BadInput(Concat("--plant: expected a learned policy, got ", policy.name,
                          "; --made-for designs a controller for a plant"));
  }
  TrialArguments trial;
  trial.plant = a.plant;
  trial.control_period = a.controller.control_period;
  LoadedPolicy loaded = GetPolicyIn(trial, policy);
  ExpectPendulum(loaded);
  loaded.plant = PlantIn(trial, loaded);
  return loaded;
}

/// Writes an export. An older export, whose first bytes are those of `text`, may be replaced;
/// another file only with --overwrite. Returns a remark on the replaced file, or "". Throws
/// BadInput.
std::string WriteExport(const ExportArguments& a, const std::string& flag, const std::string& path,
                        const std::string& text) {
  constexpr size_t kSame = 11;  // bytes: of an ONNX model up to the producer's name
  std::error_code error;
  const bool exists = !IsStandardStream(path) && fs::is_regular_file(path, error);
  const bool is_export = exists && StartsWithOneOf(path, {text.substr(0, kSame)});
  CheckNewOutput(flag, path, a.overwrite || is_export);
  WriteOutput(path, text);
  return exists ? ", in place of the file that was there" : "";
}

int ExportOnnx(const ExportArguments& a) {
  const LoadedPolicy loaded = SinglePolicy(a, "--onnx");
  const std::string model = OnnxModelOf(loaded);
  const std::string replaced = WriteExport(a, "--onnx", a.onnx, model);
  if (!IsStandardStream(a.onnx)) {
    fmt::print("{} ({} KB), {}{}\n", Printable(a.onnx), model.size() / 1024,
               loaded.policy->description(), replaced);
  }
  return 0;
}

int ExportC(const ExportArguments& a) {
  const LoadedPolicy loaded = SinglePolicy(a, "--c");
  const CHeader header = CHeaderOf(loaded, a.prefix.empty() ? CPrefixOf(a.c, loaded) : a.prefix);
  const std::string replaced = WriteExport(a, "--c", a.c, header.text);
  if (IsStandardStream(a.c)) return 0;
  fmt::print("{} ({} KB), names begin with {}_{}\n", Printable(a.c), header.text.size() / 1024,
             header.prefix, replaced);
  fmt::print("  flash       {} bytes of constants\n", FormatCount(header.constant_bytes));
  fmt::print(
      "  RAM         {} bytes of state; stack of a call: {} bytes of arrays, and up to 200 more\n",
      FormatCount(header.state_bytes), FormatCount(header.stack_bytes));
  const std::string period = FormatNumber(*loaded.policy->info().control_period);
  if (header.multiply_adds > 0) {
    fmt::print("  work        {} multiply-adds per call, every {} s\n",
               FormatCount(header.multiply_adds), period);
  } else {
    fmt::print("  work        one call every {} s; see the first lines of the header\n", period);
  }
  return 0;
}

int ExportPage(const ExportArguments& a) {
  if (a.policies.empty()) throw BadInput("--page: expected policies or run folders, got none");
  for (const std::string& name : ExportToPage(a.policies, a.id, a.checkpoints, a.page)) {
    fmt::print("{}\n", Printable((fs::path(a.page) / name).string()));
  }
  return 0;
}

int RunExport(const ExportArguments& a) {
  if (a.page.empty() && a.onnx.empty() && a.c.empty()) {
    throw BadInput("export: expected --onnx FILE, --c FILE.h or --page FOLDER, got none");
  }
  if (!a.prefix.empty() && a.c.empty()) throw BadInput("--prefix: expected --c with it, got none");
  if (a.checkpoints > 0 && a.page.empty()) {
    throw BadInput("--checkpoints: expected --page with it, got none");
  }
  if (a.c.empty() && a.controller.has_settings()) {
    throw BadInput(
        "settings of a controller: expected --c with them, the only export of controllers");
  }
  const auto expect_no_page = [&](const char* flag, bool is_given) {
    if (a.page.empty() || !is_given) return;
    throw BadInput(Concat(flag, ": expected --c or --onnx with it, got --page"));
  };
  expect_no_page("--control-period", a.controller.control_period > 0);
  expect_no_page("--plant", !a.plant.empty());
  if (!a.onnx.empty()) return ExportOnnx(a);
  if (!a.c.empty()) return ExportC(a);
  return ExportPage(a);
}

}  // namespace

void AddExport(CommandLine& line) {
  ExportArguments& a = line.Runs(RunExport);
  line.Texts("policies", a.policies, "POLICY|RUN",
             Concat("policies: policy.safetensors, run folders or shipped policies; for --c also "
                    "controllers (",
                    Join(ControllersInC(), ", "), ")"));
  AddControllers(line, a.controller);
  AddPlant(line, a.plant);
  line.Text(
      "--onnx", a.onnx, "FILE",
      "ONNX file to write, which maps observations to torques and values; -: standard output");
  line.Text(
      "--c", a.c, "FILE.h",
      "C99 header to write for a microcontroller, which maps angles and velocities to torques; "
      "-: standard output");
  line.Text("--prefix", a.prefix, "NAME",
            "prefix of all names in the C header (default the file name)", "a name");
  line.Flag("--overwrite", a.overwrite, "replace a file that is no export");
  line.Text("--page", a.page, "FOLDER",
            "folder of the page's agents to write into; replaces agents with the same ID");
  line.Text("--id", a.id, "ID",
            "ID of a single policy in the page (default name of the run, or agent)", "an ID");
  line.Excludes("--page", {"--onnx", "--c", "--overwrite"});
  line.Excludes("--onnx", {"--c"});
  line.Excludes("--id", {"--onnx", "--c"});
  Options own;
  DescribeControlPeriod(own, &a.controller.control_period);
  own.Add(&a.checkpoints, "checkpoints", {2, 100}, "",
          "number of policies per agent in the page, from untrained to trained; trains the agent "
          "again; Q-networks only")
      .usual = "none";
  line.Arguments(own);
  line.Notes("`./upswing demo runs/d3qn-seed1` adds a policy to the page and serves the page.\n");
  line.Examples(
      "  ./upswing export runs/d3qn-seed1 --onnx policy.onnx\n"
      "  ./upswing export fast --c policy.h                     a shipped policy as C\n"
      "  ./upswing export tvlqr --c tvlqr.h                     a controller as C\n"
      "  ./upswing export sac --plant cm5.toml --c policy.h     for a plant of another size\n"
      "  ./upswing export runs/d3qn-seed1 --page web/public/agents    for every visitor\n"
      "  ./upswing export runs/* --page build/web/agents        in the page built here\n"
      "  ./upswing export policy.safetensors --id mine --page build/web/agents\n"
      "  ./upswing export runs/d3qn-seed1 --page web/public/agents --checkpoints 10\n");
}

}  // namespace upswing::deploy
