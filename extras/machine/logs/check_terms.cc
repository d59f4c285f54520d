#include "extras/machine/logs/check_terms.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pendulum/regressor.h"

namespace upswing::machine {

int SpanOf(double cycle) {
  constexpr double kSpan = 0.01;  // s
  return std::max(1, static_cast<int>(std::lround(kSpan / cycle)));
}

Window WindowAt(const MachineLog& log, int first, int last, int span, double cycle) {
  Window window;
  for (int k = first; k <= last; ++k) {
    const double before = k > first ? log.time[k] - log.time[k - 1] : 0;
    const double after = k < last ? log.time[k + 1] - log.time[k] : 0;
    const double apart = log.time[k + span] - log.time[k - span];
    if (std::max(before, after) > 5 * cycle || !(apart > 0)) return {};
    Sample s{(before + after) / 2, 0, log.angle[k], {}, {}};
    for (const int j : {0, 1}) {
      s.w[j] = (log.angle[k + span][j] - log.angle[k - span][j]) / apart;
      if (!log.measured.empty()) {
        s.tau[j] = log.measured[k][j];
      } else {
        s.tau[j] = (log.commanded.empty() ? 0 : log.commanded[k][j]) +
                   (log.push.empty() ? 0 : log.push[k][j]);
      }
    }
    window.push_back(s);
  }
  window.front().momentum = -1;
  window.back().momentum = 1;
  return window;
}

Window SmoothWindowAt(const MachineLog& log, int first, int last, int span, double cycle) {
  Window window = WindowAt(log, first, last, span, cycle);
  const double begin = log.time[first], length = log.time[last] - begin;
  for (size_t k = 0; k < window.size(); ++k) {
    const double phase = std::numbers::pi * (log.time[first + k] - begin) / length;
    Sample& s = window[k];
    // ∫ φ d/dt p = -∫ φ' p for a weight φ that is 0 at both ends.
    s.momentum = -s.force * std::numbers::pi / length * std::sin(2 * phase);
    s.force *= std::pow(std::sin(phase), 2);
  }
  return window;
}

std::array<Terms, 2> TermsOf(const Window& window) {
  using namespace column;
  std::array<Terms, 2> both{Terms::Zero(), Terms::Zero()};
  for (const Sample& sample : window) {
    const Joints &q = sample.q, &w = sample.w;
    const auto angles = dynamics::AnglesOf<double>({q[0], q[1]});
    const auto& [s1, c1, s2, c2] = angles;
    const auto plain = MomentumRegressorOf(angles, {w[0], w[1]});
    const auto turned1 = MomentumRegressorOf({c1, -s1, s2, c2}, {w[0], w[1]});
    const auto turned2 = MomentumRegressorOf({s1, c1, c2, -s2}, {w[0], w[1]});
    const double dt = sample.force, end = sample.momentum;
    for (const int row : {0, 1}) {
      Terms& terms = both[row];
      const auto& momentum = plain.momentum[row];
      const auto& force = plain.force[row];
      if (row == 0) {
        // (J1 + J2) w1 + J2 w2: the momentum of J1 is w1, that of J2 is w1 + w2.
        terms[kInertia] += end * momentum[kJ1];
        terms[kOther] += end * (momentum[kJ2] - momentum[kJ1]);
      } else {
        // J2 (w1 + w2) + a w2
        terms[kInertia] += end * momentum[kJ2];
        terms[kOther] += end * momentum[kA];
      }
      terms[kCoupling] += end * momentum[kB] + dt * force[kB];
      terms[kTurnedCoupling] += end * turned2.momentum[row][kB] + dt * turned2.force[row][kB];
      terms[kLink2] += dt * force[kG2];
      terms[kTurnedLink2] += dt * turned1.force[row][kG2];
      terms[kLink1] += dt * force[kG1];
      terms[kTurnedLink1] += dt * turned1.force[row][kG1];
      terms[kDamping] += w[row] * dt;
      terms[kFriction] += std::tanh(10 * w[row]) * dt;
      terms[kTorque1] += sample.tau[0] * dt;
      terms[kTorque2] += sample.tau[1] * dt;
    }
  }
  return both;
}

}  // namespace upswing::machine
