#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "export/export.h"
#include "export/exported_policy.h"

/// A header in C: a comment, macros and tables, and a file of export/c with the files that it
/// includes.
namespace upswing {

/// A file of export/c, which CMake compiles in.
struct CFile {
  std::string_view name, text;
};
std::span<const CFile> EmbeddedCFiles();

/// An array of constants.
struct CArray {
  std::string name, comment;
  std::vector<float> values;
};

/// What a header is made of. Names of macros and arrays lack the prefix.
struct CParts {
  ExportedTask task;   // whose state are the arguments of the control function
  std::string origin;  // where the policy is from
  double limit = 0;    // N m
  double period = 0;   // s
  std::string plant;   // what it takes from `made_for`; empty: nothing
  Plant made_for;
  std::string work;  // of a call
  /// Name, value with comment.
  std::vector<std::pair<std::string, std::string>> macros;
  std::vector<CArray> constants;  // of which there is a checksum
  std::string layers;             // the definition of the table of layers, if there is one
  std::vector<CArray> samples;    // for the self test
};

/// States, one control period after the other, and what a policy makes of them: by these a C header
/// tests itself. S state variables, O outputs of the network.
struct CSamples {
  int count = 0;
  std::vector<float> states, outputs, torques;       // (count × S), (count × O), (count)
  float output_tolerance = 0, torque_tolerance = 0;  // for other roundings
};

/// The same for every call. `layers` are those of the network that the header has.
CSamples DrawSamples(const ExportedPolicy& policy, const std::vector<LayerView>& layers);

/// The C header of a controller: lqr, energy, pfl or tvlqr; see CHeaderOf, which checks the prefix.
/// Throws BadInput for others.
CHeader ControllerHeaderOf(const LoadedPolicy& loaded, const std::string& prefix);

/// Writes `text`, and counts the constants; `header` has the sizes in RAM and the prefix.
void WriteHeader(const CParts& parts, CHeader& header);

}  // namespace upswing
