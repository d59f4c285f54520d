#include "judge/plot_figures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/format.h"

namespace upswing {
namespace {

using Rows = std::vector<RolloutRow>;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
// Angles wrap here, degrees: hanging and upright are well away from it.
constexpr double kLow = -135;

double Link1(const PendulumState& s) { return s.q1 * kDegrees; }
double Link2(const PendulumState& s) { return (s.q1 + s.q2) * kDegrees; }

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

/// A curve of an angle (degrees) that wraps within [kLow, kLow + 360). At a wrap, it ends at one
/// edge and starts again at the other.
Line AngleOverTime(const std::string& name, const Rows& rows,
                   double (*angle_of)(const PendulumState&)) {
  Line line{.name = name};
  double last_angle = 0, last_turns = 0;
  const auto push = [&](double t, double angle) {
    line.x.push_back(t);
    line.y.push_back(angle);
  };
  for (size_t i = 0; i < rows.size(); ++i) {
    const double angle = angle_of(rows[i].state), turns = std::floor((angle - kLow) / 360);
    if (i > 0 && turns != last_turns) {
      const double edge = kLow + 360 * std::max(turns, last_turns);
      const double at_edge =
          std::lerp(rows[i - 1].t, rows[i].t, (edge - last_angle) / (angle - last_angle));
      const bool up = turns > last_turns;
      push(at_edge, up ? kLow + 360 : kLow);
      push(kNone, kNone);  // a gap
      push(at_edge, up ? kLow : kLow + 360);
    }
    push(rows[i].t, angle - 360 * turns);
    last_angle = angle;
    last_turns = turns;
  }
  return line;
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

}  // namespace upswing
