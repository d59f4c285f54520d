#include <fmt/format.h>

#include <memory>
#include <optional>

#include "apps/commands.h"
#include "apps/map_table.h"
#include "apps/progress.h"
#include "core/thread_pool.h"
#include "io/file.h"
#include "io/machine.h"
#include "lab/loaded_policy.h"
#include "lab/map_command.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
/// What was typed.
struct MapCommand : MapArguments {
  PolicyArguments policy;
  int64_t threads;
  bool as_json = false;
};

int RunMapCommand(const MapCommand& a) {
  const LoadedPolicy loaded = GetPolicy(a.policy);
  MapResult map = PlanMap(a, loaded);
  const fs::path folder = MapFolder(a, loaded, map);
  ThreadPool pool(ResolveThreads(a.threads));
  std::optional<EpisodeProgress> line;
  double shown = 0;  // episodes that the line is of
  FillMap(
      a, loaded, pool,
      [&](double episodes, double share) {
        if (episodes != shown) line.emplace(episodes, a.as_json);
        shown = episodes;
        line->Show(share);
      },
      map);
  line.reset();
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
  auto a = std::make_shared<MapCommand>();
  AddPolicy(*app, a->policy)->required();
  constexpr const char* kAxis = "NAME=FROM:TO[:CELLS]";
  app->add_option("--x", a->x, "horizontal axis [mass2=-50%:+50%:31]")->type_name(kAxis);
  app->add_option("--y", a->y, "vertical axis [length2=-50%:+50%:31]")->type_name(kAxis);
  Options own;
  a->Describe(own);
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
