#include "rl/train.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "apps/commands.h"
#include "apps/config.h"
#include "apps/config_checks.h"
#include "apps/help.h"
#include "apps/loaded_policy.h"
#include "apps/many_runs.h"
#include "apps/run_log.h"
#include "apps/seeds.h"
#include "apps/signals.h"
#include "apps/streams.h"
#include "apps/train_view.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCheckpointFormat = "upswing-checkpoint-1";

// ---- How a run is made or found.

/// What was typed.
struct TrainArguments {
  std::string config, out, resume, seeds;
  int64_t jobs = 0;  // 0: as many as there are processors
  bool print_config = false;
  std::vector<FlagValue> flags;
};

/// A folder under runs/ that is not there yet.
fs::path FreeRunFolder(const Config& config) {
  const std::string base = fmt::format("runs/{}-seed{}", config.agent, config.train.seed);
  fs::path path = base;
  for (int i = 2; fs::exists(path); ++i) path = fmt::format("{}-{}", base, i);
  return path;
}

/// Throws unless the checkpoint is one of this program's version and of these settings.
void CheckCheckpoint(const TensorFile& checkpoint, const Config& config) {
  const auto expect = [&](const std::string& key, std::string_view expected) {
    const std::string& got = checkpoint.Metadata(key);
    if (got != expected) {
      throw BadInput(
          Concat(checkpoint.path(), ": ", key, ": expected \"", expected, "\", got \"", got, "\""));
    }
  };
  expect("format", kCheckpointFormat);
  expect("upswing_version", UPSWING_VERSION);
  Config old_config;
  Config new_config = config;
  const Options old_options = OptionsOf(old_config);
  const Options new_options = OptionsOf(new_config);
  ApplyToml(old_options, checkpoint.Metadata("config"), checkpoint.path());
  ExpectSameSettings(old_options, new_options, checkpoint.path(),
                     [](const Option& option) { return option.identity; });
  if (checkpoint.Metadata("model") != config.mjcf) {
    throw BadInput(Concat(checkpoint.path(), ": made with another model than ", config.model));
  }
}

/// Everything that a training is made of, built from its settings.
struct Parts {
  Config config;
  ThreadPool pool;
  PendulumEnv env;
  Dqn agent;
  TrainState state;

  Parts(const Config& c, int threads)
      : config(c),
        pool(threads),
        env(c.Environments(pool)),
        agent(c.Agent(env, pool)),
        state(env.num_envs(), kRewardTerms) {}

  /// Evaluation from fresh starts with the reward's standard weights, on the training plant or,
  /// where plants are random, on a fresh one for each episode; disturbed as in training.
  Evaluation Judge(const Policy& policy, int64_t step) {
    // The closed form finds a failing policy quickly; one that passes is evaluated in MuJoCo.
    const bool screened = config.eval_physics == kScreened;
    if (screened && config.mjcf.empty()) {
      Evaluation screening = JudgeIn(PhysicsEngine::kClosedForm, policy, step);
      if (!screening.all_succeeded()) return screening;
    }
    return JudgeIn(
        screened ? PhysicsEngine::kMuJoCo : ParsePhysics(config.eval_physics, "--eval-physics"),
        policy, step);
  }

  Evaluation JudgeIn(PhysicsEngine physics, const Policy& policy, int64_t step) {
    PendulumEnvConfig judge = config.Environments(pool);
    judge.physics = physics;
    judge.num_envs = static_cast<int>(config.train.eval_episodes);
    judge.episode_seconds = kEvaluationSeconds;
    judge.start = StartStates();
    judge.weights = RewardWeights();
    judge.stream = Concat("evaluation at step ", step);
    PendulumEnv env_of_judge(judge);
    return Evaluate(policy, env_of_judge, &pool);
  }

  std::map<std::string, std::string> CheckpointMetadata() const {
    return {{"format", std::string(kCheckpointFormat)},
            {"upswing_version", UPSWING_VERSION},
            {"config", ConfigToml(config, true)},
            {"model", config.mjcf}};
  }
};

/// Logs a failure; the disk may be full, which may itself be the failure.
void LogIfPossible(RunFolder& run, const std::string& line) {
  try {
    run.Log(line);
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): the user sees the line anyway
  }
}

/// Makes the folder of a new run, with its first checkpoint.
fs::path MakeRun(const TrainArguments& arguments, Parts& parts) {
  const Config& config = parts.config;
  fs::path path = arguments.out.empty() ? FreeRunFolder(config) : fs::path(arguments.out);
  std::vector<std::pair<std::string, std::string>> files{
      {"config.toml", ConfigToml(config, false)}};
  if (!config.mjcf.empty()) files.emplace_back(kModelCopy, config.mjcf);
  RunFolder::Create(path, files, [&](TensorFile& checkpoint) {
    checkpoint.metadata = parts.CheckpointMetadata();
    CheckpointState(Archive::Saver(checkpoint), parts.agent, parts.env, parts.state);
  });
  return path;
}

/// Trains from the run's checkpoint, which a new run has too. Returns the exit code.
int TrainRun(const fs::path& path, Parts& parts, bool resuming, bool steps_given) {
  auto checkpoint = std::make_optional(TensorFile::Load(RunFolder::CheckpointPath(path)));
  CheckCheckpoint(*checkpoint, parts.config);
  CheckpointState(Archive::Loader(*checkpoint), parts.agent, parts.env, parts.state);
  if (resuming && steps_given && parts.config.train.steps < parts.state.steps) {
    throw BadInput(Concat("--steps: the run is at step ", parts.state.steps,
                          " already; expected at least that in all, got ",
                          parts.config.train.steps));
  }
  RunFolder run(path, *checkpoint);
  checkpoint.reset();  // as large as the training itself
  if (resuming) WriteFileAtomically(path / "config.toml", ConfigToml(parts.config, false));

  Training training{parts.config.train, parts.agent, parts.env, run};
  training.evaluate = [&](const Policy& p, int64_t step) { return parts.Judge(p, step); };
  training.policy_info = InfoOf(parts.config);
  training.checkpoint_metadata = parts.CheckpointMetadata();
  training.poll = PollSignals;
  TrainView view(parts.state, parts.agent.Report());
  view.Follow(training);

  view.Announce(parts.config, parts.pool.threads(), parts.agent.online().size(), path);
  const WorkClock clock;
  run.Log(BeginLine(parts.state.steps > 0, parts.state.steps, parts.pool.threads()));
  bool finished = false;
  try {
    finished = Train(training, parts.state);
  } catch (const Error& error) {
    LogIfPossible(run, error.what());
    throw;
  }
  run.Log(EndLine(finished, parts.state.steps, parts.pool.threads(), clock));
  view.Summarize(parts.state, parts.config.train, path, finished);
  return finished ? 0 : 128 + StopSignal();
}

bool StepsGiven(const TrainArguments& arguments) {
  return std::ranges::any_of(arguments.flags,
                             [](const FlagValue& flag) { return flag.name == "steps"; });
}

/// The same settings with many seeds.
int RunSeeds(const TrainArguments& arguments) {
  ManyRuns plan;
  plan.variants = {{"", BuildConfig(arguments.config, arguments.flags)}};
  Config& config = plan.variants.front().config;
  MakeReadyForMany(config);
  plan.what = config.agent;
  plan.folder = arguments.out.empty() ? fs::path("runs") / config.agent : fs::path(arguments.out);
  plan.seeds = ParseSeeds(arguments.seeds, "--seeds");
  plan.jobs = arguments.jobs > 0 ? arguments.jobs : DefaultJobs(config.train.threads);
  plan.more_steps = StepsGiven(arguments);
  CheckMemory(config, plan.jobs);
  return TrainMany(plan);
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
  const bool resuming = !arguments.resume.empty();
  fs::path path = arguments.resume;
  if (resuming && !fs::exists(path / "config.toml")) {
    throw BadInput(
        Concat("--resume ", path.string(), ": expected a run folder with a config.toml"));
  }
  std::optional<FolderLock> lock;
  if (resuming) lock.emplace(path);  // before anything of it is read

  Config config = resuming ? ReadRunConfig(path, arguments.flags)
                           : BuildConfig(arguments.config, arguments.flags);
  if (!config.mjcf.empty()) config.model = kModelCopy;
  CheckMemory(config);
  Parts parts(config, ResolveThreads(config.train.threads));
  InstallSignalHandlers(kStoppingTraining);  // what is begun from here on ends in order
  if (!resuming) {
    path = MakeRun(arguments, parts);
    lock.emplace(path);
  }
  return TrainRun(path, parts, resuming, StepsGiven(arguments));
}

/// Throws if flags for many runs are combined with flags for a single one.
void CheckManyArguments(const CLI::App& app) {
  if (app.count("--seeds") > 0) {
    for (const std::string other : {"--seed", "--resume"}) {
      if (app.count(other) > 0)
        throw BadInput(Concat("--seeds: expected no ", other, " beside it"));
    }
  } else if (app.count("--jobs") > 0) {
    throw BadInput("--jobs: expected --seeds beside it");
  }
}

/// Lets --help show the defaults of the agent and the configuration file that were given.
void ShowDefaultsOfWhatIsChosen(CLI::App& app) {
  const auto last_of = [&](const char* flag) -> std::string {
    const std::vector<std::string> values = app.get_option(flag)->results();
    return values.empty() ? "" : values.back();
  };
  std::vector<FlagValue> flags;
  if (const std::string agent = last_of("--agent"); !agent.empty()) flags = {{"agent", agent}};
  Config config = BuildConfig(last_of("--config"), flags);
  ShowDefaults(app, OptionsOf(config));
}

/// The named agents, a paragraph each.
std::string AgentsText() {
  std::string text =
      "Defaults are those of the agent (and file) given: train --agent fast --help.\n\n"
      "Named agents:\n";
  constexpr size_t kIndent = 20;
  for (const auto& [name, what] : NamedAgents()) {
    text += fmt::format("  {:<18}{}\n", name, WrapText(what, kHelpColumns, kIndent));
  }
  return text;
}

}  // namespace

void AddTrain(CLI::App& program, Command& command) {
  CLI::App* app = program.add_subcommand("train", "Train an agent until the task is solved");
  auto arguments = std::make_shared<TrainArguments>();
  app->add_option("--out", arguments->out,
                  "run folder to make [runs/AGENT-seedSEED];\n"
                  "with --seeds the folder of all of them [runs/AGENT]")
      ->type_name("FOLDER")
      ->check(NotEmpty());
  app->add_option("--config", arguments->config,
                  "TOML file of settings, - for standard input; flags override it")
      ->type_name("FILE")
      ->check(NotEmpty());
  app->add_option("--resume", arguments->resume,
                  "resume a run from its checkpoint; --steps, --threads, --checkpoint-every and\n"
                  "--stop-when-solved may be given again; a solved run continues with "
                  "--no-stop-when-solved")
      ->type_name("RUN")
      ->check(NotEmpty());
  app->add_flag("--print-config", arguments->print_config,
                "print the settings of this training as a TOML file for --config, and end")
      ->disable_flag_override();
  AddManyOptions(*app, arguments->seeds, arguments->jobs);
  Config defaults;
  AddSettings(*app, OptionsOf(defaults), arguments->flags);
  app->formatter(std::make_shared<HelpFormatter>([app] { ShowDefaultsOfWhatIsChosen(*app); }));
  app->footer(
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
  app->callback([app, arguments, &command] {
    if (app->count("--resume") > 0 && app->count("--out") + app->count("--config") > 0) {
      throw BadInput(
          "--resume: takes settings and folder from the run; expected neither --out nor "
          "--config beside it");
    }
    CheckManyArguments(*app);
    command = [arguments] { return RunTrain(*arguments); };
  });
}

}  // namespace upswing
