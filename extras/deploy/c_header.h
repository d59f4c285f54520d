#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "agents/controllers.h"
#include "extras/deploy/export.h"
#include "extras/deploy/exported_policy.h"

/// C headers: a comment, macros and tables, and a file of extras/deploy/c with the files that it
/// includes.
namespace upswing::deploy {

/// A file of extras/deploy/c, embedded by CMake.
struct CFile {
  std::string_view name, text;
};
std::span<const CFile> EmbeddedCFiles();

/// An array of constants.
struct CArray {
  std::string name, comment;
  std::vector<float> values;
};

/// Numbers as the values of an array.
std::vector<float> Floats(const auto& numbers) { return {numbers.begin(), numbers.end()}; }

/// The parts of a C header. Names of macros and arrays lack the prefix.
struct CParts {
  ExportedTask task;               // its state gives the arguments of the control function
  std::string origin;              // origin of the policy
  double limit = 0;                // N m
  double period = 0;               // s
  Plant plant;                     // of the training, or the design plant
  std::string plant_use;           // what the policy takes from the plant; empty: nothing
  std::string work;                // work of a call
  std::string note = {};           // what else a user needs to know; empty: nothing
  std::string code = "1 to 3 KB";  // size in flash
  bool has_goal = false;           // whether the goal is chosen at run time
  /// Name, and value with a comment.
  std::vector<std::pair<std::string, std::string>> macros;
  std::vector<CArray> constants;  // covered by the checksum
  std::string layers;             // definition of the table of layers, if there is one
  std::vector<CArray> samples;    // for the self-test
  size_t state_bytes = 0;         // of the struct
  size_t stack_bytes = 0;         // of the arrays of a call
};

/// N samples for a C header's self-test: states one control period apart, with the policy's
/// results. S state variables, O outputs of the network.
struct CSamples {
  std::vector<float> states, outputs, torques;       // (N × S), (N × O), (N)
  std::vector<float> identified;                     // (N × kIdentifiedSize), if the policy has it
  float output_tolerance = 0, torque_tolerance = 0;  // for other rounding
};

/// Draws the samples, the same in every call. `layers` are the layers of the header's network.
CSamples DrawSamples(const ExportedPolicy& policy, const std::vector<LayerView>& layers);

/// Adds the table and macros with which extras/deploy/c/equations.c simulates a plant, with
/// `physics_steps` in a control period.
void AddEquations(const Plant& plant, int physics_steps, CParts& parts);

/// Names of the controllers that have C code.
std::vector<std::string> ControllersInC();

/// Adds the tables, macros and samples of the controller mpc.
void AddPredictive(const LoadedPolicy& loaded, const ControllerConfig& config, CParts& parts);

/// The C header of a controller with C code. CHeaderOf checks the prefix. Throws BadInput for other
/// policies.
CHeader ControllerHeaderOf(const LoadedPolicy& loaded, const std::string& prefix);

/// Writes the text and the sizes of `header`, which already has the prefix.
void WriteHeader(const CParts& parts, CHeader& header);

}  // namespace upswing::deploy
