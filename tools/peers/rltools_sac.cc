// RLtools' SAC on Pendulum-v1, with its defaults except for the settings below.

#include "rltools_training.h"

namespace core = rlt::rl::algorithms::sac::loop::core;

struct Parameters : core::DefaultParameters<Numbers, Index, Pendulum> {
  struct SAC_PARAMETERS
      : rlt::rl::algorithms::sac::DefaultParameters<Numbers, Index, Pendulum::ACTION_DIM> {
    static constexpr Index ACTOR_BATCH_SIZE = PEER_BATCH;
    static constexpr Index CRITIC_BATCH_SIZE = PEER_BATCH;
    static constexpr float GAMMA = PEER_SAC_GAMMA;
    static constexpr float ACTOR_POLYAK = 1.0 - PEER_TAU;
    static constexpr float CRITIC_POLYAK = 1.0 - PEER_TAU;
    static constexpr float ALPHA = PEER_ALPHA;
  };
  // RLtools needs one minibatch in its replay memory before it learns.
  static constexpr Index N_WARMUP_STEPS =
      PEER_LEARNING_STARTS > PEER_BATCH ? PEER_LEARNING_STARTS : PEER_BATCH;
  static constexpr Index N_WARMUP_STEPS_CRITIC = N_WARMUP_STEPS;
  static constexpr Index N_WARMUP_STEPS_ACTOR = N_WARMUP_STEPS;
  static constexpr Index STEP_LIMIT = kNoLimit;
  static constexpr Index REPLAY_BUFFER_CAP = PEER_REPLAY;
  static constexpr Index ACTOR_HIDDEN_DIM = PEER_WIDTH;  // width of two hidden layers with ReLU
  static constexpr Index CRITIC_HIDDEN_DIM = PEER_WIDTH;
  using ACTOR_OPTIMIZER_PARAMETERS = AdamParameters;
  using CRITIC_OPTIMIZER_PARAMETERS = AdamParameters;
  using ALPHA_OPTIMIZER_PARAMETERS = AdamParameters;
};

using Config = core::Config<Numbers, Index, Random, Pendulum, Parameters>;

int main(int, char** arguments) { return Train<Config::State<Config>>(arguments, 1); }
