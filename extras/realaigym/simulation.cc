#include "extras/realaigym/simulation.h"

#include <algorithm>
#include <cmath>

#include "base/rng.h"
#include "pendulum/runge_kutta.h"

namespace upswing::realaigym {

MachineLog SimulateEpisode(Robot robot, const BoardEpisode& episode,
                           const CycleController& controller, double seconds) {
  const Manipulator body = ManipulatorOf(episode.plant);
  const size_t motor = MotorOf(robot);
  Rng rng(episode.seed, "realaigym: noise");
  MachineLog log;
  PendulumState state{};
  Joints torque{};
  const auto steps = static_cast<int>(std::lround(seconds / kBoardTimestep));
  for (int step = 0; step < steps; ++step) {
    const double time = step * kBoardTimestep;
    log.time.push_back(time);
    log.angle.push_back({state.q1, state.q2});
    log.velocity.push_back({state.w1, state.w2});

    const int seen = std::max(0, step - episode.delay);
    CycleInput in{time, log.angle[seen], log.velocity[seen]};
    if (episode.velocity_noise > 0) {
      const auto [n1, n2] = rng.NormalPair();
      in.velocity[0] += episode.velocity_noise * n1;
      in.velocity[1] += episode.velocity_noise * n2;
    }
    Joints wanted = controller(in);
    if (episode.torque_noise > 0) wanted[motor] += episode.torque_noise * rng.Normal();
    for (size_t j = 0; j < 2; ++j) {
      const double moved = torque[j] + episode.response * (wanted[j] - torque[j]);
      torque[j] = std::clamp(moved, -kBoardTorqueLimit, kBoardTorqueLimit);
    }
    log.commanded.push_back(torque);

    double pushed = 0;  // N·m
    for (const BoardPush& push : episode.pushes) {
      if (push.amplitude != 0) pushed += push.Torque(time);
    }
    Joints acting = torque;
    acting[motor] += pushed;
    const auto acceleration = [&](const PendulumState& s, double /*share*/) {
      return body.Acceleration(s, acting);
    };
    state = RungeKuttaStep(state, acceleration(state, 0), kBoardTimestep, acceleration);
  }
  return log;
}

PendulumState EndOf(Robot robot, const BoardEpisode& episode, const CycleController& controller) {
  const MachineLog log =
      SimulateEpisode(robot, episode, controller, kBoardSeconds + kBoardTimestep);
  const Joints &q = log.angle.back(), &w = log.velocity.back();
  return {q[0], q[1], w[0], w[1]};
}

CycleController WithResets(const ControllerMaker& make, const ResetRules& rules, uint64_t seed) {
  return [make, resets = Resets(rules, seed),
          own = CycleController()](const CycleInput& in) mutable -> Joints {
    const auto& [time, q, w] = in;
    if (const auto torque = resets.Torque(time, {q[0], q[1], w[0], w[1]})) {
      own = nullptr;
      return *torque;
    }
    if (!own) own = make();
    return own(in);
  };
}

}  // namespace upswing::realaigym
