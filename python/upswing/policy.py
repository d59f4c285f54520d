"""Policies from trainings, policy files and controllers."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from . import _upswing
from ._settings import PathLike, path_of, text_of, texts_of, whole_number


class Policy:
    """A policy or controller: maps observations to torques. Immutable and thread-safe.

    Letters: N observations, D numbers in each (`obs_size`), A numbers in an action (1), Q values.

    Attributes:
        name: file or name of the policy
        kind: kind of the policy, such as "q-network" or "lqr"
        description: description in words
        task: task of the policy, such as "double-pendulum"
        obs_size: D, for the double pendulum 8, plus 13 if it `identifies`, 2 for `any_pose` and 3 per step of `memory`
        action_size: A
        memory: number of past control steps in the observations
        identifies: whether the observations contain an estimate of the plant
        any_pose: whether the observations contain the pose to reach
        num_parameters: number of learned parameters; 0 for a controller
        info: metadata of the file: origin and plant; None where the file has none
    """

    def __init__(self, handle: _upswing.PolicyHandle, made_by: tuple[Any, ...] = ()) -> None:
        """For internal use: `load_policy` and `train` create policies."""
        self._handle = handle
        self._made_by = made_by  # for a controller: its name and settings
        self.name: str = handle.name
        self.kind: str = handle.kind
        self.description: str = handle.description
        self.task: str = handle.task
        self.obs_size: int = handle.obs_size
        self.action_size: int = handle.action_size
        self.memory: int = handle.memory
        self.identifies: bool = handle.identifies
        self.any_pose: bool = handle.any_pose
        self.num_parameters: int = handle.num_parameters
        self.info: dict[str, Any] = handle.info()

    def act(self, obs: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Computes actions for observations, without exploration.

        Args:
            obs: observations (N, D), or one observation (D,), as the environments return them

        Returns:
            Actions [N·m, or the task's unit], (N, A), or (A,) for one observation
        """
        rows, one = self._rows(obs)
        action = np.empty((len(rows), self.action_size))
        self._handle.act(rows, action)
        return action[0] if one else action

    __call__ = act

    @property
    def value_actions(self) -> npt.NDArray[np.float64]:
        """Torques (Q,) [N·m] of the columns of `values`; empty for V and for policies without values."""
        return np.array(self._handle.value_actions())

    def values(self, obs: npt.ArrayLike) -> npt.NDArray[np.float32]:
        """Estimates the values of observations: a Q-value per torque, or V.

        A value estimates the sum of gamma^k · reward_scale · reward, with `gamma` and
        `reward_scale` of `info`.

        Args:
            obs: observations (N, D), or one observation (D,)

        Returns:
            Values (N, Q), or (Q,) for one observation; Q is 0 for policies without values
        """
        rows, one = self._rows(obs)
        values = np.empty((len(rows), self._handle.num_values), np.float32)
        self._handle.values(rows, values)
        return values[0] if one else values

    def spread(
        self, obs: npt.ArrayLike
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]] | None:
        """Computes the central 68% interval of the learned distribution of torques.

        Args:
            obs: observations (N, D), or one observation (D,)

        Returns:
            Lower and upper ends [N·m], (N, A) each, or (A,) for one observation; None for policies
            without a distribution
        """
        if not self._handle.has_spread:
            return None
        rows, one = self._rows(obs)
        low, high = np.empty((2, len(rows), self.action_size))
        self._handle.spread(rows, low, high)
        return (low[0], high[0]) if one else (low, high)

    def save(self, path: PathLike) -> None:
        """Writes the policy to a file, in the program's format."""
        self._handle.save(path_of("path", path))

    def __reduce__(self) -> tuple[Any, ...]:
        if self._made_by:
            # The files that it was made from may have changed.
            info = self._handle.info()
            return _redesigned, (*self._made_by, self.name, info["plant"], info["control_period"],
                                 self._handle.swing_up_bytes())
        return _of_bytes, (self._handle.to_bytes(), self.name)

    def _rows(self, obs: npt.ArrayLike) -> tuple[npt.NDArray[np.float32], bool]:
        """Observations (N, D), and whether `obs` was a single one."""
        rows = np.ascontiguousarray(obs, np.float32)
        if np.ndim(obs) not in (1, 2):
            raise _upswing.InputError(
                f"obs: expected shape (N, {self.obs_size}) or ({self.obs_size},), "
                f"got {np.shape(obs)}")
        one = np.ndim(obs) == 1
        return (rows.reshape(1, -1) if one else rows), one

    def __repr__(self) -> str:
        return f"<upswing.Policy {self.name}: {self.description}>"


PolicyLike = Union[Policy, PathLike, Callable[[npt.NDArray[np.float32]], Any]]


def load_policy(
    path: PathLike,
    *,
    made_for: Mapping[str, float] | PathLike | None = None,
    **settings: Any,
) -> Policy:
    """Loads a policy.

    Args:
        path: policy file, run folder (for its best policy), shipped policy, such as "sac", or
            controller, such as "lqr"
        made_for: changes of a controller's design plant, such as {"mass2": 1.2}; or a plant file or
            shipped plant, such as "realaigym"
        **settings: settings of a controller, such as lqr_torque

    Raises:
        InputError: the policy does not exist, or its file is broken or of another kind
    """
    return _load(path_of("path", path), texts_of(settings), changes_of(made_for))


def changes_of(made_for: Mapping[str, float] | PathLike | None) -> list[str]:
    """Changes of a controller's design plant as texts, or its plant file."""
    if isinstance(made_for, (str, bytes, os.PathLike)):
        return [path_of("made_for", made_for)]
    return [f"{name}={text_of(value)}" for name, value in (made_for or {}).items()]


def _load(name: str, settings: list[tuple[str, str]], made_for: list[str]) -> Policy:
    handle = _upswing.load_policy(name, settings, made_for)
    return Policy(handle, () if handle.num_parameters > 0 else (name, settings))


def _redesigned(controller: str, settings: list[tuple[str, str]], title: str,
                plant: dict[str, float], control_period: float, swing_up: bytes | None) -> Policy:
    return Policy(_upswing.redesign(controller, settings, title, plant, control_period, swing_up),
                  (controller, settings))


def _of_bytes(file: bytes, name: str) -> Policy:
    return Policy(_upswing.policy_of_bytes(file, name))


def handle_of(policy: PolicyLike, memory: int = 0) -> _upswing.PolicyHandle:
    """The C++ object of a policy, a path, a controller's name or a function."""
    memory = whole_number("memory", memory)
    if isinstance(policy, (str, bytes, os.PathLike)):
        policy = load_policy(policy)
    if isinstance(policy, Policy):
        if memory != 0:
            raise _upswing.InputError(
                f"memory: expected none with a policy, which has its own memory of "
                f"{policy.memory} steps, got {memory}")
        return policy._handle  # pylint: disable=protected-access
    if callable(policy):
        return _upswing.function_policy(policy, memory)
    raise _upswing.InputError(
        f"policy: expected a Policy, a path, a controller's name or a function of observations, "
        f"got {type(policy).__name__}")
