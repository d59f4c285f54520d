#include "web/wasm/learner.h"

#include "agents/config_checks.h"
#include "base/error.h"
#include "base/safetensors.h"
#include "base/text.h"

namespace upswing {
namespace {

using nlohmann::json;

constexpr size_t kPage = 65536;              // bytes of a page of WebAssembly's memory
constexpr size_t kMemoryLimit = 512u << 20;  // bytes, the same as in build.py

Config InClosedForm(std::vector<FlagValue> flags) {
  // A page has no MuJoCo for training and evaluation.
  flags.push_back({"physics", kClosedForm.name});
  flags.push_back({"eval_physics", kClosedForm.name});
  const Config config = ConfigOf(flags);
  if (config.start_policy.empty()) return config;
  throw BadInput(Concat("start_policy: expected none in the page, got ", config.start_policy));
}

Host ThisPage() {
  return {nullptr, static_cast<int64_t>(kMemoryLimit - kPage * __builtin_wasm_memory_size(0))};
}

std::vector<std::byte> FileOf(const Policy& policy) {
  const Tensors tensors = policy.ToTensors();
  return WriteSafetensors(tensors).Joined();
}

}  // namespace

Config ConfigOf(const std::vector<FlagValue>& flags) { return ParseConfig("", "", flags); }

Learner::Learner(const std::vector<FlagValue>& flags) : training_(InClosedForm(flags), ThisPage()) {
  training_.AddObserver(*this);
  warnings_ = Warnings(training_.config());
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
              {"terms", training_.env().spec().term_names},
              {"warnings", warnings_},
              {"episodes", std::move(episodes_)},
              {"evaluations", std::move(evaluations_)}};
  episodes_ = evaluations_ = json::array();
  return report;
}

json Learner::LastUpdate() const {
  const std::optional<UpdateExample> example = training_.agent().LastUpdate();
  if (!example) return nullptr;
  return {{"torque", example->torque},         {"guess", example->guess},
          {"corrected", example->corrected},   {"reward", example->reward},
          {"target", example->target},         {"epsilon", example->epsilon},
          {"remembered", example->remembered}, {"capacity", example->capacity}};
}

std::vector<std::byte> Learner::policy() const { return FileOf(*training_.policy()); }

std::vector<std::byte> Learner::Poses() const {
  const auto& env = dynamic_cast<const PendulumEnv&>(training_.env());
  std::vector<float> poses;
  for (int i = 0; i < env.num_envs(); ++i) {
    const PendulumState state = env.state(i);
    poses.push_back(static_cast<float>(state.q1));
    poses.push_back(static_cast<float>(state.q2));
  }
  const auto bytes = std::as_bytes(std::span(poses));
  return {bytes.begin(), bytes.end()};
}

void Learner::OnEpisode(const TrainState& state, const FinishedEpisode& episode) {
  episodes_.push_back({{"step", state.steps},
                       {"length", episode.length},
                       {"return", episode.reward_sum},
                       {"terms", episode.terms}});
}

void Learner::OnEvaluation(const TrainState& state, const Evaluation& evaluation) {
  evaluations_.push_back({{"step", state.steps},
                          {"success", evaluation.success_rate()},
                          {"return", evaluation.reward_sum.mean},
                          {"expected", evaluation.value},
                          {"attained", evaluation.discounted_return}});
}

void Learner::OnBest(const TrainState& /*state*/, const Policy& policy) { best_ = FileOf(policy); }

}  // namespace upswing
