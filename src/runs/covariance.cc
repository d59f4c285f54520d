#include "runs/covariance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "agents/toml_settings.h"
#include "base/error.h"
#include "base/text.h"
#include "pendulum/posterior.h"

namespace upswing {
namespace {

constexpr size_t kMostUncertain = 64;
constexpr double kRounding = 1e-6;

/// The numbers of a twin that are not settings of its plant (extras/machine/twin/twin.h).
constexpr std::array kOfMachine{
    "delay",           "lag",           "passive_limit",  "current_delay",
    "current_inertia", "quantum",       "angle_range",    "torque_quantum",
    "zero1",           "zero2",         "velocity_share", "velocity_dead_zone",
    "period",          "jitter",        "late_share",     "late",
    "torque_offset1",  "torque_offset2"};
/// Its harmonics of cogging (extras/machine/twin/cogging.h). Each has a sine and a cosine at each
/// joint.
constexpr std::array kHarmonics{"pole_pairs", "slots",   "poles", "2_slots",
                                "2_poles",    "3_slots", "common"};

/// Throws BadInput unless `name` is one number of a twin. An alias such as `mass` is two.
void CheckName(const std::string& name, const std::string& place) {
  const Plant plant;
  const Options options = OptionsOf(plant);
  std::vector<std::string> known(kOfMachine.begin(), kOfMachine.end());
  for (const char* harmonic : kHarmonics) {
    for (const char* kind : {"sine1_", "sine2_", "cosine1_", "cosine2_"}) {
      known.push_back(Concat(kind, harmonic));
    }
  }
  for (const Option& option : options.all()) {
    const bool is_number = std::holds_alternative<double*>(option.target) && option.step == 0;
    if (is_number) known.push_back(option.name);
  }
  if (std::ranges::find(known, name) != known.end()) return;
  throw BadInput(Concat(place, ": expected the name of one number of a machine, got \"",
                        Printable(name), "\"", DidYouMean(name, known)));
}

/// Appends the row of a value to the covariance (n × n). Throws BadInput.
void AddRow(const toml::node& node, size_t n, const std::string& place, Covariance& covariance) {
  const toml::array* row = node.as_array();
  if (row == nullptr || row->size() != n) {
    throw BadInput(Concat(place, ": expected a list of ", n, " numbers, one for each row, got ",
                          row == nullptr ? "no list" : std::to_string(row->size())));
  }
  for (const toml::node& item : *row) {
    const std::optional<double> value = item.value<double>();
    if (!value || !std::isfinite(*value)) {
      throw BadInput(Concat(place, ": expected finite numbers, got another value"));
    }
    covariance.values.push_back(*value + 0.0);  // turns -0 into 0
  }
}

bool IsSymmetric(const Covariance& covariance) {
  const size_t n = covariance.names.size();
  const auto at = [&](size_t i, size_t j) { return covariance.values[i * n + j]; };
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < i; ++j) {
      const double scale = std::sqrt(std::abs(at(i, i))) * std::sqrt(std::abs(at(j, j)));
      if (std::abs(at(i, j) - at(j, i)) > kRounding * scale) return false;
    }
  }
  return true;
}

}  // namespace

Covariance TakeCovariance(toml::table& document, const std::string& where) {
  Covariance covariance;
  const toml::node* node = document.get("covariance");
  if (node == nullptr) return covariance;
  const std::string place = PlaceOf(*node, where);
  const toml::table* table = node->as_table();
  if (table == nullptr) {
    throw BadInput(Concat(place, ": covariance: expected a table, got another type"));
  }
  if (table->size() > kMostUncertain) {
    throw BadInput(Concat(place, ": [covariance]: expected at most ", kMostUncertain,
                          " values, got ", table->size()));
  }
  // The order of the rows in the file gives the order of the columns.
  std::vector<std::pair<toml::source_position, std::string>> order;
  for (const auto& [name, row] : *table) {
    order.emplace_back(name.source().begin, std::string(name.str()));
  }
  std::ranges::sort(order, [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [position, name] : order) {
    const toml::node& row = *table->get(name);
    CheckName(name, Concat(PlaceOf(row, where), ": [covariance]"));
    AddRow(row, order.size(), Concat(PlaceOf(row, where), ": ", Printable(name)), covariance);
    covariance.names.push_back(name);
  }
  if (!IsSymmetric(covariance)) {
    throw BadInput(Concat(where, ": [covariance]: expected a symmetric matrix, got another one"));
  }
  document.erase("covariance");
  return covariance;
}

std::string PosteriorText(const Covariance& covariance) {
  // The values of a simulated task are sums of the machine's values.
  std::vector<std::string> names;
  std::vector<std::vector<size_t>> terms;
  const size_t n = covariance.names.size();
  std::vector<size_t> latency;
  for (size_t i = 0; i < n; ++i) {
    const std::string& name = covariance.names[i];
    if (name == "delay" || name == "lag") latency.push_back(i);
    if (!Posterior::Knows(name)) continue;
    names.push_back(name);
    terms.push_back({i});
  }
  if (names.empty()) return "";
  if (!latency.empty()) {
    names.emplace_back("sensor_latency");
    terms.push_back(latency);
  }
  std::vector<double> values;
  for (const std::vector<size_t>& row : terms) {
    for (const std::vector<size_t>& column : terms) {
      double sum = 0;
      for (const size_t i : row) {
        for (const size_t j : column) sum += covariance.values[i * n + j];
      }
      values.push_back(sum);
    }
  }
  return Posterior::Text(names, values);
}

}  // namespace upswing
