// Evaluations and maps for Python.
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <functional>

#include "agents/arguments.h"
#include "base/text.h"
#include "judge/eval_report.h"
#include "judge/policy_map.h"
#include "os/file.h"
#include "os/host.h"
#include "python/src/bindings.h"

namespace upswing {
namespace {

namespace nb = nanobind;

/// Sets the arguments of a package function, each given as name and text.
void SetArguments(const Options& options, const SettingTexts& arguments) {
  for (const auto& [name, text] : arguments) options.Set(name, text, name);
}

/// Applies the flags to the trial's plant and conditions. Throws BadInput.
void SetSurroundings(const std::vector<FlagValue>& flags, TrialArguments& trial) {
  TrialSurroundings scratch;
  const Options options = OptionsOf(scratch), plant = OptionsOf(scratch.plant);
  for (const FlagValue& flag : flags) {
    if (plant.Get(options.Find(flag.name, flag.where).front()->name) != nullptr) {
      trial.set.push_back(Concat(flag.name, "=", flag.text));
    } else {
      trial.flags.push_back(flag);
    }
  }
}

/// A Progress that calls a Python function, if it is not None, with the finished share. Ctrl-C ends
/// the work.
class PythonProgress {
 public:
  explicit PythonProgress(nb::object function) : function_(std::move(function)) {}

  /// Calls Python only in the caller's thread.
  void operator()(double done, double total) {
    if (!interrupts_.due()) return;
    const nb::gil_scoped_acquire lock;
    CheckSignals();
    if (!function_.is_none()) function_(done / total);
  }

 private:
  nb::object function_;
  Interrupts interrupts_;
};

/// Evaluates a policy. Returns the figures as JSON and the episodes as CSV.
std::pair<std::string, std::string> EvaluateHandle(const PolicyHandle& policy,
                                                   const SettingTexts& settings,
                                                   const SettingTexts& arguments,
                                                   const std::string& plant, bool unknown_plant,
                                                   const nb::object& progress) {
  TrialArguments trial;
  int64_t episodes = 100, threads = 0;
  Options own;
  DescribeEvalEpisodes(own, &episodes);
  DescribeSeed(own, &trial.seed, "start states, noise and random plants");
  DescribeThreads(own, &threads);
  DescribePhysics(own, &trial.physics);
  DescribeGoal(own, &trial.goal);
  SetArguments(own, arguments);
  SetSurroundings(FlagsOf(settings), trial);
  trial.plant = plant;
  trial.unknown_plant = unknown_plant;
  PythonProgress python_progress(progress);
  const nb::gil_scoped_release unlocked;
  ThreadPool pool(ResolveThreads(threads), threads == 0);
  const LoadedPolicy loaded = UsedIn(trial, policy.loaded());
  const EvalReport report =
      EvaluatePolicy(loaded, trial, episodes, pool, std::ref(python_progress));
  return {EvalJson(report), EpisodesCsv({&report, 1}, false)};
}

/// The numbers of a map as a new array (ny × nx).
template <typename T, typename Get>
nb::ndarray<nb::numpy, T> Grid(const MapResult& map, const Get& get) {
  auto grid = NewArray<T>({map.config.y.values.size(), map.config.x.values.size()});
  std::ranges::transform(map.cells, grid.data(), get);
  return grid;
}

nb::tuple MapHandle(const PolicyHandle& policy, const SettingTexts& settings,
                    const SettingTexts& arguments, const std::string& x, const std::string& y,
                    const std::string& plant, bool unknown_plant, const std::string& out,
                    const nb::object& progress) {
  MapArguments a;
  int64_t threads = 0;
  Options own;
  a.Describe(own);
  DescribeSeed(own, &a.trial.seed, "starts and noise");
  DescribeThreads(own, &threads);
  DescribePhysics(own, &a.trial.physics);
  SetArguments(own, arguments);
  if (!x.empty()) a.x = x;
  if (!y.empty()) a.y = y;
  for (const FlagValue& flag : FlagsOf(settings)) a.set.push_back(flag.name + "=" + flag.text);
  a.trial.plant = plant;
  a.trial.unknown_plant = unknown_plant;
  PythonProgress python_progress(progress);
  std::vector<MapResult> maps(1);
  MapResult& map = maps.front();
  std::string json;
  {
    const nb::gil_scoped_release unlocked;
    const LoadedPolicy loaded = UsedIn(a.PlantTrial(), policy.loaded());
    map = PlanMap(a, loaded);
    const std::filesystem::path folder =
        out.empty() ? std::filesystem::path() : FigureFolder(out, loaded, map.folder_name());
    ThreadPool pool(ResolveThreads(threads), threads == 0);
    map.cells = RunMap(map.config, *loaded.policy, pool, std::ref(python_progress));
    if (!out.empty()) {
      MakeNewFolder(folder);
      WriteMaps(maps, folder);
    }
    json = MapsJson(maps);
  }
  return nb::make_tuple(
      json, Grid<int64_t>(map, [](const MapCell& cell) { return cell.successes; }),
      Grid<double>(map, [](const MapCell& cell) { return cell.swing_up_seconds; }));
}

}  // namespace

void BindEvaluation(nb::module_& m) {
  m.def("evaluate", &EvaluateHandle, nb::arg("policy"), nb::arg("settings"), nb::arg("arguments"),
        nb::arg("plant"), nb::arg("unknown_plant"), nb::arg("progress").none());
  m.def("map", &MapHandle, nb::arg("policy"), nb::arg("settings"), nb::arg("arguments"),
        nb::arg("x"), nb::arg("y"), nb::arg("plant"), nb::arg("unknown_plant"), nb::arg("out"),
        nb::arg("progress").none());
}

}  // namespace upswing
