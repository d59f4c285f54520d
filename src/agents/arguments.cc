#include "agents/arguments.h"

#include "base/text.h"
#include "pendulum/physics.h"

namespace upswing {

void DescribeSeed(Options& o, int64_t* seed, const std::string& what) {
  o.Add(seed, "seed", {0, 9e15}, "", Concat("seed of ", what));
}

void DescribeThreads(Options& o, int64_t* threads) {
  o.Add(threads, "threads", {0, 256}, "", "number of threads; 0: one per processor, at most 8");
}

void DescribePhysics(Options& o, std::string* physics) {
  Option& option =
      o.AddChoice(physics, "physics", EngineNames(),
                  "physics engine; closed-form is faster than mujoco, with the same physics");
  if (physics->empty()) option.usual = "closed-form; mujoco for a policy with its own model";
}

void DescribeEvalEpisodes(Options& o, int64_t* episodes) {
  o.Add(episodes, "episodes", {1, 1000000}, "", "number of episodes");
}

}  // namespace upswing
