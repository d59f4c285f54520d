#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "agents/config.h"
#include "pendulum/plant.h"

/// A machine's plant in a file: a TOML table [plant] with the settings of Plant, and perhaps a
/// table [disturbance] with the settings of Disturbance. A twin also has a table [covariance].
namespace upswing {

struct PlantFile {
  Plant plant;  // settings that the file leaves out have their defaults
  // The settings of [disturbance]; with a covariance of the plant, also the setting `posterior`.
  std::vector<FlagValue> conditions;

  // Why the plant is not to be trusted, as the program says that identified it; empty: it is.
  std::string distrust;

  // Settings that change the motion of every machine and that the file leaves out, with their
  // defaults: `armature 0.01 kg·m², gravity 9.81 m/s²`; empty: none.
  std::string left_out;
  std::vector<std::string> defaults = {};  // the names of these settings

  /// Each setting of the plant, as a flag.
  std::vector<FlagValue> PlantFlags() const;

  std::string name;  // for messages
};

/// The key of a plant file that holds PlantFile::distrust.
inline constexpr const char* kDistrustKey = "distrust";

/// A file of configs/plants/, compiled into the program.
struct ShippedPlant {
  std::string_view name;
  std::string_view toml;
};

/// All plants of configs/plants/, sorted by name.
std::span<const ShippedPlant> EmbeddedPlants();

/// Parses a plant file. Tables that describe other parts of a machine are ignored. `where` names
/// the file in messages. Throws BadInput.
PlantFile ParsePlantFile(std::string_view toml, const std::string& where);

/// The text of a plant file, and its name for messages.
struct PlantDocument {
  std::string toml, where;
};

/// The text of the shipped plant of this name, or of the plant file at this path. Messages name the
/// argument `flag`, and what else it takes. Throws BadInput.
PlantDocument ReadPlantDocument(const std::string& name, const std::string& flag,
                                const std::string& else_taken = "");

/// The shipped plant of this name, or the plant file at this path. Messages name the argument
/// `flag`, and what else it takes. Throws BadInput.
PlantFile ReadPlantFile(const std::string& name, const std::string& flag = "--plant",
                        const std::string& else_taken = "");

/// Replaces the flags called `plant` by the settings of the last named plant file. These come
/// first, so that the other flags override them. Throws BadInput.
std::vector<FlagValue> WithPlantFile(const std::vector<FlagValue>& flags);

}  // namespace upswing
