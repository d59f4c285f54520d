#include "extras/machine/twin/simulated_machine.h"

#include <algorithm>
#include <cmath>

#include "pendulum/sensors.h"
#include "pendulum/timestep.h"

namespace upswing::machine {

SimulatedMachine::SimulatedMachine(const Twin& twin, const PendulumState& start)
    : twin_(twin), body_(BodyOf(twin)), drive_(twin.actuator.delay, twin.actuator.lag) {
  CheckTimestep(twin.plant, "twin", kShortestMotionStep);
  moments_.push_back({0, start, body_.Acceleration(start, {})});
}

void SimulatedMachine::Advance(double time) {
  const double begin = moments_.back().time;
  const int steps = MotionSteps(body_, time - begin);
  const double h = (time - begin) / steps;
  if (h <= 0) return;
  MotionIntegrator integrator(body_, drive_);
  for (int i = 0; i < steps; ++i) {
    MotionPoint next = integrator.Step(moments_.back(), h);
    next.time = i + 1 == steps ? time : begin + (i + 1) * h;
    moments_.push_back(next);
  }
  const double oldest = time - std::max({twin_.actuator.current_delay, -twin_.actuator.delay, 0.0});
  while (moments_.size() > 2 && moments_[1].time <= oldest) moments_.pop_front();
  constexpr double kKept = 0.2;  // s
  drive_.Forget(time - kKept);
}

void SimulatedMachine::Command(const Joints& torque) {
  const double now = time();
  drive_.Add(now, torque);
  // Repeat the motion since a negative delay.
  while (moments_.size() > 1 && moments_.back().time > now + twin_.actuator.delay) {
    moments_.pop_back();
  }
  Advance(now);
}

void SimulatedMachine::Place(const PendulumState& state) {
  MotionIntegrator integrator(body_, drive_);
  moments_ = {integrator.Start(time(), state)};
}

MotionPoint SimulatedMachine::Ago(double age) const {
  if (age < 0) {
    MotionPoint moment = moments_.back();
    MotionIntegrator integrator(body_, drive_);
    const int steps = MotionSteps(body_, -age);
    for (int i = 0; i < steps; ++i) moment = integrator.Step(moment, -age / steps);
    return moment;
  }
  const double then = time() - age;
  if (then <= moments_.front().time) return moments_.front();
  size_t i = moments_.size() - 1;
  while (i > 0 && moments_[i - 1].time > then) --i;
  const MotionPoint &a = moments_[i - 1], &b = moments_[i];
  const double h = b.time - a.time, share = (then - a.time) / h;
  MotionPoint moment{then, StateBetween(a.state, b.state, h, share), {}};
  for (int j = 0; j < 2; ++j) {
    moment.acceleration[j] = a.acceleration[j] + share * (b.acceleration[j] - a.acceleration[j]);
  }
  return moment;
}

MachineReading SimulatedMachine::Read() const {
  const MachineSensors& sensors = twin_.sensors;
  const MotionPoint late = Ago(twin_.actuator.current_delay);
  int cursor = 0;
  const Joints torque = drive_.At(late.time, cursor);
  MachineReading reading{{state().q1 + sensors.zero1, state().q2 + sensors.zero2}, {}};
  for (int j = 0; j < 2; ++j) {
    double& angle = reading.angle[j];
    angle = Quantized(angle, sensors.quantum);
    angle = std::clamp(angle, -sensors.angle_range, sensors.angle_range);
    reading.torque[j] = Quantized(torque[j] - twin_.actuator.current_inertia * late.acceleration[j],
                                  sensors.torque_quantum);
  }
  return reading;
}

Joints VelocityEstimate::Update(double time, const Joints& angle) {
  Joints seen{};
  for (int j = 0; j < 2; ++j) {
    const double difference = first_ || time <= time_ ? 0 : (angle[j] - angle_[j]) / (time - time_);
    velocity_[j] += sensors_.velocity_share * (difference - velocity_[j]);
    seen[j] = std::abs(velocity_[j]) < sensors_.velocity_dead_zone ? 0 : velocity_[j];
  }
  first_ = false;
  time_ = time;
  angle_ = angle;
  return seen;
}

MachineLog RunLoop(const Twin& twin, const LoopRun& run, const CycleController& controller) {
  SimulatedMachine machine(twin, run.start);
  VelocityEstimate velocity(twin.sensors);
  Rng rng(run.seed, "machine: periods");
  const Joints limit = TorqueLimits(twin, run.actuated_joint);
  MachineLog log;
  log.name = twin.name;
  Joints command{}, push{};
  double time = 0;
  while (time <= run.seconds) {
    machine.Advance(time);
    Joints torque{};
    for (int j = 0; j < 2; ++j) torque[j] = std::clamp(command[j], -limit[j], limit[j]) + push[j];
    machine.Command(torque);
    const MachineReading reading = machine.Read();
    const CycleInput input{time, reading.angle, velocity.Update(time, reading.angle)};
    command = controller(input);
    if (run.push) push = run.push(time);
    log.time.push_back(time);
    log.angle.push_back(reading.angle);
    log.velocity.push_back(input.velocity);
    log.commanded.push_back(command);
    log.measured.push_back(reading.torque);
    if (run.push) log.push.push_back(push);
    bool within = true;
    for (int j = 0; j < 2; ++j) {
      within = within && std::abs(input.angle[j]) < run.largest_angle &&
               std::abs(input.velocity[j]) <= run.largest_velocity;
    }
    if (!within) break;
    double period = twin.loop.period + twin.loop.jitter * rng.Normal();
    if (rng.Uniform() < twin.loop.late_share) period += rng.Uniform(0, twin.loop.late);
    time += std::max(period, twin.loop.period / 10);
  }
  return log;
}

}  // namespace upswing::machine
