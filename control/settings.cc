#include "control/settings.h"

#include "sim/double_pendulum.h"

namespace upswing {

void LqrConfig::Describe(Options& o) {
  constexpr Range kWeight{0, 1e9};
  o.Section("lqr");
  // Those of Tedrake's Acrobot.
  o.Add(&q1, "lqr_q1", kWeight, "1/rad²", "weight of the angle of link 1 from upright");
  o.Add(&q2, "lqr_q2", kWeight, "1/rad²", "weight of the angle of link 2 to link 1");
  o.Add(&w1, "lqr_w1", kWeight, "s²/rad²", "weight of the velocity of q1");
  o.Add(&w2, "lqr_w2", kWeight, "s²/rad²", "weight of the velocity of q2");
  o.Add(&torque, "lqr_torque", kPositive, "1/(N·m)²", "weight of the torque");
}

void MpcConfig::Describe(Options& o) {
  o.Section("mpc");
  o.Add(&seconds, "mpc_seconds", {0.1, 10}, "s", "how far ahead it plans").step = kControlPeriod;
  o.Add(&iterations, "mpc_iterations", {1, 1000}, "", "improvements of the plan at each decision");
}

void SwingUpConfig::Describe(Options& o) {
  o.Section("tvlqr");
  o.Add(&seconds, "tvlqr_seconds", {0.2, 30}, "s", "length of the planned swing-up").step =
      kControlPeriod;
  o.Add(&reserve, "tvlqr_reserve", {0, 0.9}, "",
        "share of the motor's torque that the plan leaves to the feedback");
}

void EnergyShapingConfig::Describe(Options& o) {
  // Of 1,900 tried at random these brought up most starts with the standard motor.
  o.Section("energy");
  o.Add(&kE, "energy_ke", kNotNegative, "1/(J²·s)", "weight of the energy's square in V");
  o.Add(&kD, "energy_kd", kPositive, "s", "weight of the square of w1 in V");
  o.Add(&kP, "energy_kp", kNotNegative, "1/s", "weight of the square of q1 from upright in V");
}

void PartialFeedbackConfig::Describe(Options& o) {
  // The same of 800.
  o.Section("pfl");
  o.Add(&kP, "pfl_kp", kNotNegative, "1/s²", "gain of the angle of link 1 from upright");
  o.Add(&kD, "pfl_kd", kNotNegative, "1/s", "gain of its velocity");
  o.Add(&kE, "pfl_ke", kNotNegative, "1/(J·s)", "gain of the energy that is missing");
}

}  // namespace upswing
