#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/env.h"
#include "core/options.h"
#include "core/thread_pool.h"
#include "rl/agent.h"

namespace upswing {

/// What the memory that an agent takes follows from.
struct AgentSize {
  double parameters;    // of the networks that learn
  double arrays;        // numbers in memory for each parameter, such as Adam's moments
  double saved_arrays;  // the same in a checkpoint
  double transition;    // numbers of a transition in the replay memory or rollout
  double capacity;      // transitions that it holds
  double batch;         // rows of a minibatch
  double widest;        // units of the widest layer
  double layers;        // layers whose activations and gradients are kept
  const char* store = "replay memory";
  const char* store_flag = "--replay";  // which makes it smaller
};

/// The settings of a learning algorithm, and all that the program asks of the algorithm.
struct AgentConfig {
  virtual ~AgentConfig() = default;

  /// One line per setting: name, range, unit, help.
  virtual void Describe(Options& options) = 0;

  /// A new agent for such environments, whose work the pool shares.
  virtual std::unique_ptr<Agent> Make(const EnvSpec& spec, uint64_t seed,
                                      ThreadPool& pool) const = 0;

  /// Throws BadInput, beginning with a setting's name, if settings, each of which is allowed,
  /// contradict each other.
  virtual void Check(int64_t num_envs) const = 0;

  virtual AgentSize Size(const EnvSpec& spec) const = 0;

  /// Such as `double, dueling network 64-64 with heads of 32`.
  virtual std::string Text() const = 0;

  /// Settings that keep the agent from learning in so many steps, a line each.
  virtual std::vector<std::string> Warnings(int64_t steps, int64_t num_envs) const = 0;
  /// Whether values include an entropy bonus, so that they differ from discounted returns.
  virtual bool HasSoftValues() const { return false; }
};

/// Widths of layers as text, such as `64-64`.
std::string WidthsText(const std::vector<int64_t>& widths);

/// The largest of them.
double Widest(const std::vector<int64_t>& widths);

/// Adds a warning if the learning rate is 0 from its beginning to its end.
void WarnOfNoRate(double begin, double end, std::vector<std::string>& warnings);

}  // namespace upswing
