#include "web/wasm/learner.h"

#include "core/safetensors.h"

namespace upswing {
namespace {

using nlohmann::json;

Config ConfigFrom(std::vector<FlagValue> flags) {
  // MuJoCo is not here to learn in, nor to judge.
  flags.push_back({"physics", kClosedForm.name});
  flags.push_back({"eval_physics", kClosedForm.name});
  return ParseConfig("", {}, flags);
}

std::vector<std::byte> FileOf(const Policy& policy) {
  const Tensors tensors = policy.ToTensors();
  return WriteSafetensors(tensors).Joined();
}

}  // namespace

Learner::Learner(const std::vector<FlagValue>& flags) : training_(ConfigFrom(flags), 1, {this}) {
  Report();  // begins the lists
}

bool Learner::Run(int most) {
  for (int i = 0; i < most; ++i) {
    if (!training_.Step()) return false;
  }
  return !training_.trainer().finished();
}

json Learner::Report() {
  const TrainState& s = training_.state();
  json report{{"steps", s.steps},
              {"updates", training_.agent().updates()},
              {"episodeCount", s.episodes},
              {"seconds", s.seconds},
              {"solved", s.solved},
              {"finished", training_.trainer().finished()},
              {"bestStep", s.best_step},
              {"bestSuccess", s.best_success_rate},
              {"episodes", std::move(episodes_)},
              {"evaluations", std::move(evaluations_)}};
  episodes_ = evaluations_ = json::array();
  return report;
}

std::vector<std::byte> Learner::policy() const { return FileOf(*training_.policy()); }

void Learner::OnEpisode(const TrainState& state, const FinishedEpisode& episode) {
  episodes_.push_back({{"step", state.steps}, {"return", episode.reward_sum}});
}

void Learner::OnEvaluation(const TrainState& state, const Evaluation& evaluation) {
  evaluations_.push_back({{"step", state.steps},
                          {"success", evaluation.success_rate()},
                          {"return", evaluation.reward_sum.mean}});
}

void Learner::OnBest(const TrainState& /*state*/, const Policy& policy) { best_ = FileOf(policy); }

}  // namespace upswing
