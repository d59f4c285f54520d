#include "judge/plot_figures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/format.h"
#include "base/text.h"

namespace upswing {
namespace {

using Rows = std::vector<RolloutRow>;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
// Angles wrap here, degrees: hanging and upright are well away from it.
constexpr double kLow = -135;

double Link1(const RolloutRow& row) { return row.state.q1 * kDegrees; }
double Link2(const RolloutRow& row) { return (row.state.q1 + row.state.q2) * kDegrees; }

/// A curve through the rows.
template <typename Y>
Line OverTime(const std::string& name, const Rows& rows, Y y) {
  Line line{.name = name};
  for (const RolloutRow& row : rows) {
    line.x.push_back(row.t);
    line.y.push_back(y(row));
  }
  return line;
}

/// A quantity of a row, such as an angle.
using Quantity = double (*)(const RolloutRow&);

/// Passes the points (angle, other) of a curve to `push`, with the angle (degrees) wrapped within
/// [low, low + 360). At a wrap, the curve ends at one edge and starts again at the other.
template <typename Push>
void Wrap(const Rows& rows, double low, Quantity angle_of, Quantity other_of, Push push) {
  double last_angle = 0, last_turns = 0;
  for (size_t i = 0; i < rows.size(); ++i) {
    const double angle = angle_of(rows[i]), other = other_of(rows[i]);
    const double turns = std::floor((angle - low) / 360);
    if (i > 0 && turns != last_turns) {
      const double edge = low + 360 * std::max(turns, last_turns);
      const double at_edge =
          std::lerp(other_of(rows[i - 1]), other, (edge - last_angle) / (angle - last_angle));
      const bool up = turns > last_turns;
      push(up ? low + 360 : low, at_edge);
      push(kNone, kNone);  // a gap
      push(up ? low : low + 360, at_edge);
    }
    push(angle - 360 * turns, other);
    last_angle = angle;
    last_turns = turns;
  }
}

/// A curve of an angle (degrees) over time.
Line AngleOverTime(const std::string& name, const Rows& rows, Quantity angle_of) {
  Line line{.name = name};
  const auto time_of = [](const RolloutRow& row) { return row.t; };
  Wrap(rows, kLow, angle_of, time_of, [&](double angle, double t) {
    line.x.push_back(t);
    line.y.push_back(angle);
  });
  return line;
}

/// A panel of a joint's angle against its velocity, with the start (dot) and the goal (cross). The
/// angle wraps half a turn away from the middle of its axis.
Panel PhasePortrait(const Rows& rows, const std::string& joint, double middle, double goal,
                    Quantity angle_of, Quantity velocity_of) {
  const double low = middle - 180;
  Line path;
  Wrap(rows, low, angle_of, velocity_of, [&](double angle, double velocity) {
    path.x.push_back(angle);
    path.y.push_back(velocity);
  });
  Panel panel{
      .title = Concat("joint ", joint),
      .x_label = Concat("q", joint, " (°)"),
      .y_label = Concat("w", joint, " (rad/s)"),
      .lines = {path,
                {.name = "start", .x = {path.x[0]}, .y = {path.y[0]}, .points = true},
                {.name = "goal", .x = {goal}, .y = {0}, .points = true, .marker = Marker::kCross}}};
  panel.x_range = {low, low + 360};
  return panel;
}

/// A step curve: a row's value holds until the next row.
template <typename Y>
Line Held(const std::string& name, const Rows& rows, Y y) {
  Line line{.name = name};
  for (const RolloutRow& row : rows) {
    if (!line.x.empty()) {
      line.x.push_back(row.t);
      line.y.push_back(line.y.back());
    }
    line.x.push_back(row.t);
    line.y.push_back(y(row));
  }
  return line;
}

Panel PanelOf(const std::string& y_label, std::vector<Line> lines) {
  return {.y_label = y_label, .lines = std::move(lines)};
}

Panel Angles(const Rollout& rollout) {
  const Rows& rows = rollout.rows;
  std::vector<Line> lines{AngleOverTime("link 1", rows, Link1),
                          AngleOverTime("link 2, absolute", rows, Link2)};
  const auto add_goal = [&](const char* name, bool up) {
    lines.push_back(OverTime(name, rows, [up](const RolloutRow&) { return up ? 180.0 : 0.0; }));
  };
  if (!rollout.goal) add_goal("upright", true);
  if (rollout.goal) add_goal("goal of link 1", rollout.goal->up1);
  if (rollout.goal) add_goal("goal of link 2", rollout.goal->up2);
  Panel panel = PanelOf("angle (°)", std::move(lines));
  panel.y_range = {kLow, kLow + 360};
  panel.y_tick = 90;
  return panel;
}

Panel Velocities(const Rows& rows) {
  return PanelOf("velocity (rad/s)",
                 {OverTime("joint 1", rows, [](const RolloutRow& row) { return row.state.w1; }),
                  OverTime("joint 2", rows, [](const RolloutRow& row) { return row.state.w2; })});
}

Panel Energies(const Rollout& rollout) {
  const double target = Energy(rollout.plant, RestIn(rollout.goal.value_or(Pose())));
  const auto energy = [&](const RolloutRow& row) { return Energy(rollout.plant, row.state); };
  return PanelOf("energy (J)",
                 {OverTime("energy", rollout.rows, energy),
                  OverTime("target", rollout.rows, [&](const RolloutRow&) { return target; })});
}

constexpr const char* kTorqueLabel = "torque (N·m)";

Panel Torques(const Rows& rows) {
  return PanelOf(kTorqueLabel, {Held("", rows, [](const RolloutRow& row) { return row.torque; })});
}

Panel Rewards(const Rows& rows) {
  std::vector<Line> lines;
  for (size_t k = 0; k < kRewardTermNames.size(); ++k) {
    std::string name = kRewardTermNames[k];
    std::ranges::replace(name, '_', ' ');
    Line line = Held(name, rows, [k](const RolloutRow& row) { return row.terms[k]; });
    line.x.pop_back();  // no step begins in the last row
    line.y.pop_back();
    lines.push_back(std::move(line));
  }
  return PanelOf("reward per step", std::move(lines));
}

double Largest(const RolloutRow& row) { return *std::ranges::max_element(row.q); }
double Smallest(const RolloutRow& row) { return *std::ranges::min_element(row.q); }

/// A panel of V, or of the largest Q-value within the span of all.
Panel Values(const Rows& rows) {
  if (rows.front().q.size() == 1) return PanelOf("value (reward)", {Held("", rows, Largest)});
  Line line = Held("greedy (band: all)", rows, Largest);
  line.low = Held("", rows, Smallest).y;
  line.high = line.y;
  return PanelOf("Q-value (reward)", {line});
}

/// A panel of the chosen torque within the central 68% of the torques that the policy would draw.
Panel Spread(const Rows& rows) {
  Line line =
      Held("chosen (band: central 68%)", rows, [](const RolloutRow& row) { return row.chosen; });
  line.low = Held("", rows, [](const RolloutRow& row) { return row.spread->low; }).y;
  line.high = Held("", rows, [](const RolloutRow& row) { return row.spread->high; }).y;
  return PanelOf(kTorqueLabel, {line});
}

/// A panel of each action's Q-value minus the best action's. In long episodes a cell is the mean
/// over some steps, because more cells would make a large file.
Panel QValues(const Rows& rows, std::span<const double> torques) {
  constexpr size_t kMostColumns = 250;
  const size_t steps = std::max<size_t>(1, rows.size() - 1);  // the last row has no duration
  const size_t width = (steps + kMostColumns - 1) / kMostColumns;
  HeatMap map{.label = "Q - largest Q (reward)"};
  // Order the actions from the lowest torque to the highest.
  std::vector<size_t> actions(torques.size());
  std::iota(actions.begin(), actions.end(), size_t{0});
  std::ranges::sort(actions, {}, [&](size_t a) { return torques[a]; });
  for (const size_t a : actions) map.y.push_back(torques[a]);
  for (size_t i = 0; i < steps; i += width) {
    const size_t end = std::min(i + width, rows.size() - 1);
    map.x.push_back((rows[i].t + rows[std::max(end, i)].t) / 2);
  }
  for (const size_t a : actions) {
    for (size_t i = 0; i < steps; i += width) {
      const size_t end = std::min(i + width, steps);
      double sum = 0;
      for (size_t k = i; k < end; ++k) sum += rows[k].q[a] - Largest(rows[k]);
      map.z.push_back(sum / static_cast<double>(end - i));
    }
  }
  const Line greedy = Held("greedy action", rows, [&](const RolloutRow& row) {
    return torques[static_cast<size_t>(std::ranges::max_element(row.q) - row.q.begin())];
  });
  Panel panel = PanelOf(kTorqueLabel, {greedy});
  panel.heat_map = std::move(map);
  return panel;
}

}  // namespace

Figure EpisodeFigure(const Rollout& rollout, const Policy& policy) {
  const Rows& rows = rollout.rows;
  Figure figure{.panels = {Angles(rollout), Velocities(rows), Energies(rollout), Torques(rows),
                           Rewards(rows)},
                .width = 1000};
  constexpr int kPanelHeight = 170;
  if (rows.front().spread) figure.panels.push_back(Spread(rows));
  if (!rows.front().q.empty()) figure.panels.push_back(Values(rows));
  if (!policy.value_actions().empty()) {
    figure.panels.push_back(QValues(rows, policy.value_actions().values()));
  }
  figure.height = kPanelHeight * static_cast<int>(figure.panels.size());
  for (Panel& panel : figure.panels) panel.x_range = {0, rows.back().t};
  figure.panels.back().x_label = "time (s)";
  return figure;
}

Figure PhaseFigure(const Rollout& rollout) {
  const Pose goal = rollout.goal.value_or(Pose());
  // q1 wraps where that of EpisodeFigure does, and q2 where link 2 is folded back.
  Figure figure{.columns = 2, .width = 1000, .height = 450};
  figure.panels = {PhasePortrait(rollout.rows, "1", kLow + 180, goal.up1 ? 180 : 0, Link1,
                                 [](const RolloutRow& row) { return row.state.w1; }),
                   PhasePortrait(
                       rollout.rows, "2", 0, goal.up1 == goal.up2 ? 0 : 180,
                       [](const RolloutRow& row) { return row.state.q2 * kDegrees; },
                       [](const RolloutRow& row) { return row.state.w2; })};
  return figure;
}

}  // namespace upswing
