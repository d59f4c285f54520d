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
constexpr double kLinkLow = -135, kJointLow = -180;

/// A state of the motion, at a row or between two rows.
struct Moment {
  double t;  // s
  PendulumState state;
};

/// The rows, with three interpolated moments between neighbours, because the motion is curved.
std::vector<Moment> MotionOf(const Rows& rows) {
  constexpr int kPieces = 4;
  std::vector<Moment> motion;
  for (size_t i = 0; i + 1 < rows.size(); ++i) {
    const PendulumState a = rows[i].state;
    const PendulumState b = rows[i + 1].state;
    const double h = rows[i + 1].t - rows[i].t;
    for (int k = 0; k < kPieces; ++k) {
      const double share = static_cast<double>(k) / kPieces;
      motion.push_back({rows[i].t + share * h, StateBetween(a, b, h, share)});
    }
  }
  motion.push_back({rows.back().t, rows.back().state});
  return motion;
}

double Link1(const PendulumState& s) { return s.q1 * kDegrees; }
double Link2(const PendulumState& s) { return (s.q1 + s.q2) * kDegrees; }
double Joint2(const PendulumState& s) { return s.q2 * kDegrees; }

/// An angle in degrees, wrapped into [low, low + 360).
double Wrapped(double degrees, double low) {
  return degrees - 360 * std::floor((degrees - low) / 360);
}

/// A curve of a quantity over an angle (degrees) that wraps within [low, low + 360). At a wrap, the
/// curve ends at one edge and starts again at the other.
class WrappingCurve {
 public:
  explicit WrappingCurve(double low) : low_(low) {}

  void Add(double angle, double other) {
    const double turns = std::floor((angle - low_) / 360);
    if (!angles.empty() && turns != last_turns_) {
      const double edge = low_ + 360 * std::max(turns, last_turns_);
      const double at_edge =
          std::lerp(last_other_, other, (edge - last_angle_) / (angle - last_angle_));
      const bool up = turns > last_turns_;
      Push(up ? low_ + 360 : low_, at_edge);
      Push(kNone, kNone);  // a gap
      Push(up ? low_ : low_ + 360, at_edge);
    }
    Push(angle - 360 * turns, other);
    last_angle_ = angle;
    last_other_ = other;
    last_turns_ = turns;
  }

  std::vector<double> angles, others;

 private:
  void Push(double angle, double other) {
    angles.push_back(angle);
    others.push_back(other);
  }
  double low_, last_angle_ = 0, last_other_ = 0, last_turns_ = 0;
};

/// A curve through rows or moments.
template <typename Samples, typename Y>
Line OverTime(const std::string& name, const Samples& samples, Y y) {
  Line line;
  line.name = name;
  for (const auto& m : samples) {
    line.x.push_back(m.t);
    line.y.push_back(y(m));
  }
  return line;
}

template <typename Angle>
Line AngleOverTime(const std::string& name, const std::vector<Moment>& motion, Angle angle) {
  WrappingCurve curve(kLinkLow);
  for (const Moment& m : motion) curve.Add(angle(m.state), m.t);
  Line line;
  line.name = name;
  line.x = std::move(curve.others);
  line.y = std::move(curve.angles);
  return line;
}

/// A step curve: a row's value holds until the next row.
template <typename Y>
Line Held(const std::string& name, const Rows& rows, Y y) {
  Line line;
  line.name = name;
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
  Panel panel;
  panel.y_label = y_label;
  panel.lines = std::move(lines);
  return panel;
}

Panel Angles(const std::vector<Moment>& motion) {
  Panel panel =
      PanelOf("angle (°)", {AngleOverTime("link 1", motion, Link1),
                            AngleOverTime("link 2, absolute", motion, Link2),
                            OverTime("upright", motion, [](const Moment&) { return 180.0; })});
  panel.y_range = {kLinkLow, kLinkLow + 360};
  panel.y_tick = 90;
  return panel;
}

Panel Velocities(const std::vector<Moment>& motion) {
  return PanelOf("velocity (rad/s)",
                 {OverTime("joint 1", motion, [](const Moment& m) { return m.state.w1; }),
                  OverTime("joint 2", motion, [](const Moment& m) { return m.state.w2; })});
}

Panel Energies(const std::vector<Moment>& motion, const Plant& plant) {
  const double target = EnergyTarget(plant);
  return PanelOf("energy (J)", {OverTime("energy", motion,
                                         [&](const Moment& m) { return Energy(plant, m.state); }),
                                OverTime("target", motion, [&](const Moment&) { return target; })});
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
    lines.push_back(Held(name, rows, [k](const RolloutRow& row) { return row.terms[k]; }));
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
  HeatMap map;
  map.label = "Q - largest Q (reward)";
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

/// The axes of a phase portrait.
struct PhaseAxes {
  const char *angle_label, *velocity_label;
  double (*angle)(const PendulumState&);  // degrees
  double PendulumState::*velocity;
  double low, upright;  // wrap of the angle, and its value upright, degrees
};

Panel Portrait(const std::vector<Moment>& motion, const PhaseAxes& axes) {
  WrappingCurve curve(axes.low);
  for (const Moment& m : motion) curve.Add(axes.angle(m.state), m.state.*axes.velocity);
  Panel panel = PanelOf(axes.velocity_label, {});
  panel.x_label = axes.angle_label;
  // The reached range of the angle, upright included, with a margin.
  double low = axes.upright, high = axes.upright;
  for (const double angle : curve.angles) {
    low = std::min(low, angle);
    high = std::max(high, angle);
  }
  const double margin = std::max(1.0, 0.05 * (high - low));
  panel.x_range = {std::max(axes.low, low - margin), std::min(axes.low + 360, high + margin)};
  if (high - low > 180) panel.x_tick = 45;
  panel.lines.emplace_back();
  panel.lines.back().x = std::move(curve.angles);
  panel.lines.back().y = std::move(curve.others);
  const auto mark = [&](const char* name, double x, double y, Marker marker) {
    panel.lines.push_back({name, {x}, {y}, {}, {}, true, marker});
  };
  const auto of = [&](const char* name, const Moment& m, Marker marker) {
    mark(name, Wrapped(axes.angle(m.state), axes.low), m.state.*axes.velocity, marker);
  };
  of("begin", motion.front(), Marker::kDot);
  of("end", motion.back(), Marker::kSquare);
  mark("upright", axes.upright, 0, Marker::kCross);
  return panel;
}

}  // namespace

Figure EpisodeFigure(const Rollout& rollout, const Policy& policy) {
  const Rows& rows = rollout.rows;
  Figure figure;
  figure.width = 1000;
  const std::vector<Moment> motion = MotionOf(rows);
  figure.panels = {Angles(motion), Velocities(motion), Energies(motion, rollout.plant),
                   Torques(rows), Rewards(rows)};
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
  const std::vector<Moment> motion = MotionOf(rollout.rows);
  Figure figure;
  figure.width = 1200;
  figure.height = 540;
  figure.columns = 2;
  figure.panels = {Portrait(motion, {"angle of joint 1 (°)", "velocity of joint 1 (rad/s)", Link1,
                                     &PendulumState::w1, kLinkLow, 180}),
                   Portrait(motion, {"angle of joint 2 (°)", "velocity of joint 2 (rad/s)", Joint2,
                                     &PendulumState::w2, kJointLow, 0})};
  return figure;
}

}  // namespace upswing
