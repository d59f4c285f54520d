#pragma once

#include <string>
#include <vector>

#include "lab/exported_policy.h"

/// What a policy's C header says and does of its task.
namespace upswing {

/// An array of constants of a C header.
struct CArray {
  std::string name, comment;
  std::vector<float> values;
};

struct CTask {
  std::string goal;               // what a policy does, for its first line
  std::vector<NamedInput> state;  // angles and velocities, with what they are
  std::string motor;              // where the torque acts
  std::vector<CArray> arrays;     // what the observation is computed with
  std::string observe;            // the statements that fill `observation`, NAME_ and CAPS_ as in
                                  // lab/c_code.h
  int sines = 0;                  // how many sines and cosines that takes
};

/// Throws BadInput if the task's observations are not known.
CTask CTaskOf(const LoadedPolicy& loaded);

}  // namespace upswing
