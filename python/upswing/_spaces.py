"""Spaces of Gymnasium environments that `train` accepts."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from . import _upswing

MOST_CHOICES = 1001  # discrete actions
MOST_ACTION = 1e6
_SCALARS = (float, np.float64, np.float32, int)  # usual types of a reward


class Spaces:
    """Checked spaces of an environment. Raises InputError for others."""

    def __init__(self, obs: spaces.Space[Any], action: spaces.Space[Any]) -> None:
        if not isinstance(obs, spaces.Box) or len(obs.shape) != 1 or obs.shape[0] == 0:
            raise _upswing.InputError(
                f"env: expected a Box observation space of one dimension, got {brief(obs)}; "
                "gymnasium.wrappers.FlattenObservation makes one of others")
        self.obs, self.obs_shape = obs, obs.shape
        self.action = action
        self.choices: list[float] = []
        if isinstance(action, spaces.Discrete):
            n = int(action.n)
            if not 2 <= n <= MOST_CHOICES:
                raise _upswing.InputError(
                    f"env: expected 2 to {MOST_CHOICES} discrete actions, got {n}")
            self.choices = [float(action.start) + i for i in range(n)]
            self._number: Any = (action.dtype or np.dtype(np.int64)).type
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
        if max(self.limits) > MOST_ACTION:
            raise _upswing.InputError(
                f"env: expected actions within ±{MOST_ACTION:g}, got {brief(action)}")

    def row_of(self, action: Any) -> npt.NDArray[Any]:
        """A policy's action as a row (A) of the C++ code. Raises InputError."""
        row = np.asarray(action).ravel()
        size = len(self.limits)
        if row.size != size or row.dtype.kind not in "fiub" or not np.isfinite(row).all():
            raise _upswing.InputError(
                f"policy: expected an action of {size} finite number{'s' if size > 1 else ''}, got "
                f"{brief(action)}")
        if self.choices and float(row[0]) not in self.choices:
            raise _upswing.InputError(
                f"policy: expected an action of {brief(self.action)}, got {row[0]}")
        return row

    def any_actions(self, n: int) -> npt.NDArray[np.float64]:
        """Actions (N, A) for a trial, as the C++ code gives them."""
        return np.full((n, len(self.limits)), self.choices[0] if self.choices else 0.0)

    def arrays(self, n: int) -> dict[str, npt.NDArray[Any]]:
        """Arrays of n environments, as the C++ code makes them, with actions for a trial."""
        shape: tuple[int, ...] = (n, *self.obs_shape)
        arrays: dict[str, npt.NDArray[Any]] = {"obs": np.zeros(shape), "next_obs": np.zeros(shape)}
        arrays |= {name: np.zeros(n) for name in ("reward", "terminated", "truncated")}
        return arrays | {"action": self.any_actions(n)}

    def batch_of(self, rows: npt.NDArray[np.float64]) -> Any:
        """A vector environment's actions for rows (N, A) of the C++ code."""
        if self.choices:
            return rows[:, 0].astype(self._number)
        return rows.astype(self.action.dtype).reshape(len(rows), *(self.action.shape or ()))

    def actions_of(self, rows: npt.NDArray[np.float64]) -> Any:
        """The actions of single environments for rows (N, A) of the C++ code."""
        actions = self.batch_of(rows)
        return actions if self.choices else [actions[i, ...] for i in range(len(rows))]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Spaces) and (
            self.obs_shape == other.obs_shape and self.action == other.action)

    def bounded_as(self, other: Spaces) -> bool:
        """Whether observations have the bounds of the other's."""
        return (np.array_equal(self.obs.low, other.obs.low)
                and np.array_equal(self.obs.high, other.obs.high))

    def __str__(self) -> str:
        return f"observations {brief(self.obs)} and actions {brief(self.action)}"


RESET, STEP = ("obs", "info"), ("obs", "reward", "terminated", "truncated", "info")


def unpacked(returned: Any, names: tuple[str, ...], where: str) -> Any:
    """What an environment's reset or step returned, if it has these parts. Raises InputError, whose
    message begins with `where`."""
    if isinstance(returned, (tuple, list)) and len(returned) == len(names):
        return returned
    got = type(returned).__name__
    if isinstance(returned, (tuple, list)):
        got += f" of {len(returned)}"
    hint = ""
    if names is STEP and got == "tuple of 4":
        hint = "; Gym before 0.26 had \"done\" in place of terminated and truncated"
    raise _upswing.InputError(f"{where}{'reset' if names is RESET else 'step'} to return "
                              f"({', '.join(names)}), got {got}{hint}")


def numbers(value: Any, shape: tuple[int, ...], what: str) -> Any:
    """An environment's numbers as an array of this shape. The shape () accepts any array of one
    number. Raises InputError, whose message begins with `what`."""
    if type(value) in _SCALARS and not shape:  # fast, as each step needs it
        return value
    wanted = f"{what} of shape {shape}" if shape else f"{what} of one number"
    try:
        array = np.asarray(value)
    except Exception as error:
        raise _upswing.InputError(f"{wanted}, got no array: {one_line(error)}") from error
    if shape == () and array.size == 1:
        array = array.reshape(())
    is_numeric = array.dtype.kind in "fiub"
    if array.shape != shape or not is_numeric:
        is_array = isinstance(value, np.ndarray)
        got = (f"{array.dtype} of shape {array.shape}" if is_array or is_numeric
               else type(value).__name__)
        raise _upswing.InputError(f"{wanted}, got {got}")
    return array


def check_finite(arrays: dict[str, npt.NDArray[Any]], call: str) -> None:
    """Raises InputError unless what "reset" or "step" returned is finite as float32."""
    for name, what in (("obs", "observations"), ("next_obs", "observations"), ("reward", "rewards")):
        values = arrays[name].ravel()
        wrong = values[~(np.abs(values) <= np.finfo(np.float32).max)]
        if wrong.size > 0:
            raise _upswing.InputError(
                f"env: {call}: expected finite float32 numbers as {what}, got {wrong[0]}")


def flags(value: Any, shape: tuple[int, ...], what: str) -> Any:
    """An environment's truth values as an array of this shape. Raises InputError."""
    if type(value) is bool and not shape:  # fast, as each step needs it
        return value
    array = np.asarray(numbers(value, shape, what))
    wrong = array[(array != 0) & (array != 1)]
    if wrong.size > 0:
        raise _upswing.InputError(f"{what} of True or False, got {wrong.flat[0]}")
    return array.astype(np.bool_, copy=False)


def brief(space: Any) -> str:
    """A space as one short line."""
    text = " ".join(str(space).split())
    return text if len(text) <= 120 else text[:117] + "..."


def one_line(error: BaseException) -> str:
    """Kind and message of an exception, as one line."""
    text = " ".join(str(error).split())
    text = text if len(text) <= 300 else text[:297] + "..."
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
