// RLtools' PPO on Pendulum-v1, with its defaults except for the settings below.

#include "rltools_training.h"

namespace core = rlt::rl::algorithms::ppo::loop::core;

struct Parameters : core::DefaultParameters<Numbers, Index, Pendulum> {
  static constexpr Index N_ENVIRONMENTS = PEER_ENVS;
  static constexpr Index ON_POLICY_RUNNER_STEPS_PER_ENV = PEER_HORIZON;
  static constexpr Index DATASET_SIZE = N_ENVIRONMENTS * ON_POLICY_RUNNER_STEPS_PER_ENV;
  static constexpr Index EPISODE_STEP_LIMIT = Pendulum::EPISODE_STEP_LIMIT;
  static constexpr Index STEP_LIMIT = kNoLimit;
  static constexpr Index BATCH_SIZE = PEER_BATCH;
  static constexpr Index ACTOR_HIDDEN_DIM = PEER_WIDTH;  // width of two hidden layers with ReLU
  static constexpr Index CRITIC_HIDDEN_DIM = PEER_WIDTH;
  using OPTIMIZER_PARAMETERS = AdamParameters;
  struct PPO_PARAMETERS : rlt::rl::algorithms::ppo::DefaultParameters<Numbers, Index, BATCH_SIZE> {
    static constexpr float GAMMA = PEER_PPO_GAMMA;
    static constexpr float LAMBDA = PEER_LAMBDA;
    static constexpr float EPSILON_CLIP = PEER_CLIP;
    static constexpr float INITIAL_ACTION_STD = PEER_INITIAL_STD;
    static constexpr float ACTION_ENTROPY_COEFFICIENT = 0;
    static constexpr Index N_EPOCHS = PEER_EPOCHS;
  };
};

using Config = core::Config<Numbers, Index, Random, Pendulum, Parameters>;

int main(int, char** arguments) {
  return Train<Config::State<Config>>(arguments, Parameters::DATASET_SIZE);
}
