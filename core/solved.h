#pragma once

#include <cstdint>

/// When a training has solved its task, and when it ends: the one place for what these words mean.
namespace upswing {

/// Counts an evaluation into a streak of passed ones. Returns whether the task is now solved: after
/// two in a row.
inline bool CountsAsSolved(bool passed, int64_t& streak) {
  streak = passed ? streak + 1 : 0;
  return streak == 2;
}

/// Whether a training ends at `step`: its budget of steps is used up, or it is solved and stops
/// then.
inline bool IsFinished(int64_t step, int64_t budget, bool solved, bool stop_when_solved) {
  return step >= budget || (solved && stop_when_solved);
}

}  // namespace upswing
