"""Policies: what `train` made, what its files hold, and controllers."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from . import _upswing
from ._settings import text_of, texts_of, whole_number


class Policy:
    """A controller: observations in, torques out. Immutable, and safe from several threads.

    Letters: N observations, D numbers in each (`obs_size`), A numbers in an action (1), Q values.

    Attributes:
        name: its file, or what it is called
        kind: such as "q-network" or "lqr"
        description: what it is, in words
        task: such as "double-pendulum"
        obs_size: D; of the double pendulum 8, and 3 for each step of `memory`
        action_size: A
        memory: past control steps that its observations remember
        identifies: whether they hold an estimate of the plant
        num_parameters: how many numbers were learned; 0: none
        info: what its file says of how it was made and for which plant; None where it says nothing
    """

    def __init__(self, handle: _upswing.PolicyHandle, made_by: tuple[Any, ...] = ()) -> None:
        """Policies come from `load_policy` and `train`."""
        self._handle = handle
        self._made_by = made_by  # of a controller: name, settings and plant
        self.name: str = handle.name
        self.kind: str = handle.kind
        self.description: str = handle.description
        self.task: str = handle.task
        self.obs_size: int = handle.obs_size
        self.action_size: int = handle.action_size
        self.memory: int = handle.memory
        self.identifies: bool = handle.identifies
        self.num_parameters: int = handle.num_parameters
        self.info: dict[str, Any] = handle.info()

    def act(self, obs: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """The actions for some observations, without exploration.

        Args:
            obs: (N, D), or (D,) for one; as the environments give them

        Returns:
            Actions, N·m (or the task's unit): (N, A), or (A,) for one observation
        """
        rows, one = self._rows(obs)
        action = np.empty((len(rows), self.action_size))
        self._handle.act(rows, action)
        return action[0] if one else action

    __call__ = act

    @property
    def value_actions(self) -> npt.NDArray[np.float64]:
        """The torques (Q,), N·m, that `values` are of; empty for V and for policies without."""
        return np.array(self._handle.value_actions())

    def values(self, obs: npt.ArrayLike) -> npt.NDArray[np.float32]:
        """What it estimates of observations: a Q-value for each of its torques, or V alone.

        Their unit is that of the learned targets: the sum of gamma^k · reward_scale · reward, with
        the `gamma` and `reward_scale` of `info`.

        Args:
            obs: (N, D), or (D,) for one

        Returns:
            (N, Q), or (Q,) for one observation; Q is 0 for policies that estimate none
        """
        rows, one = self._rows(obs)
        values = np.empty((len(rows), self._handle.num_values), np.float32)
        self._handle.values(rows, values)
        return values[0] if one else values

    def spread(
        self, obs: npt.ArrayLike
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]] | None:
        """The central 68% of the torques that it learned to draw.

        Args:
            obs: (N, D), or (D,) for one

        Returns:
            Lower and upper ends, N·m, (N, A) each, or (A,) for one observation; None for policies
            that were not learned as a distribution
        """
        if not self._handle.has_spread:
            return None
        rows, one = self._rows(obs)
        low, high = np.empty((2, len(rows), self.action_size))
        self._handle.spread(rows, low, high)
        return (low[0], high[0]) if one else (low, high)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes it to a file as the program does (docs/policy-format.md)."""
        self._handle.save(os.fspath(path))

    def __reduce__(self) -> tuple[Any, ...]:
        if self._made_by:
            return _load, self._made_by
        return _of_bytes, (self._handle.to_bytes(), self.name)

    def _rows(self, obs: npt.ArrayLike) -> tuple[npt.NDArray[np.float32], bool]:
        """Observations (N, D), and whether there was one alone."""
        rows = np.ascontiguousarray(obs, np.float32)
        if np.ndim(obs) not in (1, 2):
            raise _upswing.InputError(
                f"obs: expected shape (N, {self.obs_size}) or ({self.obs_size},), "
                f"got {np.shape(obs)}")
        one = np.ndim(obs) == 1
        return (rows.reshape(1, -1) if one else rows), one

    def __repr__(self) -> str:
        return f"<upswing.Policy {self.name}: {self.description}>"


PolicyLike = Union[Policy, str, "os.PathLike[str]", Callable[[npt.NDArray[np.float32]], Any]]


def load_policy(
    path: str | os.PathLike[str], *, made_for: Mapping[str, float] | None = None, **settings: Any
) -> Policy:
    """Loads a policy.

    Args:
        path: a policy file, a run folder (its best policy), or the name of a controller, "lqr"
        made_for: of a controller: the plant that it is made for, such as {"mass2": 1.2}
        **settings: of a controller: its settings, such as lqr_torque

    Raises:
        InputError: there is no such policy, or the file is broken or for something else
    """
    changes = [f"{name}={text_of(value)}" for name, value in (made_for or {}).items()]
    return _load(os.fspath(path), texts_of(settings), changes)


def _load(name: str, settings: list[tuple[str, str]], made_for: list[str]) -> Policy:
    handle = _upswing.load_policy(name, settings, made_for)
    return Policy(handle, () if handle.num_parameters > 0 else (name, settings, made_for))


def _of_bytes(file: bytes, name: str) -> Policy:
    return Policy(_upswing.policy_of_bytes(file, name))


def handle_of(policy: PolicyLike, memory: int = 0) -> _upswing.PolicyHandle:
    """What the C++ code takes for a policy, a path, a controller's name, or a function."""
    memory = whole_number("memory", memory)
    if isinstance(policy, (str, os.PathLike)):
        policy = load_policy(policy)
    if isinstance(policy, Policy):
        if memory != 0:
            raise _upswing.InputError(
                f"memory: expected it beside a function, got a policy whose memory is "
                f"{policy.memory} steps")
        return policy._handle  # pylint: disable=protected-access
    if callable(policy):
        return _upswing.function_policy(policy, memory)
    raise _upswing.InputError(
        f"policy: expected a Policy, a path, a controller's name or a function of observations, "
        f"got {type(policy).__name__}")
