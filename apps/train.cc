#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "apps/commands.h"
#include "apps/many_runs_view.h"
#include "apps/signals.h"
#include "apps/train_view.h"
#include "core/error.h"
#include "core/text.h"
#include "io/machine.h"
#include "io/streams.h"
#include "run/config_files.h"
#include "run/training_run.h"
#include "setup/config.h"
#include "setup/config_checks.h"
#include "study/many_runs.h"
#include "study/seeds.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// What was typed.
struct TrainArguments {
  std::string config, out, resume, seeds;
  int64_t jobs = 0;  // 0: as many as there are processors
  bool print_config = false;
  std::vector<FlagValue> flags;
};

/// The same settings with many seeds.
int RunSeeds(const TrainArguments& arguments) {
  ManyRuns many;
  StudyPlan& plan = many.plan;
  plan.variants = {{"", BuildConfig(arguments.config, arguments.flags)}};
  Config& config = plan.variants.front().config;
  MakeReadyForMany(config);
  many.what = config.agent;
  plan.folder = arguments.out.empty() ? fs::path("runs") / config.agent : fs::path(arguments.out);
  plan.seeds = ParseSeeds(arguments.seeds, "--seeds");
  many.jobs = arguments.jobs > 0 ? arguments.jobs : DefaultJobs(config.train.threads);
  many.more_steps = StepsGiven(arguments.flags);
  CheckMemory(config, AvailableMemory(), many.jobs);
  return TrainManyAndShow(many);
}

/// Prints the settings that the training would have.
int PrintConfig(const TrainArguments& arguments) {
  const Config config = arguments.resume.empty() ? BuildConfig(arguments.config, arguments.flags)
                                                 : ReadRunConfig(arguments.resume, arguments.flags);
  WriteOutput("-", CompleteToml(config));
  return 0;
}

int RunTrain(const TrainArguments& arguments) {
  if (arguments.print_config) return PrintConfig(arguments);
  if (!arguments.seeds.empty()) return RunSeeds(arguments);
  // What is read before anything is begun may be interrupted; what is begun ends in order.
  std::optional<Config> config;
  if (arguments.resume.empty()) config = BuildConfig(arguments.config, arguments.flags);
  InstallSignalHandlers(kStoppingTraining);
  const std::unique_ptr<TrainingRun> run =
      config ? TrainingRun::Make(arguments.out, std::move(*config))
             : TrainingRun::Resume(arguments.resume, arguments.flags);
  return TrainAndShow(*run) ? 0 : 128 + StopSignal();
}

/// Throws if flags for many runs are combined with flags for a single one.
void CheckManyArguments(const CommandLine& line) {
  if (line.Has("--seeds")) {
    for (const std::string other : {"--seed", "--resume"}) {
      if (line.Has(other)) throw BadInput(Concat("--seeds: expected no ", other, " beside it"));
    }
  } else if (line.Has("--jobs")) {
    throw BadInput("--jobs: expected --seeds beside it");
  }
}

/// Lets --help show the defaults of the agent and the file, or of the run, that were given.
void ShowDefaultsOfWhatIsChosen(const CommandLine& line, const CommandLine::ShowOptions& show) {
  std::vector<FlagValue> flags;
  // --algorithm without --agent shows the agent of that name.
  for (const char* flag : {"--algorithm", "--agent"}) {
    if (const std::string agent = line.Last(flag); !agent.empty()) flags = {{"agent", agent, flag}};
  }
  const std::string run = line.Last("--resume"),
                    file = line.Last("--config");  // "-": standard input
  Config config = run.empty() ? BuildConfig(file == "-" ? "" : file, flags) : ReadRunConfig(run);
  Config scratch;
  show(EverySetting(scratch), KnownOptions(config));
}

/// The named agents, a paragraph each.
std::string AgentsText() {
  std::string text =
      "Settings and defaults are those of the agent (and file) given: train --agent sac --help.\n\n"
      "Named agents:\n";
  constexpr size_t kIndent = 20;
  for (const auto& [name, what] : NamedAgents()) {
    text += fmt::format("  {:<18}{}\n", name, WrapText(what, kHelpColumns, kIndent));
  }
  return text;
}

}  // namespace

void AddTrain(CommandLine& line) {
  TrainArguments& arguments = line.Runs(RunTrain);
  line.Text("--out", arguments.out, "FOLDER",
            "run folder to make [runs/AGENT-seedSEED];\n"
            "with --seeds the folder of all of them [runs/AGENT]");
  line.Text("--config", arguments.config, "FILE",
            "TOML file of settings, - for standard input; flags override it");
  line.Text("--resume", arguments.resume, "RUN",
            "resume a run from its checkpoint; --steps, --threads, --checkpoint-every and\n"
            "--stop-when-solved may be given again; a solved run continues with "
            "--no-stop-when-solved");
  line.Flag("--print-config", arguments.print_config,
            "print the settings of this training as a TOML file for --config, and end");
  AddManyOptions(line, arguments.seeds, arguments.jobs);
  Config defaults;
  line.Settings(EverySetting(defaults), arguments.flags);
  line.ShowSettings(
      [&line](const CommandLine::ShowOptions& show) { ShowDefaultsOfWhatIsChosen(line, show); });
  line.Footer(
      AgentsText() +
      "\nExamples:\n"
      "  ./upswing train                                  the default agent, until solved\n"
      "  ./upswing train --agent dqn --seed 3 --out runs/a\n"
      "  ./upswing train --gamma 0.98 --hidden 128,128    any setting as a flag\n"
      "  ./upswing train --mass2 1.2 --no-stop-when-solved --steps 500000\n"
      "  ./upswing train --randomize 0.25 --delay 0.02    a new random plant each episode\n"
      "  ./upswing train --resume runs/a --no-stop-when-solved --steps 2000000   resume\n"
      "  ./upswing train --agent fast --print-config > my.toml   then edit, and train --config\n"
      "  ./upswing train --seeds 10                       in runs/d3qn/seed1 to seed10, in\n"
      "                                                   parallel; the same command resumes\n"
      "  ./upswing train --seeds 3,5,8-12 --jobs 2 --out runs/many\n"
      "\nSIGINT and SIGTERM write a checkpoint and end with 130 and 143; SIGUSR1 writes one\n"
      "and continues. Exit code 0: done; 1: failed; 2: bad usage or input.\n");
  line.Check([&line] {
    if (line.Has("--resume") && (line.Has("--out") || line.Has("--config"))) {
      throw BadInput(
          "--resume: takes settings and folder from the run; expected neither --out nor "
          "--config beside it");
    }
    CheckManyArguments(line);
  });
}

}  // namespace upswing
