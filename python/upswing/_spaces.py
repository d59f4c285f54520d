"""Spaces of Gymnasium environments that `train` accepts."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from . import _upswing

MOST_CHOICES = 1001  # discrete actions


class Spaces:
    """Checked spaces of an environment. Raises InputError for others."""

    def __init__(self, obs: spaces.Space[Any], action: spaces.Space[Any]) -> None:
        if not isinstance(obs, spaces.Box) or len(obs.shape) != 1 or obs.shape[0] == 0:
            raise _upswing.InputError(
                f"env: expected a Box observation space of one dimension, got {brief(obs)}; "
                "gymnasium.wrappers.FlattenObservation makes one of others")
        self.obs_shape = obs.shape
        self.action = action
        self.choices: list[float] = []
        if isinstance(action, spaces.Discrete):
            n = int(action.n)
            if not 2 <= n <= MOST_CHOICES:
                raise _upswing.InputError(
                    f"env: expected 2 to {MOST_CHOICES} discrete actions, got {n}")
            self.choices = [float(action.start) + i for i in range(n)]
            self.limits = [max(1.0, *map(abs, self.choices))]
        elif isinstance(action, spaces.Box):
            if action.dtype is None or action.dtype.kind != "f" or action.low.size == 0:
                raise _upswing.InputError(
                    f"env: expected actions of floating-point numbers, got {brief(action)}")
            if not (np.isfinite(action.low).all() and np.isfinite(action.high).all()):
                raise _upswing.InputError(
                    f"env: expected finite bounds of the actions, got {brief(action)}; give "
                    "the environment an action_space with finite bounds")
            if not (action.low < action.high).all():
                raise _upswing.InputError(
                    f"env: expected lower bounds of the actions below the upper ones, got "
                    f"{brief(action)}")
            self.limits = [float(high) for high in action.high.ravel()]
        else:
            raise _upswing.InputError(
                f"env: expected a Box or Discrete action space, got {brief(action)}")

    def action_of(self, row: npt.NDArray[np.float64]) -> Any:
        """The environment's action for a row (A) of the C++ code."""
        if self.choices:
            return int(row[0])
        return row.astype(self.action.dtype).reshape(self.action.shape)

    def any_action(self) -> Any:
        """An action for a trial."""
        if self.choices:
            return int(self.choices[0])
        return np.zeros(self.action.shape or (), self.action.dtype)

    def check(self, obs: Any, where: str) -> None:
        """Raises InputError unless an observation has the space's shape and finite numbers."""
        array = np.asarray(obs)
        if array.shape != self.obs_shape or array.dtype.kind not in "fiub":
            raise _upswing.InputError(
                f"{where}: expected observations of shape {self.obs_shape}, as the environment's "
                f"observation_space, got {array.dtype} of shape {array.shape}")
        if not np.isfinite(array).all():
            raise _upswing.InputError(
                f"{where}: expected finite observations, got {array[~np.isfinite(array)][0]}")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Spaces) and (
            self.obs_shape == other.obs_shape and self.action == other.action)

    def __str__(self) -> str:
        return f"observations of shape {self.obs_shape} and actions {brief(self.action)}"


def brief(space: Any) -> str:
    """A space as one short line."""
    text = " ".join(str(space).split())
    return text if len(text) <= 120 else text[:117] + "..."


def one_line(error: BaseException) -> str:
    """Kind and message of an exception, as one line."""
    text = " ".join(str(error).split())
    text = text if len(text) <= 300 else text[:297] + "..."
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
