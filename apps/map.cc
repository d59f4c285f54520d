#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <numeric>
#include <optional>

#include "apps/commands.h"
#include "apps/config.h"
#include "apps/loaded_policy.h"
#include "apps/map_grid.h"
#include "apps/map_output.h"
#include "apps/progress.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"
#include "report/figure.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int64_t kMostEpisodes = 10000000;

struct MapArguments {
  std::string policy, x = "mass2=-50%:+50%", y = "length2=-50%:+50%", physics, out;
  std::vector<std::string> set;
  int64_t episodes;  // 0: not given
  int64_t threads, seed;
  double check;
  bool as_json = false;
};

/// The plant that a policy was trained on, with the disturbance where its file tells.
MapPoint TrainingPoint(const LoadedPolicy& loaded) {
  MapPoint point;
  point.plant = loaded.plant;
  const std::string& settings = loaded.policy.info().config;
  if (settings.empty()) return point;
  Config config;
  try {
    ApplyToml(OptionsOf(config), settings, "config");
    point.disturbance = config.disturbance;
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): written by another version
  }
  return point;
}

MapConfig ConfigOf(const MapArguments& a, const LoadedPolicy& loaded) {
  MapConfig config;
  config.point.plant = loaded.plant;
  config.mjcf = loaded.mjcf;
  const MapPoint training = TrainingPoint(loaded);
  config.x = ParseMapAxis(a.x, training, "--x");
  config.y = ParseMapAxis(a.y, training, "--y");
  CheckDifferent(config.x, config.y);
  const Options options = OptionsOf(config.point);
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
  config.physics = ParsePhysics(a.physics, "--physics");
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
  const LoadedPolicy loaded = LoadPolicy(a.policy);
  MapResult map;
  map.config = ConfigOf(a, loaded);
  map.policy = loaded.path.string();
  map.physics = a.physics;
  map.model = InfoOfModel(loaded.mjcf, "");
  const fs::path folder =
      a.out.empty() ? Concat("map-", map.config.x.name, "-", map.config.y.name) : a.out;
  CheckFree(folder);
  CheckCanDraw();

  ThreadPool pool(ResolveThreads(a.threads));
  std::vector<int64_t> all(static_cast<size_t>(map.config.cells()));
  std::iota(all.begin(), all.end(), int64_t{0});
  const auto begin = Clock::now();
  map.cells = RunCells(map.config, loaded.policy, all, pool, a.as_json);
  map.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  if (map.config.physics != PhysicsEngine::kMuJoCo) {
    map.checked = DrawCells(map.config, a.check);
    MapConfig mujoco = map.config;
    mujoco.physics = PhysicsEngine::kMuJoCo;
    map.in_mujoco = RunCells(mujoco, loaded.policy, map.checked, pool, a.as_json);
  }

  MakeNewFolder(folder);
  WriteMap(map, folder);
  a.as_json ? PrintMapJson(map) : PrintMapTable(map);
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
  own.Add(&a->check, "check", 0.02, kUnit, "", "share of the cells to do again in MuJoCo");
  AddArguments(*app, own);
  app->add_option("--set", a->set, "what the axes leave alone, such as gravity=9.7 (repeatable)")
      ->type_name("NAME=VALUE")
      ->take_all()
      ->allow_extra_args(false);
  AddPhysics(*app, a->physics, "closed-form");
  app->add_option("--out", a->out, "new folder for map.csv, map.svg and map.png [map-X-Y]")
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
      "eval`; with a start, every episode begins exactly there, at rest and hanging in what is\n"
      "not given.\n\n"
      "Examples:\n"
      "  ./upswing map runs/d3qn-seed1\n"
      "  ./upswing map runs/d3qn-seed1 --x mass=0.8:1.2 --y damping=0:0.4:21 --episodes 20\n"
      "  ./upswing map runs/d3qn-seed1 --x sensor_noise=0:0.1 --y delay=0:0.1:6\n"
      "  ./upswing map runs/d3qn-seed1 --x q1=-180:180:73 --y q2=-180:180:73    from any angle\n");
  app->callback([a, &command] { command = [a] { return RunMapCommand(*a); }; });
}

}  // namespace upswing
