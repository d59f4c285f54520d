#include <algorithm>
#include <numbers>
#include <string>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/drive/learn.h"

namespace upswing::machine {

void LearnConfig::Describe(Options& o) {
  o.Section("learning");
  o.Add(&encoder_counts, "encoder_counts", {16, 1e9}, "1/turn", "steps of the encoders").usual =
      "none";
  o.Add(&hold, "hold", {1, 3600}, "s", "time of balance that ends the learning");
  o.Add(&motion, "motion", {10, 3600}, "s",
        "longest time with torques, pulses and braking included, all runs together")
      .usual = "60; more for a slower machine (--length)";
  o.Add(&computing, "computing", {1, 1e6}, "s", "longest processor time of models and controllers");
  o.Add(&hz, "hz", {100, 1000}, "1/s", "cycles per second").step = 1;
  o.Add(&length, "length", {0.02, 200}, "m",
        "length of both links together; with --max-torque it tells the size of the machine")
      .usual = "about that of RealAIGym's robot, 0.5";
}

Twin LearnConfig::Known() const {
  Twin twin;
  Plant& plant = twin.plant;
  if (length > 0 && limits.torque > 0) {
    plant = UsualPlant();
    const double longer = length / (plant.length1 + plant.length2);
    const double heavier = limits.torque / plant.torque_limit / longer;
    for (double Plant::*m : {&Plant::mass1, &Plant::mass2}) plant.*m *= heavier;
    for (double Plant::*l : {&Plant::length1, &Plant::length2, &Plant::center1, &Plant::center2}) {
      plant.*l *= longer;
    }
    for (double Plant::*I : {&Plant::inertia1, &Plant::inertia2, &Plant::armature}) {
      plant.*I *= heavier * longer * longer;
    }
  }
  plant.torque_limit = limits.torque;
  plant.actuated_joint = actuated_joint;
  twin.actuator.passive_limit = limits.passive_torque;
  twin.sensors.quantum = 2 * std::numbers::pi / encoder_counts;
  twin.sensors.velocity_share = 0.2;
  twin.sensors.velocity_dead_zone = 0.1 * ScaleOverUsual(plant).velocity();
  twin.loop.period = 1 / hz;
  return twin;
}

double LearnConfig::MostMotion() const {
  constexpr double kUsual = 60;  // s
  return motion > 0 ? motion : kUsual * std::max(1.0, ScaleOverUsual(Known().plant).time);
}

Limits LearnConfig::DefaultLimits(double torque) const {
  LearnConfig known = *this;
  known.limits.torque = torque;
  Twin twin = known.Known();
  twin.actuator.passive_limit = Limits().passive_torque * ScaleOverUsual(twin.plant).torque;
  Limits defaults = Limits::For(twin);
  defaults.angle = LearnConfig().limits.angle;
  return defaults;
}

void LearnConfig::Check() const {
  if (encoder_counts == 0) throw BadInput("machine learn: expected --encoder-counts, got none");
  const auto expect = [](const char* flag, double least, double got) {
    if (got >= least) return;
    throw BadInput(Concat(flag, ": expected ", least, " or more for a swing-up, got ", got));
  };
  expect("--max-angle", 3.5, limits.angle);
  expect("--max-energy", 1.1, limits.energy);
}

}  // namespace upswing::machine
