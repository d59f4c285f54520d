#include "control/controller.h"

#include <array>
#include <charconv>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "pendulum/observation.h"

namespace upswing {
namespace {

PolicyInfo InfoOf(const std::string& kind, const Options& settings, const DesignPlant& plant) {
  PolicyInfo info;
  info.agent = kind;
  info.task = kDoublePendulum;
  info.config = settings.Toml(false, [](const Option&) { return true; });
  for (const auto& [name, value] : PlantValues(plant)) info.plant[name] = value;
  info.control_period = plant.control_period;
  const Scale scale = TaskScaleOf(plant);
  SetScale(scale, info);
  info.observation = ObservationInfoOf(scale, 0);
  return info;
}

}  // namespace

StateVector UprightDeviation(const StateVector& x) {
  return {Wrapped(x[0] - std::numbers::pi), Wrapped(x[1]), x[2], x[3]};
}

StateVector UprightDeviation(std::span<const float> obs, const Scale& scale) {
  // Sine and cosine of q1 - π are the negatives of those of q1.
  const auto angle = [](double sine, double cosine) { return std::atan2(sine, cosine); };
  return {angle(-obs[1], -obs[0]), angle(obs[4], obs[3]), kMaxVelocity1 * scale.velocity() * obs[2],
          kMaxVelocity2 * scale.velocity() * obs[5]};
}

StateVector Difference(const StateVector& x, const StateVector& y) {
  const StateVector d = x - y;
  return {Wrapped(d[0]), Wrapped(d[1]), d[2], d[3]};
}

std::string Rounded(double x) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.begin(), text.end(), x, std::chars_format::general, 4).ptr;
  return {text.begin(), end};
}

ComputedPolicy::ComputedPolicy(const std::string& kind, const Options& settings,
                               const DesignPlant& plant)
    : plant_(plant), info_(InfoOf(kind, settings, plant)) {}

std::unique_ptr<Policy::Memory> PendulumController::Start(int /*num_envs*/) const {
  return std::make_unique<Memory>();
}

void PendulumController::Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const {
  for (int i = 0; i < obs.rows(); ++i) {
    action(i, 0) =
        Limited(Torque(UprightDeviation(obs.row(i), scale()), static_cast<size_t>(i), memory));
  }
}

Tensors ComputedPolicy::ToTensors() const {
  throw BadInput(
      Concat(kind(), ": expected a policy that has a file, got a controller, which has none"));
}

}  // namespace upswing
