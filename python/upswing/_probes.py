"""Short repeatable episodes of environments, to compare what they return."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper

from ._spaces import RESET, STEP, unpacked

Returned = dict[str, list[Any]]  # what a call returned: arrays and numbers by name

STEPS, MORE_STEPS = 20, 3  # of the first and the second episode of a probe
REPEATS = 10  # before an accusation: a rare random event must not look like a difference


class Probe:
    """Two short episodes with random actions. The first begins with a seed, the second without, as
    in a training. A deterministic environment without shared state returns the same each time."""

    def __init__(self, env: Any, seed: int, steps: int = STEPS) -> None:
        self.env, self._seed, self._steps = env, seed, steps
        self._actions = copy.deepcopy(env.action_space)  # the environment's own keeps its state
        self.record: list[Returned] = []

    def run(self) -> list[Returned]:
        for _ in self.calls():
            pass
        return self.record

    def calls(self) -> Iterator[None]:
        """Runs the episodes; yields after each call of the environment."""
        self.record = []
        self._actions.seed(self._seed)
        for kwargs, steps in (({"seed": self._seed}, self._steps), ({}, MORE_STEPS)):
            returned = unpacked(self.env.reset(**kwargs), RESET, "env: expected ")
            self._note(("observation",), returned)
            yield
            for _ in range(steps):
                returned = unpacked(self.env.step(self._actions.sample()), STEP, "env: expected ")
                self._note(("observation", "reward", "terminated", "truncated"), returned)
                yield
                if ended(returned):
                    break

    def run_ahead(self, steps: int) -> None:
        """Makes more steps of the first episode, up to its end, without a record."""
        last = self.record[-1]
        if np.any(last["terminated"]) or np.any(last["truncated"]):
            return
        for _ in range(steps):
            if ended(self.env.step(self._actions.sample())):
                return

    def _note(self, names: tuple[str, ...], returned: Any) -> None:
        self.record.append({name: leaves(part) for name, part in zip(names, returned)})


def ended(returned: Any) -> bool:
    """Whether an episode has ended, by what a step returned."""
    return any(flag is True or (flag is not False and np.any(flag)) for flag in returned[2:4])


_NUMBERS = (float, bool, int, np.generic)  # immutable


def leaves(value: Any) -> list[Any]:
    """Copies of the arrays in an observation, which may be a dictionary or a tuple."""
    return [leaf if isinstance(leaf, _NUMBERS) else np.array(leaf) for leaf in views(value)]


def views(value: Any) -> list[Any]:
    """The arrays in an observation themselves."""
    if isinstance(value, dict):
        return [leaf for key in sorted(value, key=str) for leaf in views(value[key])]
    if isinstance(value, tuple):
        return [leaf for part in value for leaf in views(part)]
    return [value]


def equal(a: Any, b: Any) -> bool:
    """Whether two arrays have the same numbers. NaN equals NaN."""
    if isinstance(a, _NUMBERS) and type(a) is type(b) and a == b:
        return True
    a, b = np.asarray(a), np.asarray(b)
    if a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes():
        return a.dtype.kind != "O" or np.array_equal(a, b)
    if a.dtype.kind not in "fc" or b.dtype.kind not in "fc":
        return np.array_equal(a, b)
    return np.array_equal(a, b, equal_nan=True)


def first_difference(a: list[Returned], b: list[Returned]) -> tuple[int, str]:
    """Number of the first call with another result, and the name of that result. Without any: the
    number of calls, and an empty name."""
    for k, (x, y) in enumerate(zip(a, b)):
        if x.keys() != y.keys():  # only one of the episodes has ended
            return k, "truncated"
        for name in x:
            if len(x[name]) != len(y[name]) or not all(map(equal, x[name], y[name])):
                return k, name
    return min(len(a), len(b)), "" if len(a) == len(b) else "truncated"


def repeats(probe: Probe, record: list[Returned], call: int) -> bool:
    """Whether a probe returns this record again and again, up to the call of this number."""
    return all(first_difference(record, probe.run())[0] > call for _ in range(REPEATS))


def plain(env: Any) -> Any:
    """The environment without Gymnasium's outer wrappers, which may count or record episodes."""
    wrapper = VectorWrapper if isinstance(env, VectorEnv) else gym.Wrapper
    while isinstance(env, wrapper) and type(env).__module__.startswith("gymnasium."):
        env = env.env
    return env


def unwrapped(env: VectorEnv[Any, Any, Any]) -> VectorEnv[Any, Any, Any]:
    """A vector environment without its wrappers."""
    while isinstance(env, VectorWrapper):
        env = env.env
    return env


def name_of(env: Any) -> str:
    """The class of an environment without its wrappers."""
    return type(env.unwrapped).__name__
