#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/env.h"
#include "base/options.h"

namespace upswing {

/// Sizes that determine the memory use of an agent.
struct AgentSize {
  double parameters;    // parameters of the networks that learn
  double arrays;        // numbers in memory per parameter, such as Adam's moments
  double saved_arrays;  // numbers in a checkpoint per parameter
  double transition;    // numbers per transition in the replay memory or rollout
  double capacity;      // transitions in the replay memory or rollout
  double batch;         // rows of a minibatch
  double widest;        // units of the widest layer
  double layers;        // layers whose activations and gradients are kept
  const char* store = "replay memory";
  const char* store_flag = "--replay";  // flag that makes the store smaller
};

/// Settings of a learning algorithm, and everything that the program needs to know about it before
/// it makes the agent.
struct AgentConfig {
  virtual ~AgentConfig() = default;

  /// One line per setting: name, range, unit, help.
  virtual void Describe(Options& options) = 0;

  /// Throws BadInput if settings contradict each other although each is in its range. The message
  /// begins with a setting's name.
  virtual void Check(int64_t num_envs) const = 0;

  /// Adapts the settings to an environment with this number of discrete actions; 0: its actions are
  /// continuous. Returns false if the algorithm has no such agents.
  virtual bool FitToActions(int64_t choices) = 0;
  /// Whether an agent can start from the weights of a policy.
  virtual bool StartsFromPolicy() const { return true; }

  virtual AgentSize Size(const EnvSpec& spec) const = 0;

  /// The algorithm in words, such as `double, dueling network 64-64 with heads of 32`.
  virtual std::string Text() const = 0;

  /// Warnings, one per line, about settings that keep the agent from learning within `steps`.
  virtual std::vector<std::string> Warnings(int64_t steps, int64_t num_envs) const = 0;
  /// Whether values include an entropy bonus and so differ from discounted returns.
  virtual bool HasSoftValues() const { return false; }
};

/// Adds a warning if both ends of the learning-rate schedule are 0.
void WarnOfNoRate(double begin, double end, std::vector<std::string>& warnings);

}  // namespace upswing
