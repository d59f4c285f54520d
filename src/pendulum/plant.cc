#include "pendulum/plant.h"

#include <numbers>

#include "base/text.h"

namespace upswing {

namespace {

// From 1 g and 1 cm on, which is smaller than any machine so far.
constexpr Range kMass{1e-3, 1e5}, kLength{0.01, 100}, kDamping{0, 1e6}, kCoulomb{0, 1e5};
constexpr Range kCenter{0, 100}, kInertia{0, 1e9}, kJoint{1, 2}, kRotor{0, 1e3};

}  // namespace

const std::array<PlantParameter, 19> kPlantParameters{{
    {"mass1", &Plant::mass1, kMass, "kg", "mass of link 1"},
    {"mass2", &Plant::mass2, kMass, "kg", "mass of link 2"},
    {"length1", &Plant::length1, kLength, "m", "length of link 1"},
    {"length2", &Plant::length2, kLength, "m", "length of link 2"},
    {"damping1", &Plant::damping1, kDamping, "N·m·s/rad", "damping of joint 1"},
    {"damping2", &Plant::damping2, kDamping, "N·m·s/rad", "damping of joint 2"},
    {"gravity", &Plant::gravity, {0.01, 100}, "m/s²", "downward gravity"},
    {"torque_limit", &Plant::torque_limit, {1e-3, 1e6}, "N·m", "largest torque of the motor"},
    {"actuated_joint", &Plant::actuated_joint, kJoint, "",
     "joint that the motor drives; 1: pendubot, 2: acrobot"},
    {"rotor_inertia", &Plant::rotor_inertia, kRotor, "kg·m²",
     "rotor inertia of each joint's motor"},
    {"gear_ratio", &Plant::gear_ratio, {0, 1000}, "", "gear ratio: rotor turns per joint turn"},
    {"coulomb1", &Plant::coulomb1, kCoulomb, "N·m",
     "dry friction of joint 1: c in c·atan(100 w), w the joint's velocity"},
    {"coulomb2", &Plant::coulomb2, kCoulomb, "N·m",
     "dry friction of joint 2: c in c·atan(100 w), w the joint's velocity"},
    {"center1", &Plant::center1, kCenter, "m",
     "distance from joint 1 to the centre of mass of link 1; 0: half of length1"},
    {"center2", &Plant::center2, kCenter, "m",
     "distance from joint 2 to the centre of mass of link 2; 0: half of length2"},
    {"inertia1", &Plant::inertia1, kInertia, "kg·m²",
     "moment of inertia of link 1 about its centre of mass; 0: that of a solid capsule"},
    {"inertia2", &Plant::inertia2, kInertia, "kg·m²",
     "moment of inertia of link 2 about its centre of mass; 0: that of a solid capsule"},
    {"armature", &Plant::armature, {0, 1e6}, "kg·m²", "armature of each joint, without rotors"},
    {"armature1",
     &Plant::armature1,
     {0, 1e6},
     "kg·m²",
     "armature of joint 1 if it differs, without rotors; -1: armature"},
}};

void Plant::Describe(Options& o) {
  o.Section("plant");
  for (const auto& [name, value, range, unit, help] : kPlantParameters) {
    Option& option = o.Add(&(this->*value), name, range, unit, help);
    if (value == &Plant::actuated_joint) option.step = 1;
    if (value == &Plant::armature1) option.sentinel = -1;
  }
  o.Alias("mass", {"mass1", "mass2"});
  o.Alias("length", {"length1", "length2"});
  o.Alias("damping", {"damping1", "damping2"});
}

std::vector<std::pair<std::string, double>> PlantValues(const Plant& plant) {
  std::vector<std::pair<std::string, double>> values;
  const Plant usual;
  for (size_t k = 0; k < kPlantParameters.size(); ++k) {
    const auto& parameter = kPlantParameters.at(k);
    const double value = plant.*parameter.value;
    if (k >= kMainParameters && value == usual.*parameter.value) continue;
    values.emplace_back(parameter.name, value);
  }
  return values;
}

double CapsuleRadius(double length) {
  constexpr double kShort = 0.1;   // m
  constexpr double kShare = 0.08;  // of the built-in plant
  return length < kShort ? kShare * length : kCapsuleRadius;
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
    return Link{m, l, c > 0 ? c : l / 2, I > 0 ? I : CapsuleInertia(m, CapsuleRadius(l), l).across};
  };
  return {link(p.mass1, p.length1, p.center1, p.inertia1),
          link(p.mass2, p.length2, p.center2, p.inertia2)};
}

double Armature1(const Plant& plant) {
  return plant.own_armature1() + plant.gear_ratio * plant.gear_ratio * plant.rotor_inertia;
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

}  // namespace upswing
