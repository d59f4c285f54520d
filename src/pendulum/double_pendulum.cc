// The double pendulum as formulas. Symbols: q1, q2 joint angles (rad; 0 hanging, q2 relative to
// link 1), w1, w2 their velocities (rad/s), m mass (kg), l length (m), g gravity (m/s²), tau torque
// of the motor (N·m). All constants come from the post "Balancing a Double Pendulum with DQN and
// MuJoCo".
#include "pendulum/double_pendulum.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"

namespace upswing {

void Plant::Describe(Options& o) {
  constexpr Range kMass{0.01, 100}, kLength{0.1, 10}, kDamping{0, 100};
  o.Section("plant");
  o.Add(&mass1, "mass1", kMass, "kg", "mass of link 1");
  o.Add(&mass2, "mass2", kMass, "kg", "mass of link 2");
  o.Add(&length1, "length1", kLength, "m", "length of link 1");
  o.Add(&length2, "length2", kLength, "m", "length of link 2");
  o.Add(&damping1, "damping1", kDamping, "N·m·s/rad", "damping of joint 1");
  o.Add(&damping2, "damping2", kDamping, "N·m·s/rad", "damping of joint 2");
  o.Add(&gravity, "gravity", {0.01, 100}, "m/s²", "downward gravity");
  o.Add(&torque_limit, "torque_limit", {0.01, 1000}, "N·m", "largest torque of the motor");
  Option& joint = o.Add(&actuated_joint, "actuated_joint", {1, 2}, "",
                        "joint that the motor drives; 1: pendubot, 2: acrobot");
  joint.step = 1;
  joint.implied = true;
  o.Add(&rotor_inertia, "rotor_inertia", {0, 1}, "kg·m²", "rotor inertia of each joint's motor")
      .implied = true;
  o.Add(&gear_ratio, "gear_ratio", {0, 1000}, "", "gear ratio: rotor turns per joint turn")
      .implied = true;
  o.Add(&coulomb1, "coulomb1", {0, 10}, "N·m",
        "dry friction of joint 1: c in c·atan(100 w), w the joint's velocity")
      .implied = true;
  o.Add(&coulomb2, "coulomb2", {0, 10}, "N·m",
        "dry friction of joint 2: c in c·atan(100 w), w the joint's velocity")
      .implied = true;
  constexpr Range kCenter{0, 10}, kInertia{0, 10000};
  o.Add(&center1, "center1", kCenter, "m",
        "distance from joint 1 to the centre of mass of link 1; 0: half of length1")
      .implied = true;
  o.Add(&center2, "center2", kCenter, "m",
        "distance from joint 2 to the centre of mass of link 2; 0: half of length2")
      .implied = true;
  o.Add(&inertia1, "inertia1", kInertia, "kg·m²",
        "moment of inertia of link 1 about its centre of mass; 0: that of a solid capsule")
      .implied = true;
  o.Add(&inertia2, "inertia2", kInertia, "kg·m²",
        "moment of inertia of link 2 about its centre of mass; 0: that of a solid capsule")
      .implied = true;
  o.Add(&armature, "armature", {0, 10}, "kg·m²", "armature of each joint, without rotors").implied =
      true;
  o.Alias("mass", {"mass1", "mass2"});
  o.Alias("length", {"length1", "length2"});
  o.Alias("damping", {"damping1", "damping2"});
}

std::vector<std::pair<std::string, double>> PlantValues(const Plant& plant) {
  std::vector<std::pair<std::string, double>> values;
  const Options options = OptionsOf(plant);
  const Plant usual;
  const Options defaults = OptionsOf(usual);
  for (size_t i = 0; i < options.all().size(); ++i) {
    const Option& option = options.all()[i];
    if (option.implied && option.number() == defaults.all()[i].number()) continue;
    values.emplace_back(option.name, option.number());
  }
  return values;
}

void RewardWeights::Describe(Options& o) {
  constexpr Range kWeight{0, 1000};
  auto& [energy, height, balance, velocity, torque] = weight;
  o.Section("reward");
  o.Add(&energy, "energy_weight", kWeight, "", "reward weight of the energy term");
  o.Add(&height, "height_weight", kWeight, "", "reward weight of the height term");
  o.Add(&balance, "balance_weight", kWeight, "", "reward weight of the balance term");
  o.Add(&velocity, "velocity_weight", kWeight, "", "reward weight of the velocity penalty");
  o.Add(&torque, "torque_weight", kWeight, "", "reward weight of the torque penalty");
}

CapsuleInertia::CapsuleInertia(double m, double r, double l) {
  // The mass splits by volume between the cylinder and the two half spheres.
  const double cylinder = std::numbers::pi * r * r * l;
  const double sphere = 4.0 / 3.0 * std::numbers::pi * r * r * r;
  const double mc = m * cylinder / (cylinder + sphere);
  const double ms = m - mc;
  across = mc * (3 * r * r + l * l) / 12 + ms * (2 * r * r / 5 + l * l / 4 + 3 * l * r / 8);
  along = mc * r * r / 2 + ms * 2 * r * r / 5;
}

std::array<Link, 2> LinksOf(const Plant& p) {
  const auto link = [](double m, double l, double c, double I) {
    return Link{m, l, c > 0 ? c : l / 2, I > 0 ? I : CapsuleInertia(m, kCapsuleRadius, l).across};
  };
  return {link(p.mass1, p.length1, p.center1, p.inertia1),
          link(p.mass2, p.length2, p.center2, p.inertia2)};
}

std::array<Link, 2> TaskLinksOf(const Plant& p) {
  if (p.has_own_links()) return LinksOf(p);
  const auto rod = [](double m, double l) { return Link{m, l, l / 2, m * l * l / 12}; };
  return {rod(p.mass1, p.length1), rod(p.mass2, p.length2)};
}

double Armature1(const Plant& plant) {
  return plant.armature + plant.gear_ratio * plant.gear_ratio * plant.rotor_inertia;
}

PendulumState StateBetween(const PendulumState& a, const PendulumState& b, double h, double share) {
  const double s = share, s2 = s * s, s3 = s2 * s;
  const auto angle = [&](double q0, double w0, double q1, double w1) {
    return (2 * s3 - 3 * s2 + 1) * q0 + (s3 - 2 * s2 + s) * h * w0 + (3 * s2 - 2 * s3) * q1 +
           (s3 - s2) * h * w1;
  };
  const auto velocity = [&](double q0, double w0, double q1, double w1) {
    return 6 * (s2 - s) * (q0 - q1) / h + (3 * s2 - 4 * s + 1) * w0 + (3 * s2 - 2 * s) * w1;
  };
  return {angle(a.q1, a.w1, b.q1, b.w1), angle(a.q2, a.w2, b.q2, b.w2),
          velocity(a.q1, a.w1, b.q1, b.w1), velocity(a.q2, a.w2, b.q2, b.w2)};
}

double Energy(const Plant& plant, const PendulumState& s) {
  const auto links = TaskLinksOf(plant);
  const auto& [m1, l1, c1, I1] = links[0];
  const auto& [m2, l2, c2, I2] = links[1];
  const double g = plant.gravity;
  const double w12 = s.w1 + s.w2;  // absolute velocity of link 2
  const double potential =
      -m1 * g * c1 * std::cos(s.q1) - m2 * g * (l1 * std::cos(s.q1) + c2 * std::cos(s.q1 + s.q2));
  const double v1_squared = c1 * c1 * s.w1 * s.w1;  // of the centre of link 1
  const double v2_squared = l1 * l1 * s.w1 * s.w1 + c2 * c2 * w12 * w12 +
                            2 * l1 * c2 * std::cos(s.q2) * s.w1 * w12;  // of the centre of link 2
  const double kinetic =
      0.5 * (I1 * s.w1 * s.w1 + I2 * w12 * w12 + m1 * v1_squared + m2 * v2_squared);
  return kinetic + potential;
}

double EnergyTarget(const Plant& plant) {
  const auto [link1, link2] = TaskLinksOf(plant);
  return link1.m * plant.gravity * link1.c + link2.m * plant.gravity * (link1.l + link2.c);
}

double NormalizedEnergy(const Plant& plant, const PendulumState& s) {
  const double target = EnergyTarget(plant);
  return (Energy(plant, s) + target) / (2 * target);
}

double TipHeight(const Plant& plant, const PendulumState& s) {
  return -plant.length1 * std::cos(s.q1) - plant.length2 * std::cos(s.q1 + s.q2);
}

bool Inverted(const PendulumState& s) {
  constexpr double kCos30 = std::numbers::sqrt3 / 2;
  return -std::cos(s.q1) >= kCos30 && -std::cos(s.q1 + s.q2) >= kCos30;
}

double MotorAngle(const Plant& plant, const PendulumState& s) {
  return plant.actuated_joint == 1 ? s.q1 : s.q2;
}

double Wrapped(double angle) {
  constexpr double kTurn = 2 * std::numbers::pi;
  return angle - kTurn * std::nearbyint(angle / kTurn);
}

std::array<double, 2> Lean(const PendulumState& s) {
  return {Wrapped(s.q1 - std::numbers::pi), Wrapped(s.q1 + s.q2 - std::numbers::pi)};
}

std::array<float, kObservationSize> Observe(const Plant& plant, const PendulumState& s) {
  const double height = TipHeight(plant, s) / (plant.length1 + plant.length2);
  const std::array<double, kObservationSize> obs{
      std::cos(s.q1), std::sin(s.q1),       s.w1 / kMaxVelocity1,       std::cos(s.q2),
      std::sin(s.q2), s.w2 / kMaxVelocity2, NormalizedEnergy(plant, s), height};
  std::array<float, kObservationSize> result;
  std::transform(obs.begin(), obs.end(), result.begin(),
                 [](double x) { return static_cast<float>(x); });
  return result;
}

void Remember(std::span<const float> before, double torque, int steps, std::span<float> obs) {
  const size_t first = obs.size() - static_cast<size_t>(steps) * kMemorySize;
  const auto entry = obs.subspan(first, kMemorySize);
  entry[0] = (obs[2] - before[2]) * static_cast<float>(kMaxVelocity1 / kMemoryVelocity);
  entry[1] = (obs[5] - before[5]) * static_cast<float>(kMaxVelocity2 / kMemoryVelocity);
  entry[2] = static_cast<float>(torque / kMemoryTorque);
  const auto older = before.subspan(first).first(obs.size() - first - kMemorySize);
  std::ranges::copy(older, obs.subspan(first + kMemorySize).begin());
}

ObservationInfo ObservationInfoOf(int64_t memory, bool identified) {
  ObservationInfo observation{
      {"cos q1", "sin q1", "w1", "cos q2", "sin q2", "w2", "energy", "height"},
      {kMaxVelocity1, kMaxVelocity2},
      {},
      {}};
  if (identified) {
    observation.identified = {
        {"J1", "J2", "b", "G1", "G2", "d1", "d2", "delta", "tanh(0.1 / delta)", "identified energy",
         "faster fall", "slower fall", "torque against the falls"},
        kConstantScale};
  }
  if (memory > 0) {
    observation.memory = {
        memory, {"change of w1", "change of w2", "torque"}, kMemoryVelocity, kMemoryTorque};
  }
  return observation;
}

std::array<double, kRewardTerms> RewardTerms(const Plant& plant, const PendulumState& s,
                                             double tau) {
  const bool inverted = Inverted(s);
  const double height = TipHeight(plant, s) / (plant.length1 + plant.length2);
  return {
      std::clamp(NormalizedEnergy(plant, s), 0.0, 1.5),
      (height + 1) / 2,
      inverted ? 5.0 : 0.0,
      inverted ? -0.01 * (s.w1 * s.w1 + s.w2 * s.w2) : 0.0,
      (inverted ? -0.05 : -0.01) * tau * tau,
  };
}

std::string Mjcf(const Plant& plant) {
  // The model has no contacts and no constraints. Disabling these stages saves time and does not
  // change the trajectory.
  std::string mjcf = R"(<mujoco model="double_pendulum">@size
  <option gravity="0 0 -@gravity" timestep="0.005" integrator="RK4">
    <flag contact="disable" constraint="disable"/>
  </option>
  <worldbody>
    <body name="link1">
      <joint name="joint1" type="hinge" axis="0 1 0" damping="@damping1" armature="@armature1"@friction1/>@inertial1
      <geom type="capsule" size="0.04" fromto="0 0 0 0 0 -@length1" mass="@mass1"/>
      <body name="link2" pos="0 0 -@length1">
        <joint name="joint2" type="hinge" axis="0 1 0" damping="@damping2" armature="@armature"@friction2/>@inertial2
        <geom type="capsule" size="0.04" fromto="0 0 0 0 0 -@length2" mass="@mass2"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="torque@actuated_joint" joint="joint@actuated_joint" ctrllimited="true" ctrlrange="-@torque_limit @torque_limit"/>
  </actuator>@tendon
</mujoco>
)";
  // @name stands for the parameter of this name, or for a part defined below.
  const auto fill = [&](const std::string& field, const std::string& text) {
    mjcf = Replaced(std::move(mjcf), field, text);
  };
  const bool rotors = plant.rotor_inertia != 0, friction = plant.has_dry_friction();
  fill("@armature1", FormatNumber(Armature1(plant)));
  fill("@tendon", rotors ? R"(
  <tendon>
    <fixed name="rotor2" armature="@rotor_inertia">
      <joint joint="joint1" coef="1"/>
      <joint joint="joint2" coef="-@gear_ratio"/>
    </fixed>
  </tendon>)"
                         : "");
  fill("@size", friction ? "\n  <size nuser_jnt=\"1\"/>" : "");
  for (const std::string joint : {"1", "2"}) {
    fill("@friction" + joint,
         friction ? Concat(" frictionloss=\"@coulomb", joint, "\" user=\"", kFrictionSlope, '"')
                  : "");
  }
  const auto inertial = [&](const Link& link, const std::string& indent) {
    // The moment of inertia about the link's axis moves nothing. MuJoCo takes at most twice I.
    const double along = std::min(CapsuleInertia(link.m, kCapsuleRadius, link.l).along, link.I);
    const std::string I = FormatNumber(link.I);
    return Concat(indent, "<inertial pos=\"0 0 -", FormatNumber(link.c), "\" mass=\"",
                  FormatNumber(link.m), "\" diaginertia=\"", I, ' ', I, ' ', FormatNumber(along),
                  "\"/>");
  };
  const auto [link1, link2] = LinksOf(plant);
  fill("@inertial1", plant.has_own_links() ? inertial(link1, "\n      ") : "");
  fill("@inertial2", plant.has_own_links() ? inertial(link2, "\n        ") : "");
  const Options options = OptionsOf(plant);
  for (const Option& option : options.all()) fill("@" + option.name, option.text());
  return mjcf;
}

}  // namespace upswing
