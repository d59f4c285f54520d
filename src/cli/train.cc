#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "agents/config.h"
#include "agents/config_checks.h"
#include "base/error.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/compare_report.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "cli/train_many.h"
#include "cli/train_view.h"
#include "os/host.h"
#include "os/streams.h"
#include "runs/config_files.h"
#include "runs/plant_file.h"
#include "runs/seeds.h"
#include "runs/training_run.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// The arguments of `train`.
struct TrainArguments {
  std::string config, plant, out, resume, seeds;
  int64_t jobs = 0;  // 0: one per processor
  bool print_config = false;
  std::vector<FlagValue> flags;

  /// The settings of a new training.
  Config BuildSettings() const {
    std::vector<FlagValue> all = flags;
    if (!plant.empty()) all.push_back({"plant", plant});
    return BuildConfig(config, all);
  }
};

/// Trains one agent with many seeds.
int RunSeeds(const TrainArguments& arguments) {
  ManyRuns many;
  StudyPlan& plan = many.plan;
  plan.variants = {{"", arguments.BuildSettings()}};
  Config& config = plan.variants.front().config;
  MakeReadyForMany(config);
  many.what = config.agent;
  plan.folder = arguments.out.empty() ? fs::path("runs") / config.agent : fs::path(arguments.out);
  plan.seeds = ParseSeeds(arguments.seeds, "--seeds");
  if (const auto before = PlanBefore(plan.folder)) SayKeptSeeds(KeepFinishedSeeds(*before, plan));
  many.jobs = arguments.jobs > 0 ? arguments.jobs : DefaultJobs(config.train.threads);
  many.more_steps = StepsGiven(arguments.flags);
  CheckMemory(config, AvailableMemory(), many.jobs);
  const int exit_code = TrainMany(many);
  if (exit_code == 0) PrintComparison(CompareRuns(plan));
  return exit_code;
}

/// Prints the settings that the training would use.
int PrintConfig(const TrainArguments& arguments) {
  const Config config = arguments.resume.empty() ? arguments.BuildSettings()
                                                 : ReadRunConfig(arguments.resume, arguments.flags);
  WriteOutput("-", ConfigToml(config, false));
  return 0;
}

int RunTrain(const TrainArguments& arguments) {
  if (arguments.print_config) return PrintConfig(arguments);
  if (!arguments.seeds.empty()) return RunSeeds(arguments);
  // A signal may interrupt the reading of settings; a training instead ends with a checkpoint.
  std::optional<Config> config;
  if (arguments.resume.empty()) config = arguments.BuildSettings();
  InstallSignalHandlers(kStoppingTraining);
  const std::unique_ptr<TrainingRun> run =
      config ? TrainingRun::Make(arguments.out, std::move(*config))
             : TrainingRun::Resume(arguments.resume, arguments.flags);
  if (!arguments.plant.empty()) {
    const std::string left_out = ReadPlantFile(arguments.plant).left_out;
    if (!left_out.empty()) Say("Defaults that the plant file leaves out: {}\n", left_out);
  }
  return TrainAndShow(*run) ? 0 : 128 + StopSignal();
}

/// Lets --help show the defaults of the given agent and file, or of the given run.
void ShowChosenDefaults(const CommandLine& line, const CommandLine::ShowOptions& show) {
  std::vector<FlagValue> flags;
  // --algorithm without --agent shows the agent with the algorithm's name.
  for (const char* flag : {"--algorithm", "--agent"}) {
    if (const std::string agent = line.Last(flag); !agent.empty()) flags = {{"agent", agent, flag}};
  }
  if (const std::string plant = line.Last("--plant"); !plant.empty()) {
    flags.push_back({"plant", plant});
  }
  const std::string run = line.Last("--resume"),
                    file = line.Last("--config");  // "-": standard input
  Config config = run.empty() ? BuildConfig(file == "-" ? "" : file, flags) : ReadRunConfig(run);
  show(EverySetting(), KnownOptions(config));
}

/// The named agents, one paragraph each.
std::string AgentsText() {
  std::string text =
      "The help shows the settings and defaults of the given agent and file:\n"
      "  ./upswing train --agent sac --help\n\n"
      "Named agents:\n";
  constexpr size_t kIndent = 20;
  for (const auto& [name, what] : NamedAgents()) {
    text += fmt::format("  {:<18}{}\n", name, WrapText(what, HelpColumns(), kIndent));
  }
  return text;
}

}  // namespace

void AddTrain(CommandLine& line) {
  TrainArguments& arguments = line.Runs(RunTrain);
  line.Text("--out", arguments.out, "FOLDER",
            "new run folder (default runs/AGENT-seedSEED); with --seeds the folder of all runs "
            "(default runs/AGENT)");
  line.Text("--config", arguments.config, "FILE",
            "TOML file of settings; -: standard input; flags override the file");
  AddPlant(line, arguments.plant);
  line.Text("--resume", arguments.resume, "RUN",
            "run to resume from its checkpoint; only --steps, --threads, --checkpoint-every and "
            "--stop-when-solved may change; a solved run continues with --no-stop-when-solved");
  line.Flag("--print-config", arguments.print_config,
            "print the settings of this training as TOML for --config, and exit");
  AddManyOptions(line, arguments.seeds, arguments.jobs);
  line.Settings(EverySetting(), arguments.flags);
  line.ShowSettings(
      [&line](const CommandLine::ShowOptions& show) { ShowChosenDefaults(line, show); });
  line.Examples(
      "  ./upswing train                         train the default agent until solved\n"
      "  ./upswing train --agent dqn --seed 3 --out runs/a\n"
      "  ./upswing train --gamma 0.98 --hidden 128,128             set any setting\n"
      "  ./upswing train --mass2 1.2 --no-stop-when-solved --steps 500000\n"
      "  ./upswing train --plant realaigym --gravity 9.7 --out runs/board\n"
      "  ./upswing train --randomize 0.25 --delay 0.02  draw a plant for each episode\n"
      "  ./upswing train --resume runs/a --no-stop-when-solved --steps 2000000\n"
      "  ./upswing train --agent fast --print-config > my.toml     edit, then --config\n"
      "  ./upswing train --seeds 10              train or resume runs/d3qn/seed1 to 10\n"
      "  ./upswing train --seeds 3,5,8-12 --jobs 2 --out runs/many\n");
  line.Notes(AgentsText() +
             "\nThe built-in reward as an expression, to change it (docs/howto/reward.md):\n"
             "  --reward \"energy: E; height: h; balance: 5*inverted;\n"
             "    velocity: -0.01*inverted*(w1*w1 + w2*w2);\n"
             "    torque: -(0.01 + 0.04*inverted)*tau*tau\"\n"
             "\nSIGINT and SIGTERM write a checkpoint and end the program with exit code 130 or\n"
             "143. SIGUSR1 writes a checkpoint, and the training continues. Other exit codes:\n"
             "0: done; 1: failed; 2: bad usage or input.\n");
  line.Excludes("--resume", {"--out", "--config", "--plant"},
                ": the run has its own settings and folder");
  line.Excludes("--seeds", {"--seed", "--resume"});
  line.Check([&arguments] {
    if (arguments.jobs == 0 || !arguments.seeds.empty()) return;
    throw BadInput("--jobs: expected --seeds with it, got none");
  });
}

}  // namespace upswing
