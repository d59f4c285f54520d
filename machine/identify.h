#pragma once

#include <span>
#include <string>
#include <vector>

#include "machine/fit.h"
#include "machine/validate.h"

/// Identification with a choice of the model's structure on runs that were left out.
namespace upswing {

/// A structure: which values of the twin are identified. The others keep those of the first guess.
struct Structure {
  std::string name;
  std::vector<std::string> values;
};

/// The structures to choose from, each with the values of the one before it and more.
/// `has_motors`: whether the logs have torques. Without, a motion tells only ratios of masses, and
/// the centre of link 2 stays as it is.
std::vector<Structure> Structures(bool has_motors);

/// A structure's errors on runs that were left out.
struct StructureError {
  Structure structure;
  double error;  // median over all windows of 1 s, rad
};

struct IdentifyConfig {
  FitConfig fit;
  // Cross-validation: the runs of each session are dealt to so many folds. A run is predicted by
  // the twin of the other folds. 0: none, with the last structure.
  int folds = 5;
};

struct Identification {
  FitResult fit;                           // from all logs, with the chosen structure
  std::vector<StructureError> structures;  // empty without cross-validation
  int chosen = 0;                          // index of the structure
  std::vector<Twin> left_out;              // (number of logs) the twin of the other folds
};

/// Identifies a twin from logs. Throws BadInput if they have no usable motion.
Identification Identify(std::span<const MachineLog> logs, const Twin& first,
                        const IdentifyConfig& config, ThreadPool* pool,
                        const Progress& progress = nullptr);

/// Sets the twin's loop timing and quanta to those of the logs.
void MeasureLoop(std::span<const MachineLog> logs, Twin& twin);

}  // namespace upswing
