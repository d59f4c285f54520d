#include "pendulum/posterior.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr double kRounding = 1e-6;  // of a correlation
// Smallest centre of mass and inertia of a link that is no capsule: those of 0 are a capsule's.
constexpr double kSmallestCenter = 1e-5, kSmallestInertia = 1e-9;  // m, kg·m²

/// A value of the sensors that a posterior may have.
struct SensorValue {
  std::string_view name;
  double SensorModel::*value;
};
constexpr SensorValue kSensorValues[] = {{"sensor_latency", &SensorModel::latency},
                                         {"zero1", &SensorModel::zero1},
                                         {"zero2", &SensorModel::zero2}};

// Parameters of the plant that identification cannot find.
constexpr std::string_view kCertain[] = {"torque_limit", "actuated_joint", "rotor_inertia",
                                         "gear_ratio", "armature1"};

}  // namespace

Range UncertainRange(const Option& option) {
  Range range = option.range;
  if (option.name.starts_with("center")) range.low = kSmallestCenter;
  if (option.name.starts_with("inertia")) range.low = kSmallestInertia;
  return range;
}

std::optional<std::vector<double>> FactorRow(const std::vector<double>& covariance,
                                             const std::vector<std::vector<double>>& rows) {
  std::vector<double> L(covariance.size());
  double rest = covariance.back();  // variance that the values above do not explain
  const double variance = covariance.back();
  for (size_t j = 0; j < rows.size(); ++j) {
    double sum = covariance[j], variance_j = 0;
    for (size_t k = 0; k < j; ++k) sum -= L[k] * rows[j][k];
    for (const double entry : rows[j]) variance_j += entry * entry;
    const double pivot = rows[j].back();
    const double rounding = kRounding * std::sqrt(variance_j * std::max(variance, 0.0));
    if (pivot == 0 && std::abs(sum) > rounding) return std::nullopt;
    L[j] = pivot == 0 ? 0 : sum / pivot;
    rest -= L[j] * L[j];
  }
  if (!(rest >= -kRounding * variance)) return std::nullopt;
  // A value that depends on others has only rounding left.
  L.back() = rest > kRounding * kRounding * variance ? std::sqrt(rest) : 0;
  return L;
}

bool Posterior::Knows(std::string_view name) {
  return std::ranges::count(kSensorValues, name, &SensorValue::name) > 0 ||
         (std::ranges::count(kPlantParameters, name, &PlantParameter::name) > 0 &&
          std::ranges::count(kCertain, name) == 0);
}

std::string Posterior::Text(const std::vector<std::string>& names,
                            const std::vector<double>& covariance) {
  std::vector<std::string> rows;
  for (size_t i = 0; i < names.size(); ++i) {
    std::vector<std::string> words{names[i]};
    for (size_t j = 0; j <= i; ++j) words.push_back(FormatNumber(covariance[i * names.size() + j]));
    rows.push_back(Join(words, " "));
  }
  return Join(rows, "; ");
}

Posterior Posterior::Parse(std::string_view text, const std::string& where) {
  Posterior posterior;
  const Disturbance disturbance;
  const Plant plant;
  Options options = OptionsOf(plant);
  options.AddMissing(OptionsOf(disturbance));
  std::vector<std::string> names;
  for (const std::string_view row : Split(text, ';')) {
    const std::vector<std::string> words = Words(row);
    const size_t n = posterior.rows_.size() + 1;
    const std::string name = words.empty() ? "" : words.front();
    if (!Knows(name) || std::ranges::find(names, name) != names.end()) {
      throw BadInput(Concat(where, ": expected rows with different values of a machine, got \"",
                            Printable(name), "\""));
    }
    names.push_back(name);
    std::vector<double> covariance;
    for (const std::string& word : std::span(words).subspan(1)) {
      const std::optional<double> number = ParseNumber(word);
      if (number && std::isfinite(*number)) covariance.push_back(*number);
    }
    if (covariance.size() != n || words.size() != n + 1) {
      throw BadInput(Concat(where, ": ", name, ": expected ", n, " finite numbers"));
    }
    std::optional<std::vector<double>> L = FactorRow(covariance, posterior.rows_);
    if (!L) throw BadInput(Concat(where, ": expected a positive matrix, got another one"));
    posterior.rows_.push_back(std::move(*L));
    Value value{.range = UncertainRange(*options.Get(name))};
    for (const PlantParameter& parameter : kPlantParameters) {
      if (parameter.name == name) value.of_plant = parameter.value;
    }
    for (const SensorValue& sensor : kSensorValues) {
      if (sensor.name == name) value.of_sensors = sensor.value;
    }
    posterior.values_.push_back(value);
  }
  return posterior;
}

void Posterior::Deviate(Plant& plant, Disturbance& disturbance, Rng& rng) const {
  std::vector<double> z;
  for (size_t i = 0; i < values_.size(); ++i) z.push_back(rng.Normal());
  for (size_t i = 0; i < values_.size(); ++i) {
    const auto [of_plant, of_sensors, range] = values_[i];
    double& value = of_plant != nullptr ? plant.*of_plant : disturbance.sensors.*of_sensors;
    for (size_t j = 0; j <= i; ++j) value += rows_[i][j] * z[j];
    value = std::clamp(value, range.low, range.high);
  }
}

Disturbance Posterior::Largest(const Disturbance& nominal) const {
  Disturbance largest = nominal;
  for (const Value& value : values_) {
    if (value.of_sensors != nullptr) largest.sensors.*value.of_sensors = value.range.high;
  }
  return largest;
}

}  // namespace upswing
