#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "agents/arguments.h"
#include "agents/config.h"
#include "agents/loaded_policy.h"
#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "base/thread_pool.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "judge/policy_map.h"
#include "os/file.h"
#include "os/host.h"
#include "pendulum/plant.h"
#include "runs/find_policy.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// The arguments of `map`.
struct MapCommand : MapArguments {
  std::vector<std::string> policies;
  PolicyArguments controllers;  // of the controllers among the policies
  std::string out;
  int64_t threads = 0;
  bool as_json = false;
};

/// Name, range and unit of an axis, such as "mass2 0.5 to 1.5 kg".
std::string RangeText(const MapAxis& axis) {
  return fmt::format("{} {:.4g} to {:.4g} {}", axis.name, axis.values.front(), axis.values.back(),
                     axis.unit);
}

/// Prints the map's figures on standard output.
void PrintMapTable(const MapResult& map) {
  const MapConfig& config = map.config;
  fmt::print("{}\n", Printable(map.policy));
  fmt::print("  plant      {}, physics {}\n", PlantText(config.point.plant),
             config.env.engine->name);
  fmt::print("  map        {} × {}: {} × {} cells, {} each\n", RangeText(config.x),
             RangeText(config.y), config.x.values.size(), config.y.values.size(),
             Counted(config.episodes, "episode"));
  if (!map.changes.empty()) fmt::print("  with       {}\n", map.changes);
  const std::string interval = map.success_interval();
  fmt::print("  success    {:.1f}% of all episodes; no failure in {:.1f}% of the cells{}\n",
             100 * map.mean_success(), 100 * map.always_success(),
             interval.empty() ? "" : Concat(" (", interval, ")"));
  if (std::isfinite(map.median_swing_up())) {
    fmt::print("  swing-up   {:.2f} s, median of the cells' medians\n", map.median_swing_up());
  } else {
    fmt::print("  swing-up   none: no episode stays upright\n");
  }
  fmt::print("  written    {}\n", Printable(Join(map.files, ", ")));
}

int RunMapCommand(const MapCommand& a) {
  const bool several = a.policies.size() > 1;
  if (several && a.out.empty()) {
    throw BadInput(Concat("--out: expected a folder for several maps, got none; policies: ",
                          Join(a.policies, ", ")));
  }
  const std::vector<LoadedPolicy> policies =
      GetPoliciesIn(a.PlantTrial(), a.policies, a.controllers);
  std::vector<MapResult> maps;
  for (const LoadedPolicy& loaded : policies) maps.push_back(PlanMap(a, loaded));
  CheckSameAxes(maps);
  const fs::path folder = FigureFolder(a.out, policies.front(), maps.front().folder_name());
  SayIfNoFigures();
  ThreadPool pool(ResolveThreads(a.threads));
  for (size_t i = 0; i < maps.size(); ++i) {
    EpisodeProgress progress(a.as_json);
    maps[i].cells = RunMap(maps[i].config, *policies[i].policy, pool, std::ref(progress));
  }
  MakeNewFolder(folder);
  WriteMaps(maps, folder);
  if (a.as_json) {
    fmt::print("{}\n", MapsJson(maps));
    return 0;
  }
  for (const MapResult& map : maps) PrintMapTable(map);
  return 0;
}

}  // namespace

void AddMap(CommandLine& line) {
  MapCommand& a = line.Runs(RunMapCommand);
  line.Texts("policies", a.policies, "POLICY|RUN",
             Concat("policies, several for maps side by side: ", PolicyWords()));
  line.Require("policies");
  AddControllers(line, a.controllers);
  constexpr const char* kAxis = "NAME=FROM:TO[:CELLS]";
  line.Text("--x", a.x, kAxis, "horizontal axis (default mass2=-50%:+50%:31)", "");
  line.Text("--y", a.y, kAxis, "vertical axis (default length2=-50%:+50%:31)", "");
  Options own;
  a.Describe(own);
  DescribeControlPeriod(own, &a.trial.control_period);
  line.Arguments(own);
  AddPlant(line, a.trial.plant);
  AddSet(line, a.set, "value of a quantity on neither axis, such as q1=178deg");
  AddPlantFlags(line, a.trial.plant_flags);
  AddPhysics(line, a.trial.physics);
  AddUnknownPlant(line, a.trial.unknown_plant);
  line.Text("--out", a.out, "FOLDER",
            "new folder for map.csv, map.svg and map.png (default RUN/map-X-Y)");
  AddSeed(line, a.trial.seed, "starts and noise");
  AddThreads(line, a.threads);
  line.Flag("--json", a.as_json, "print JSON instead of a table");
  line.Notes(
      "Quantities for axes and --set:\n"
      "  plant    mass1, mass2, length1, length2, damping1, damping2 (mass, length,\n"
      "           damping for both links), gravity, torque_limit, actuated_joint (1 or 2),\n"
      "           rotor_inertia, gear_ratio, coulomb1, coulomb2, center1, center2,\n"
      "           inertia1, inertia2, armature, armature1\n"
      "  sensors  sensor_noise [rad, rad/s], sensor_latency [s], encoder_counts,\n"
      "           velocity_window [s], velocity_filter [s]\n"
      "  motor    delay [s], in whole control periods, one cell each\n"
      "  start    q1, q2, w1, w2, in rad and rad/s or with a unit, such as 178deg or 90deg/s,\n"
      "           as in --start of `simulate`; 0 if not given: hanging, at rest. map.csv and\n"
      "           figures have angles in degrees\n\n"
      "A percentage is relative to the training's value: +10% is 1.1 times it. Episodes are\n"
      "those of eval; with a start, every episode starts exactly there. Observed energy and\n"
      "height are scaled by the cell's plant, which reveals the plant to the policy. With\n"
      "--unknown-plant they are scaled by the plant of the training.\n\n"
      "Without --out, a map goes into map-X-Y in the run folder, or into runs/map-X-Y-NAME\n"
      "for another policy file; a second map into map-X-Y-2. Several policies need --out:\n"
      "it gets map-1.csv, map-2.csv, … and maps.svg and maps.png of their success.\n");
  line.Examples(
      "  ./upswing map runs/d3qn-seed1\n"
      "  ./upswing map runs/d3qn-seed1 --x mass=0.8:1.2 --y damping=0:0.4:21\n"
      "  ./upswing map runs/d3qn-seed1 --x sensor_noise=0:0.1 --y delay=0:0.1:6\n"
      "  ./upswing map runs/d3qn-seed1 --x q1=-180deg:180deg:73 --y q2=-180deg:180deg:73\n"
      "  ./upswing map lqr --x q1=150deg:210deg:121 --y q2=-30deg:30deg:121\n"
      "  ./upswing map runs/d3qn-seed1 mpc tvlqr --episodes 1 --out runs/maps\n");
}

}  // namespace upswing
