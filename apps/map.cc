#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <numeric>

#include "apps/commands.h"
#include "apps/map_table.h"
#include "apps/progress.h"
#include "core/error.h"
#include "core/text.h"
#include "core/thread_pool.h"
#include "io/file.h"
#include "io/machine.h"
#include "lab/config.h"
#include "lab/format.h"
#include "lab/loaded_policy.h"
#include "lab/map_grid.h"
#include "lab/trial.h"
#include "mujoco/engines.h"
#include "report/figure.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int64_t kMostEpisodes = 10000000;

struct MapArguments {
  PolicyArguments policy;
  std::string x = "mass2=-50%:+50%", y = "length2=-50%:+50%", physics, out;
  std::vector<std::string> set;
  int64_t episodes;  // 0: not given
  int64_t threads, seed;
  double check;
  bool unknown_plant = false, as_json = false;
};

/// What a policy was trained on, or a controller made for.
struct Training {
  MapPoint point;               // plant and disturbance; hanging
  Randomization randomization;  // around them
  bool known = false;           // the file says more than the plant
  std::string word;             // "training" or "design"
};

Training TrainingOf(const LoadedPolicy& loaded) {
  Training training;
  training.point.plant = loaded.plant;
  training.word = loaded.origin();
  if (loaded.path.empty()) {
    training.known = true;  // for no noise, no delay, nothing random
    return training;
  }
  const std::string& settings = loaded.policy->info().config;
  if (settings.empty()) return training;
  try {
    const Config config = ConfigIn(settings, "config");
    training.point.disturbance = config.disturbance;
    training.randomization = config.randomization;
    training.known = true;
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): written by another version
  }
  return training;
}

/// Whether an axis sets this setting.
bool OnAxis(const MapConfig& config, const Option& option) {
  MapPoint point;
  const Options options = OptionsOf(point);
  return std::ranges::any_of(std::array{&config.x, &config.y}, [&](const MapAxis* axis) {
    return std::ranges::any_of(options.Find(axis->name, "map"),
                               [&](const Option* member) { return member->name == option.name; });
  });
}

/// What no axis sets and is not as in the training: `mass1 1.2 kg (training: 1), …`.
std::string ChangesOf(const MapConfig& config, const Training& training) {
  MapPoint now = config.point, before = training.point;
  const Options options = OptionsOf(now), usual = OptionsOf(before);
  std::vector<std::string> texts;
  for (size_t k = 0; k < options.all().size(); ++k) {
    const Option& option = options.all()[k];
    const double value = *std::get<double*>(option.target);
    const double then = *std::get<double*>(usual.all()[k].target);
    if (value == then || OnAxis(config, option)) continue;
    texts.push_back(fmt::format("{} {:.4g} {}", option.name, value, option.unit));
    if (option.section == "start") continue;
    texts.back() += fmt::format(" ({}: {:.4g})", training.word, then);
  }
  if (config.assumed_plant) texts.emplace_back("the plant unknown to the policy");
  return Join(texts, ", ");
}

/// Label of the training's place on the axes, as far as it holds there.
std::string DotOf(const MapConfig& config, const Training& training, bool changed) {
  const MapAxis &x = config.x, &y = config.y;
  if (x.start && y.start && !changed) return "hanging";
  if (training.randomization.any()) return "middle of the training's range";
  if (!changed && !config.start_given && training.known) {
    return Concat("as in ", training.word);
  }
  const auto piece = [&](const MapAxis& axis) {
    return Concat(axis.name, axis.start ? " hanging" : Concat(" as in ", training.word));
  };
  return Concat(piece(x), ", ", piece(y));
}

MapConfig ConfigOf(const MapArguments& a, const LoadedPolicy& loaded, const Training& training) {
  MapConfig config;
  config.point.plant = loaded.plant;
  config.mjcf = loaded.mjcf;
  if (a.unknown_plant) config.assumed_plant = loaded.plant;
  config.x = ParseMapAxis(a.x, training.point, "--x");
  config.y = ParseMapAxis(a.y, training.point, "--y");
  CheckDifferent(config.x, config.y);
  const Options options = OptionsOf(config.point);
  for (MapAxis* axis : {&config.x, &config.y}) {
    const bool in_plant = options.Find(axis->name, "map").front()->section != "disturbance";
    if (!in_plant && !training.known) axis->at_training.reset();
  }
  for (const Option* option : ApplyChanges(options, a.set)) {
    config.start_given |= option->section == "start";
    for (const MapAxis* axis : {&config.x, &config.y}) {
      const auto members = options.Find(axis->name, "map");
      if (std::ranges::find(members, option) == members.end()) continue;
      throw BadInput(Concat("--set ", option->name, ": expected another name, ", axis->name,
                            " is an axis of the map"));
    }
  }
  config.start_given |= config.x.start || config.y.start;
  // From one start each episode is the same, unless there is noise.
  const int usual = config.start_given ? 1 : 10;
  config.episodes = a.episodes > 0 ? static_cast<int>(a.episodes) : usual;
  config.engine = &FindEngine(a.physics, "--physics");
  config.seed = static_cast<uint64_t>(a.seed);
  if (config.cells() * config.episodes > kMostEpisodes) {
    throw BadInput(Concat("map: expected at most ", FormatCount(kMostEpisodes), " episodes, got ",
                          FormatCount(config.cells()), " cells of ", config.episodes));
  }
  return config;
}

/// Runs cells behind a progress line.
std::vector<MapCell> RunCells(const MapConfig& config, const Policy& policy,
                              std::span<const int64_t> cells, ThreadPool& pool, bool quiet) {
  EpisodeProgress progress(static_cast<double>(cells.size()) * config.episodes, quiet);
  return RunMap(config, policy, cells, pool, [&](double share) { progress.Show(share); });
}

int RunMapCommand(const MapArguments& a) {
  const LoadedPolicy loaded = GetPolicy(a.policy);
  if (loaded.task != kDoublePendulum) {
    throw BadInput(
        Concat("map: expected a policy of the double pendulum, whose plant and start are ",
               "the axes, got one of ", loaded.task));
  }
  MapResult map;
  const Training training = TrainingOf(loaded);
  map.config = ConfigOf(a, loaded, training);
  map.changes = ChangesOf(map.config, training);
  map.dot = DotOf(map.config, training, !map.changes.empty());
  map.policy = loaded.name;
  map.physics = a.physics;
  map.model = InfoOfModel(loaded.mjcf, "");
  const fs::path folder =
      FigureFolder(a.out, loaded, Concat("map-", map.config.x.name, "-", map.config.y.name));
  CheckCanDraw();

  ThreadPool pool(ResolveThreads(a.threads));
  std::vector<int64_t> all(static_cast<size_t>(map.config.cells()));
  std::iota(all.begin(), all.end(), int64_t{0});
  const auto begin = Clock::now();
  map.cells = RunCells(map.config, *loaded.policy, all, pool, a.as_json);
  map.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  if (map.config.engine != &kMuJoCo) {
    map.checked = DrawCells(map.config, a.check);
    MapConfig mujoco = map.config;
    mujoco.engine = &kMuJoCo;
    map.in_mujoco = RunCells(mujoco, *loaded.policy, map.checked, pool, a.as_json);
  }

  MakeNewFolder(folder);
  WriteMap(map, folder);
  if (a.as_json) {
    fmt::print("{}\n", MapJson(map));
  } else {
    PrintMapTable(map);
  }
  return 0;
}

}  // namespace

void AddMap(CLI::App& program, Command& command) {
  CLI::App* app =
      program.add_subcommand("map", "Map how a policy does on other plants or from other starts");
  auto a = std::make_shared<MapArguments>();
  AddPolicy(*app, a->policy)->required();
  constexpr const char* kAxis = "NAME=FROM:TO[:CELLS]";
  app->add_option("--x", a->x, "horizontal axis [mass2=-50%:+50%:31]")->type_name(kAxis);
  app->add_option("--y", a->y, "vertical axis [length2=-50%:+50%:31]")->type_name(kAxis);
  Options own;
  own.Add(&a->episodes, "episodes", 0, {1, 100000}, "", "in a cell").usual =
      "10, or 1 where the start is given";
  own.Add(&a->check, "check", 0.02, kUnit, "", "share of the cells to repeat in MuJoCo");
  AddArguments(*app, own);
  AddSet(*app, a->set, "what is on neither axis, such as gravity=9.7");
  AddPhysics(*app, a->physics, "closed-form");
  AddUnknownPlant(*app, a->unknown_plant);
  app->add_option("--out", a->out, "new folder for map.csv, map.svg and map.png [RUN/map-X-Y]")
      ->type_name("FOLDER")
      ->check(NotEmpty());
  AddSeed(*app, a->seed, "starts and noise");
  AddThreads(*app, a->threads);
  app->add_flag("--json", a->as_json, "print JSON instead of a table")->disable_flag_override();
  app->footer(
      "Axes and --set take mass1, mass2, length1, length2, damping1, damping2 (mass, length,\n"
      "damping for both), gravity, torque_limit, sensor_noise (rad, rad/s), delay (s, in whole\n"
      "control periods of 0.02 s; each is a cell), and the start: q1, q2 (degrees), w1, w2\n"
      "(rad/s). Percentages are on top of the training's value. An episode is that of `upswing\n"
      "eval`; with a start, every episode begins exactly there; what of it is not given is 0\n"
      "(hanging, at rest). Energy and height in the observation are scaled by the cell's own\n"
      "plant, which reveals it to the policy; with --unknown-plant by the plant of the training.\n"
      "Without --out a map goes into map-X-Y in the run's folder, or into runs/map-X-Y-NAME for a\n"
      "policy file elsewhere; then map-X-Y-2, …\n\n"
      "Examples:\n"
      "  ./upswing map runs/d3qn-seed1\n"
      "  ./upswing map runs/d3qn-seed1 --x mass=0.8:1.2 --y damping=0:0.4:21 --episodes 20\n"
      "  ./upswing map runs/d3qn-seed1 --x sensor_noise=0:0.1 --y delay=0:0.1:6\n"
      "  ./upswing map runs/d3qn-seed1 --x q1=-180:180:73 --y q2=-180:180:73    from any angle\n"
      "  ./upswing map lqr --x q1=150:210:121 --y q2=-30:30:121    from where does it catch?\n");
  app->callback([a, &command] { command = [a] { return RunMapCommand(*a); }; });
}

}  // namespace upswing
