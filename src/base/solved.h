#pragma once

#include <cstdint>

/// Rules for when a training has solved its task and when it ends. These are their only
/// definitions.
namespace upswing {

/// Counts an evaluation into a streak of passed evaluations. Returns whether it makes the task
/// solved: it is the second passed evaluation in a row.
inline bool CountsAsSolved(bool passed, int64_t& streak) {
  streak = passed ? streak + 1 : 0;
  return streak == 2;
}

/// Whether a training ends at `step`: its step budget is used up, or the task is solved and
/// `stop_when_solved` is set.
inline bool IsFinished(int64_t step, int64_t budget, bool solved, bool stop_when_solved) {
  return step >= budget || (solved && stop_when_solved);
}

}  // namespace upswing
