#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "agents/config.h"
#include "base/rng.h"
#include "rl/agent.h"

namespace upswing {
namespace {

/// An agent that sees random observations and rewards, so that only learning costs time.
class Learner {
 public:
  explicit Learner(const std::string& name)
      : config_(ParseConfig("", "", {{"agent", name}})),
        spec_(config_.Spec()),
        agent_(config_.MakeAgent(spec_, pool_)),
        result_(spec_),
        obs_(result_.next_obs.size()),
        action_(result_.torque.size()) {}

  /// Acts until updates are due. Returns the processor time of one of them, s.
  double Learn() {
    const int64_t before = agent_->updates();
    std::clock_t time = 0;
    while (agent_->updates() == before) {
      agent_->Act({obs_.data(), spec_.num_envs, spec_.obs_size},
                  {action_.data(), spec_.num_envs, spec_.action_size()});
      Draw();
      agent_->Observe(result_);
      const std::clock_t begin = std::clock();
      agent_->Learn();
      time = std::clock() - begin;
    }
    return static_cast<double>(time) / CLOCKS_PER_SEC /
           static_cast<double>(agent_->updates() - before);
  }

 private:
  /// Draws the result of a step. An episode lasts 200 steps.
  void Draw() {
    for (float& x : result_.next_obs) x = static_cast<float>(rng_.Uniform(-1, 1));
    for (double& reward : result_.reward) reward = rng_.Uniform();
    std::ranges::fill(result_.truncated, ++steps_ % 200 == 0 ? 1 : 0);
    result_.torque = action_;
    obs_ = result_.next_obs;
  }

  ThreadPool pool_{1};
  Rng rng_{1, "benchmark"};
  Config config_;
  EnvSpec spec_;
  std::unique_ptr<Agent> agent_;
  StepResult result_;
  std::vector<float> obs_;      // (N × D)
  std::vector<double> action_;  // (N × A)
  int64_t steps_ = 0;
};

/// Processor time of an update with one minibatch, on one thread.
void BM_Update(benchmark::State& state, const char* agent) {
  Learner learner(agent);
  learner.Learn();  // after the warm-up steps
  for (auto _ : state) state.SetIterationTime(learner.Learn());
}
BENCHMARK_CAPTURE(BM_Update, d3qn, "d3qn")->UseManualTime();
BENCHMARK_CAPTURE(BM_Update, fast, "fast")->UseManualTime();
BENCHMARK_CAPTURE(BM_Update, sac, "sac")->UseManualTime();
BENCHMARK_CAPTURE(BM_Update, ppo, "ppo")->UseManualTime();

}  // namespace
}  // namespace upswing
