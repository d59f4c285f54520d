#include "runs/plant_file.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>
#include <utility>

#include "agents/toml_settings.h"
#include "base/error.h"
#include "base/text.h"
#include "os/file.h"
#include "pendulum/posterior.h"
#include "runs/covariance.h"

namespace upswing {
namespace {

/// Largest size of a plant file, bytes.
constexpr size_t kMostPlantBytes = 1 << 20;

/// Tables of a plant file with the other parts of a machine.
constexpr std::array<std::string_view, 5> kOtherTables{"actuator", "cogging", "sensors", "loop",
                                                       "sessions"};

/// Removes kOtherTables. Throws BadInput unless each table left is one of a plant file.
void TakeOwnTables(toml::table& table, const std::string& where) {
  std::vector<std::string> known{"plant", "disturbance", "covariance"};
  for (const std::string_view other : kOtherTables) {
    known.emplace_back(other);
    if (table[other].is_table()) table.erase(other);
  }
  for (const auto& [key, node] : table) {
    const std::string name(key.str());
    if (!node.is_table() || std::ranges::find(known, name) != known.end()) continue;
    throw BadInput(Concat(PlaceOf(node, where), ": expected one of the tables ", Join(known, ", "),
                          ", got [", Printable(name), "]", DidYouMean(name, known)));
  }
  if (table["plant"].is_table()) return;
  const toml::node* other = table.get("plant");
  throw BadInput(Concat(other != nullptr ? PlaceOf(*other, where) : where,
                        ": expected a table [plant], got ",
                        other != nullptr ? "another type" : "none"));
}

}  // namespace

std::vector<FlagValue> PlantFile::PlantFlags() const {
  std::vector<FlagValue> flags;
  const Options options = OptionsOf(plant);
  for (const Option& option : options.all()) {
    flags.push_back({option.name, option.text(), Concat(name, ": ", option.name)});
  }
  return flags;
}

PlantFile ParsePlantFile(std::string_view toml, const std::string& where) {
  toml::table table = ParseToml(toml, where);
  PlantFile file;
  TakeText(table, "name", where);
  file.distrust = TakeText(table, kDistrustKey, where);
  TakeOwnTables(table, where);
  Disturbance disturbance;
  const Covariance covariance = TakeCovariance(table, where);
  const Options of_plant = OptionsOf(file.plant);
  Options all = of_plant;
  all.AddMissing(OptionsOf(disturbance));
  std::set<std::string> given;
  for (FlagValue& flag : ApplyTable(all, table, where, false)) {
    for (const Option* option : all.Find(flag.name, where)) given.insert(option->name);
    const std::string& first = all.Find(flag.name, where).front()->name;
    if (of_plant.Get(first) == nullptr) file.conditions.push_back(std::move(flag));
  }
  if (const std::string posterior = PosteriorText(covariance); !posterior.empty()) {
    const std::string place = Concat(where, ": [covariance]");
    Posterior::Parse(posterior, place);  // throws unless the matrix is positive
    file.conditions.push_back({"posterior", posterior, place});
  }
  std::vector<std::string> left_out;
  for (const char* name : {"damping1", "damping2", "gravity", "torque_limit", "armature"}) {
    const Option& option = *of_plant.Get(name);
    if (given.contains(name)) continue;
    file.defaults.emplace_back(name);
    left_out.push_back(Concat(name, " ", option.text(), " ", option.unit));
  }
  file.left_out = Join(left_out, ", ");
  file.name = where;
  return file;
}

PlantDocument ReadPlantDocument(const std::string& name, const std::string& flag,
                                const std::string& else_taken) {
  const auto plants = EmbeddedPlants();
  const auto shipped = std::ranges::find(plants, name, &ShippedPlant::name);
  if (shipped != plants.end()) return {std::string(shipped->toml), Concat("plant ", name)};
  if (!std::filesystem::exists(name)) {
    const std::vector<std::string> names = NamesOf(plants);
    const bool names_a_file = name.ends_with(".toml") || name.find('/') != std::string::npos;
    const std::string hint = names_a_file ? " (no such file)" : DidYouMean(name, names);
    throw BadInput(Concat(flag, ": expected ", else_taken, "a plant file (TOML) or one of ",
                          Join(names, ", "), ", got \"", Printable(name), "\"", hint));
  }
  return {ReadOwnFile(name, kMostPlantBytes), name};
}

PlantFile ReadPlantFile(const std::string& name, const std::string& flag,
                        const std::string& else_taken) {
  const auto [toml, where] = ReadPlantDocument(name, flag, else_taken);
  return ParsePlantFile(toml, where);
}

std::vector<FlagValue> WithPlantFile(const std::vector<FlagValue>& flags) {
  std::vector<FlagValue> result, others;
  for (const FlagValue& flag : flags) {
    if (flag.name != "plant") {
      others.push_back(flag);
      continue;
    }
    const PlantFile file = ReadPlantFile(flag.text, flag.where.empty() ? "--plant" : flag.where);
    result = file.PlantFlags();
    result.insert(result.end(), file.conditions.begin(), file.conditions.end());
  }
  result.insert(result.end(), others.begin(), others.end());
  return result;
}

}  // namespace upswing
