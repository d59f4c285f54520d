"""Largest length of the episodes of Gymnasium environments."""

from __future__ import annotations

import warnings
from typing import Any

import gymnasium as gym
from gymnasium.vector import VectorEnv

from . import _upswing
from ._settings import whole_number


def _wrapped_limit(env: Any) -> int | None:
    """The limit of the outermost TimeLimit around an environment; None without one."""
    while isinstance(env, gym.Wrapper):
        if isinstance(env, gym.wrappers.TimeLimit):
            return env._max_episode_steps  # pylint: disable=protected-access
        env = env.env
    return None


class Limit:
    """Largest length of an episode [steps]: of the environment and of the caller, else 10,000."""

    def __init__(self, env: Any, single: gym.Env[Any, Any], asked: int | None) -> None:
        """`single` is an environment like `env`, which may be a vector environment. Raises
        InputError."""
        own = env.spec.max_episode_steps if env.spec is not None else None
        if own is None and isinstance(env, VectorEnv) and single.spec is not None:
            own = single.spec.max_episode_steps
        if own is None:
            own = _wrapped_limit(single)
        limits = [limit for limit in (own, asked) if limit is not None]
        self.steps = min((whole_number("max_episode_steps", limit) for limit in limits),
                         default=10_000)
        self._assumed = not limits
        if self.steps < 1:
            raise _upswing.InputError(f"max_episode_steps: expected 1 or more, got {self.steps}")

    def note_reached(self) -> None:
        """Notes that the limit ends an episode. Warns once if it is the default."""
        if self._assumed:
            self._assumed = False
            warnings.warn(
                f"env: an episode did not end within {self.steps:,} steps, the default of "
                "max_episode_steps for an environment without a time limit; set max_episode_steps",
                stacklevel=4)  # the caller of train or evaluate
