#pragma once

#include <cstdint>
#include <string>

#include "base/options.h"
#include "base/text.h"
#include "pendulum/goal.h"
#include "pendulum/physics.h"

/// Arguments shared by several commands and by the Python functions of the same names. Each has its
/// range and help in one place.
namespace upswing {

/// Argument "seed" of `what`.
inline void DescribeSeed(Options& o, int64_t* seed, const std::string& what) {
  o.Add(seed, "seed", {0, 9e15}, "", Concat("seed of ", what));
}

/// Argument "threads", for ResolveThreads.
inline void DescribeThreads(Options& o, int64_t* threads) {
  o.Add(threads, "threads", {0, 256}, "", "number of threads; 0: one per processor, at most 8");
}

/// Argument "control_period": time between two decisions; 0 is the default.
inline void DescribeControlPeriod(Options& o, double* period) {
  o.Add(period, "control_period", {kShortestPeriod, kLongestPeriod}, "s",
        "time between two decisions of a controller or two torques of a file; a policy has its own")
      .usual = "the policy's; of a controller 0.02 for the size of the built-in plant";
}

/// Argument "goal": the name of a pose.
inline void DescribeGoal(Options& o, std::string* goal) {
  o.AddChoice(goal, "goal", PoseNames(),
              "pose that a policy for any pose is to reach, link 1 first; `eval` then starts "
              "hanging")
      .usual = "up-up; each episode of `eval` draws its own";
}

/// Argument "physics", one of EngineNames().
inline void DescribePhysics(Options& o, std::string* physics) {
  o.AddChoice(physics, "physics", EngineNames(),
              "physics engine; closed-form is faster than mujoco, with the same physics");
}

/// Argument "episodes": number of episodes of an evaluation.
inline void DescribeEvalEpisodes(Options& o, int64_t* episodes) {
  o.Add(episodes, "episodes", {1, 1000000}, "", "number of episodes");
}

}  // namespace upswing
