"""Upswing's vector environment for Stable-Baselines3, without a loop over environments."""

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

import upswing  # registers the environments  # noqa: F401  # pylint: disable=unused-import


class UpswingVecEnv(VecEnv):
    """N double pendulums for Stable-Baselines3, which expects Gymnasium's SAME_STEP: the
    observation after an episode's last step is the next episode's start.

    Args:
        num_envs: N
        reward_scale: factor of the rewards that the agent sees
        **settings: of upswing/DoublePendulum-v0
    """

    def __init__(self, num_envs, reward_scale=1.0, **settings):
        self.envs = gym.make_vec("upswing/DoublePendulum-v0", num_envs=num_envs,
                                 autoreset_mode=AutoresetMode.SAME_STEP, **settings)
        self.reward_scale = reward_scale
        self._actions = None
        self.returns = np.zeros(num_envs)
        self.lengths = np.zeros(num_envs, int)
        super().__init__(num_envs, self.envs.single_observation_space,
                         self.envs.single_action_space)

    def reset(self):
        # Stable-Baselines3 gives each environment its own seed, or None.
        seeds = list(self._seeds)
        obs, _ = self.envs.reset(seed=None if all(seed is None for seed in seeds) else seeds)
        self._reset_seeds()
        self.returns[:] = self.lengths[:] = 0
        return obs

    def step_async(self, actions):
        self._actions = actions

    def step_wait(self):
        obs, rewards, terminated, truncated, infos = self.envs.step(self._actions)
        dones = terminated | truncated
        self.returns += rewards
        self.lengths += 1
        each = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(dones):
            each[i] = {"terminal_observation": infos["final_obs"][i],
                       "TimeLimit.truncated": bool(truncated[i]),
                       "episode": {"r": self.returns[i], "l": self.lengths[i]}}
        self.returns[dones] = self.lengths[dones] = 0
        return obs, (self.reward_scale * rewards).astype(np.float32), dones, each

    def close(self):
        self.envs.close()

    def get_attr(self, attr_name, indices=None):
        return [getattr(self.envs, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name, value, indices=None):
        setattr(self.envs, attr_name, value)

    def env_method(self, method_name, *args, indices=None, **kwargs):
        method = getattr(self.envs, method_name)
        return [method(*args, **kwargs)] * len(list(self._get_indices(indices)))

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False] * len(list(self._get_indices(indices)))
