#include "control/settings.h"

namespace upswing {

LqrConfig LqrConfig::In(const Scale& scale) const {
  const double time2 = scale.time * scale.time, torque2 = scale.torque * scale.torque;
  return {q1, q2, w1 * time2, w2 * time2, torque / torque2};
}

MpcConfig MpcConfig::In(const Scale& scale) const {
  MpcConfig scaled = *this;
  scaled.seconds *= scale.time;
  return scaled;
}

SwingUpConfig SwingUpConfig::In(const Scale& scale) const {
  return {seconds * scale.time, reserve};
}

EnergyShapingConfig EnergyShapingConfig::In(const Scale& scale) const {
  // The unit of energy is that of torque.
  return {kE / (scale.torque * scale.torque * scale.time), kD * scale.time, kP / scale.time};
}

PartialFeedbackConfig PartialFeedbackConfig::In(const Scale& scale) const {
  return {kP / (scale.time * scale.time), kD / scale.time, kE / (scale.torque * scale.time)};
}

void LqrConfig::Describe(Options& o) {
  constexpr Range kWeight{0, 1e9};
  o.Section("lqr");
  // Weights from Tedrake's acrobot.
  o.Add(&q1, "lqr_q1", kWeight, "1/rad²", "LQR weight of q1, the angle of link 1 from upright");
  o.Add(&q2, "lqr_q2", kWeight, "1/rad²", "LQR weight of q2, the angle of link 2 to link 1");
  o.Add(&w1, "lqr_w1", kWeight, "s²/rad²", "LQR weight of w1, the velocity of q1");
  o.Add(&w2, "lqr_w2", kWeight, "s²/rad²", "LQR weight of w2, the velocity of q2");
  o.Add(&torque, "lqr_torque", kPositive, "1/(N·m)²", "LQR weight of the torque");
}

void MpcConfig::Describe(Options& o) {
  o.Section("mpc");
  o.Add(&seconds, "mpc_seconds", {0.1, 10}, "s", "planning horizon of mpc");
  o.Add(&iterations, "mpc_iterations", {1, 1000}, "",
        "optimisation steps of mpc's plan at each decision");
  o.Add(&guesses, "mpc_guesses", {1, 99}, "",
        "constant torques from which mpc searches its first plan, evenly spaced; 1: no torque");
  o.Add(&angle_range, "mpc_angle_range", {3.2, 1e6}, "rad",
        "largest angle, with full turns, of an upright that mpc aims at; the default is no limit");
  o.Add(&velocity, "mpc_velocity", {0.1, 1e6}, "rad/s",
        "velocity of the motor's joint above which mpc brakes; the default is no limit");
}

void SwingUpConfig::Describe(Options& o) {
  o.Section("tvlqr");
  o.Add(&seconds, "tvlqr_seconds", {0.2, 30}, "s", "length of the swing-up that tvlqr plans");
  o.Add(&reserve, "tvlqr_reserve", {0, 0.9}, "",
        "share of the torque limit that tvlqr's plan reserves for feedback");
}

void EnergyShapingConfig::Describe(Options& o) {
  // The best of 1,900 random settings: with the standard motor, most starts swing up.
  o.Section("energy");
  o.Add(&kE, "energy_ke", kNotNegative, "1/(J²·s)",
        "weight of the squared energy error in the Lyapunov function");
  o.Add(&kD, "energy_kd", kPositive, "s", "weight of w1 squared in the Lyapunov function");
  o.Add(&kP, "energy_kp", kNotNegative, "1/s",
        "weight of q1 squared, from upright, in the Lyapunov function");
}

void PartialFeedbackConfig::Describe(Options& o) {
  // The best of 800 random settings.
  o.Section("pfl");
  o.Add(&kP, "pfl_kp", kNotNegative, "1/s²", "gain of q1, the angle of link 1 from upright");
  o.Add(&kD, "pfl_kd", kNotNegative, "1/s", "gain of w1, the velocity of q1");
  o.Add(&kE, "pfl_ke", kNotNegative, "1/(J·s)", "gain of the energy error");
}

}  // namespace upswing
