#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>

#include "apps/commands.h"
#include "apps/config.h"
#include "apps/loaded_policy.h"
#include "apps/model_info.h"
#include "apps/rollout.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"
#include "report/figure.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

struct PlotArguments {
  std::string policy, start = "0,0,0,0", out = "plot", model, physics;
  std::vector<std::string> set;
  double seconds;
};

using Rows = std::vector<RolloutRow>;

/// An angle (rad) in degrees, between `lowest` and a turn above it.
double Wrapped(double angle, double lowest) {
  const double degrees = angle * 180 / std::numbers::pi - lowest;
  return degrees - 360 * std::floor(degrees / 360) + lowest;
}

/// A curve through the rows.
template <typename X, typename Y>
Line Curve(const std::string& name, const Rows& rows, X x, Y y) {
  Line line;
  line.name = name;
  for (const RolloutRow& row : rows) {
    line.x.push_back(x(row));
    line.y.push_back(y(row));
  }
  return line;
}

template <typename Y>
Line OverTime(const std::string& name, const Rows& rows, Y y) {
  return Curve(
      name, rows, [](const RolloutRow& row) { return row.t; }, y);
}

/// Breaks the curve where an angle among `values` (x or y of the line) goes over its wrap.
void BreakAtWraps(Line& line, std::vector<double> Line::*values) {
  Line broken = line;
  broken.x.clear();
  broken.y.clear();
  for (size_t i = 0; i < line.x.size(); ++i) {
    if (i > 0 && std::abs((line.*values)[i] - (line.*values)[i - 1]) > 180) {
      broken.x.push_back(line.x[i]);
      broken.y.push_back(std::numeric_limits<double>::quiet_NaN());
    }
    broken.x.push_back(line.x[i]);
    broken.y.push_back(line.y[i]);
  }
  line = std::move(broken);
}

// Hanging and upright are both well inside -135° to 225°.
double Link1(const RolloutRow& row) { return Wrapped(row.state.q1, -135); }
double Link2(const RolloutRow& row) { return Wrapped(row.state.q1 + row.state.q2, -135); }
double Joint2(const RolloutRow& row) { return Wrapped(row.state.q2, -180); }

Panel PanelOf(const std::string& y_label, std::vector<Line> lines) {
  Panel panel;
  panel.y_label = y_label;
  panel.lines = std::move(lines);
  return panel;
}

Panel Angles(const Rows& rows) {
  Line link1 = OverTime("link 1", rows, Link1);
  Line link2 = OverTime("link 2, absolute", rows, Link2);
  BreakAtWraps(link1, &Line::y);
  BreakAtWraps(link2, &Line::y);
  const Line upright = OverTime("upright", rows, [](const RolloutRow&) { return 180.0; });
  return PanelOf("angle (°)", {link1, link2, upright});
}

Panel Velocities(const Rows& rows) {
  return PanelOf("velocity (rad/s)",
                 {OverTime("joint 1", rows, [](const RolloutRow& row) { return row.state.w1; }),
                  OverTime("joint 2", rows, [](const RolloutRow& row) { return row.state.w2; })});
}

Panel Energies(const Rows& rows, const Plant& plant) {
  const double target = EnergyTarget(plant);
  return PanelOf("energy (J)",
                 {OverTime("energy", rows, [](const RolloutRow& row) { return row.energy; }),
                  OverTime("target", rows, [&](const RolloutRow&) { return target; })});
}

/// Stairs: a torque is held until the next.
Panel Torques(const Rows& rows) {
  Line line;
  for (const RolloutRow& row : rows) {
    if (!line.x.empty()) {
      line.x.push_back(row.t);
      line.y.push_back(line.y.back());
    }
    line.x.push_back(row.t);
    line.y.push_back(row.torque);
  }
  return PanelOf("torque (N·m)", {line});
}

Panel Rewards(const Rows& rows) {
  std::vector<Line> lines;
  for (size_t k = 0; k < kRewardTerms; ++k) {
    std::string name = kRewardTermNames[k];
    std::ranges::replace(name, '_', ' ');
    lines.push_back(OverTime(name, rows, [k](const RolloutRow& row) { return row.terms[k]; }));
  }
  return PanelOf("reward a step", std::move(lines));
}

/// How far below the best action's each action's Q-value is.
Panel QValues(const Rows& rows, std::span<const double> torques) {
  constexpr size_t kMostColumns = 250;  // more cells than this make a large file
  const size_t stride = (rows.size() + kMostColumns - 1) / kMostColumns;
  HeatMap map;
  map.label = "Q - largest Q";
  // Actions from the lowest torque to the highest.
  std::vector<size_t> actions(torques.size());
  std::iota(actions.begin(), actions.end(), size_t{0});
  std::ranges::sort(actions, {}, [&](size_t a) { return torques[a]; });
  for (const size_t a : actions) map.y.push_back(torques[a]);
  Line greedy;
  greedy.name = "greedy action";
  for (size_t i = 0; i < rows.size(); i += stride) {
    map.x.push_back(rows[i].t);
    greedy.x.push_back(rows[i].t);
    greedy.y.push_back(torques[static_cast<size_t>(ArgMax(rows[i].q))]);
  }
  for (const size_t a : actions) {
    for (size_t i = 0; i < rows.size(); i += stride) {
      map.z.push_back(rows[i].q[a] - *std::ranges::max_element(rows[i].q));
    }
  }
  Panel panel = PanelOf("torque (N·m)", {greedy});
  panel.heat_map = std::move(map);
  return panel;
}

Panel LargestQ(const Rows& rows) {
  Line line = OverTime("greedy (band: all)", rows, [](const RolloutRow& row) {
    return static_cast<double>(*std::ranges::max_element(row.q));
  });
  for (const RolloutRow& row : rows) {
    line.low.push_back(*std::ranges::min_element(row.q));
    line.high.push_back(*std::ranges::max_element(row.q));
  }
  return PanelOf("Q-value", {line});
}

Figure EpisodeFigure(const Rows& rows, const Plant& plant, const Policy& policy) {
  Figure figure;
  figure.width = 1000;
  figure.height = 1150;
  figure.panels = {Angles(rows),  Velocities(rows), Energies(rows, plant),          Torques(rows),
                   Rewards(rows), LargestQ(rows),   QValues(rows, policy.torques())};
  for (Panel& panel : figure.panels) panel.x_range = {0, rows.back().t};
  figure.panels.back().x_label = "time (s)";
  return figure;
}

template <typename X, typename Y>
Panel Portrait(const std::string& x_label, const std::string& y_label, const Rows& rows, X x, Y y) {
  Line path = Curve("", rows, x, y);
  BreakAtWraps(path, &Line::x);
  Panel panel = PanelOf(y_label, {path});
  panel.x_label = x_label;
  panel.lines.push_back({"begin", {x(rows.front())}, {y(rows.front())}, {}, {}, true});
  panel.lines.push_back({"end", {x(rows.back())}, {y(rows.back())}, {}, {}, true});
  return panel;
}

Figure PhaseFigure(const Rows& rows) {
  Figure figure;
  figure.width = 1100;
  figure.height = 500;
  figure.columns = 2;
  figure.panels = {Portrait("q1 (°)", "w1 (rad/s)", rows, Link1,
                            [](const RolloutRow& row) { return row.state.w1; }),
                   Portrait("q2 (°)", "w2 (rad/s)", rows, Joint2,
                            [](const RolloutRow& row) { return row.state.w2; })};
  return figure;
}

/// Since when it has been upright, if it is at the end; else a negative number.
double UprightSince(const Rows& rows) {
  double since = -1;
  for (const RolloutRow& row : rows) {
    if (!row.inverted) since = -1;
    if (row.inverted && since < 0) since = row.t;
  }
  return since;
}

int RunPlot(const PlotArguments& a) {
  const LoadedPolicy loaded = LoadPolicy(a.policy);
  RolloutConfig config;
  config.policy = &loaded.policy;
  config.mjcf = loaded.mjcf;
  config.physics = ParsePhysics(a.physics, "--physics");
  config.plant = ChangedPlant(loaded.plant, a.model, a.set, config.mjcf);
  const std::optional<ModelInfo> model = InfoOfModel(config.mjcf, a.model);
  config.start = ParseStart(a.start);
  config.seconds = a.seconds;
  config.q_values = true;
  CheckFree(a.out);
  CheckCanDraw();
  const Rows rows = RunRollout(config);

  MakeNewFolder(a.out);
  Figure episode = EpisodeFigure(rows, config.plant, loaded.policy);
  Figure phase = PhaseFigure(rows);
  std::vector<std::string> files;
  for (auto [name, figure] : {std::pair("episode", &episode), std::pair("phase", &phase)}) {
    figure->title = WithModel(loaded.path.string(), model);
    for (const char* ending : {".svg", ".png"}) {
      const fs::path file = fs::path(a.out) / Concat(name, ending);
      Draw(*figure, file);
      files.push_back(file.string());
    }
  }
  fmt::print("{}\n", Printable(loaded.path.string()));
  fmt::print("  plant      {}, physics {}\n", PlantText(config.plant), a.physics);
  if (model) fmt::print("  model      {}\n", model->Text());
  const double since = UprightSince(rows);
  fmt::print("  upright    {}\n",
             since < 0 ? "not at the end" : fmt::format("from {:.2f} s to the end", since));
  fmt::print("  written    {}\n", Printable(Join(files, ", ")));
  return 0;
}

}  // namespace

void AddPlot(CLI::App& program, Command& command) {
  CLI::App* app = program.add_subcommand("plot", "Draw one episode of a policy");
  auto a = std::make_shared<PlotArguments>();
  AddPolicy(*app, a->policy)->required();
  AddStart(*app, a->start);
  Options own;
  own.Add(&a->seconds, "seconds", 10, {0.1, 1000}, "s", "how long").step = kControlPeriod;
  AddArguments(*app, own);
  AddPlantOptions(*app, a->set, a->model);
  AddPhysics(*app, a->physics, "mujoco");
  app->add_option("--out", a->out, "new folder for the figures [plot]")
      ->type_name("FOLDER")
      ->check(NotEmpty());
  app->footer(
      "episode.svg and .png: angles, velocities, energy, torque, the reward's terms and the "
      "Q-values\nover time. phase.svg and .png: velocity over angle of both joints. `upswing "
      "simulate` writes the\nsame episode as a table.\n\n"
      "Examples:\n"
      "  ./upswing plot runs/d3qn-seed1\n"
      "  ./upswing plot runs/d3qn-seed1 --start 3.0,0,0,0 --seconds 5 --out caught\n"
      "  ./upswing plot runs/d3qn-seed1 --set mass2=1.3 --out heavy\n");
  app->callback([a, &command] { command = [a] { return RunPlot(*a); }; });
}

}  // namespace upswing
