#pragma once

#include <span>
#include <vector>

#include "extras/machine/twin/fit.h"
#include "extras/machine/twin/judgement.h"
#include "extras/machine/twin/validate.h"

/// Identification with a choice of the model's structure on runs that were left out.
namespace upswing::machine {

/// The structures to choose from. Each adds values to the structure before it. `has_motors`:
/// whether the logs have torques. A motion without torques determines only ratios of masses; then
/// the centre of link 2 stays at the first guess. `cogging`: whether the motors cog. `one_body`:
/// all sessions have the same body.
std::vector<Structure> Structures(bool has_motors, bool cogging, bool one_body);

/// How a structure explains links that hang off the angles at which the encoders show 0.
enum class HangingBy { kZeros, kOffsets, kBoth };
/// A structure that has zeros of each session, with offsets of the motors' torques in place of them
/// or besides them. Other structures stay.
Structure Hanging(Structure structure, HangingBy cause);

/// A structure's errors on runs that were left out.
struct StructureError {
  Structure structure;
  double error;  // geometric mean over sessions of the median error of a window, rad
};

/// Settings of an identification with cross-validation.
struct IdentifyConfig {
  FitConfig fit;
  // Number of folds. Each run is predicted by the twin of the other folds. 0 or 1: no
  // cross-validation; the last structure is chosen.
  int folds = 5;
  bool one_body = false;  // all sessions share centres, inertias and armature
};

/// The result of an identification with cross-validation.
struct Identification {
  FitResult fit;                           // from all logs, with the chosen structure
  std::vector<StructureError> structures;  // empty without cross-validation
  int chosen = 0;                          // index of the structure
  double seconds = 1;                      // length of the windows that choose it
  // The twin of the other folds for each log; empty without cross-validation.
  std::vector<Twin> left_out;
  Twin of_fold;  // the twin of the first fold, with the chosen structure
  // On the left-out runs; without a cross-validation, on the middle third of each log, by a fit to
  // the rest; if that has no windows, on the logs of the fit.
  Judgement judgement;
};

/// Identifies a twin from logs and judges it. If inertia1 ends at its lower limit, fits again with
/// armature1 = 0, and returns the better fit. Zeros of the encoders compete with offsets of the
/// torques, if the logs have torques and there is a cross-validation. A twin that does not explain
/// its logs, or has values outside physics, says so (Twin::distrust). Throws BadInput if they have
/// no usable motion, or if there are too few for a cross-validation.
Identification Identify(std::span<const MachineLog> logs, const Twin& first,
                        const IdentifyConfig& config, ThreadPool* pool,
                        const Progress& progress = nullptr);

/// Why a twin of these logs is not to be trusted, in one line: its judgement, the values outside
/// physics, and a motion that contradicts the given length of link 1, `length1` (m). (Logs without
/// torques fit another length to a wrong clock.) Empty: nothing speaks against it.
std::string DistrustOf(const Judgement& judgement, const Twin& twin,
                       std::span<const MachineLog> logs, double length1);

/// Sets the twin's loop timing, and the steps of its angles and reported torques, to those of the
/// logs.
void MeasureLoop(std::span<const MachineLog> logs, Twin& twin);

}  // namespace upswing::machine
