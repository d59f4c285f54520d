#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "export/exported_policy.h"

/// What a policy's C header says and does of its task.
namespace upswing {

/// An array of constants of a C header.
struct CArray {
  std::string name, comment;
  std::vector<float> values;
};

/// Its definition.
std::string ArrayText(const CArray& array);

/// What a header's NAME_checksum_of_all computes of these arrays, and the lines of it that do so.
struct CChecksum {
  uint32_t sum = 0;
  std::string lines;
};
CChecksum ChecksumOf(const std::vector<CArray>& arrays);

/// The plant's numbers in words, after `what`.
std::string PlantParagraph(const Plant& plant, const std::string& what);

struct CTask {
  std::string goal;               // what a policy does, for its first line
  std::vector<NamedInput> state;  // angles and velocities, with what they are
  std::string motor;              // where the torque acts
  std::vector<CArray> arrays;     // what the observation is computed with
  std::string observe;            // the statements that fill `observation`, NAME_ and CAPS_ as in
                                  // export/c_code.h
  int sines = 0;                  // how many sines and cosines that takes
};

/// Throws BadInput if the task's observations are not known.
CTask CTaskOf(const LoadedPolicy& loaded);

}  // namespace upswing
