#include "judge/map_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <numeric>
#include <optional>

#include "core/error.h"
#include "core/format.h"
#include "core/text.h"
#include "io/file.h"
#include "judge/trial.h"
#include "mujoco/engines.h"
#include "report/figure.h"
#include "setup/config.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int64_t kMostEpisodes = 10000000;

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
  std::vector<std::string> texts;
  for (const auto& [option, before] :
       Differences(OptionsOf(config.point), OptionsOf(training.point))) {
    if (OnAxis(config, option)) continue;
    texts.push_back(fmt::format("{} {:.4g} {}", option.name, option.number(), option.unit));
    if (option.section == "start") continue;
    texts.back() += fmt::format(" ({}: {:.4g})", training.word, before->number());
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
  if (loaded.identifies()) config.identified_from = loaded.plant;
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

/// Runs cells and tells how far they are.
std::vector<MapCell> RunCells(const MapConfig& config, const Policy& policy,
                              std::span<const int64_t> cells, ThreadPool& pool,
                              const MapProgress& progress) {
  const double episodes = static_cast<double>(cells.size()) * config.episodes;
  return RunMap(config, policy, cells, pool, [&](double share) { progress(episodes, share); });
}

}  // namespace

void MapArguments::Describe(Options& o) {
  o.Add(&episodes, "episodes", {1, 100000}, "", "in a cell").usual =
      "10, or 1 where the start is given";
  o.Add(&check, "check", kUnit, "", "share of the cells to repeat in MuJoCo");
}

MapResult PlanMap(const MapArguments& a, const LoadedPolicy& loaded) {
  if (!HasPlant(loaded.task)) {
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
  return map;
}

fs::path MapFolder(const MapArguments& a, const LoadedPolicy& loaded, const MapResult& map) {
  const fs::path folder =
      FigureFolder(a.out, loaded, Concat("map-", map.config.x.name, "-", map.config.y.name));
  CheckCanDraw();
  return folder;
}

void FillMap(const MapArguments& a, const LoadedPolicy& loaded, ThreadPool& pool,
             const MapProgress& progress, MapResult& map) {
  std::vector<int64_t> all(static_cast<size_t>(map.config.cells()));
  std::iota(all.begin(), all.end(), int64_t{0});
  const auto begin = Clock::now();
  map.cells = RunCells(map.config, *loaded.policy, all, pool, progress);
  map.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  if (map.config.engine == &kMuJoCo) return;
  map.checked = DrawCells(map.config, a.check);
  MapConfig mujoco = map.config;
  mujoco.engine = &kMuJoCo;
  map.in_mujoco = RunCells(mujoco, *loaded.policy, map.checked, pool, progress);
}

}  // namespace upswing
