"""A check that the environments of a training share no state."""

from __future__ import annotations

import contextlib
import random
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import SyncVectorEnv, VectorEnv

from . import _upswing
from ._probes import STEPS, Probe, first_difference, name_of, plain, repeats, unwrapped

TOGETHER = 4  # repetitions with all environments before an accusation
MANY_STEPS = 160  # of all environments in turns
LONG_STEPS = 500  # by which one environment runs ahead, as for a shared counter of steps


def check_apart(evaluations: list[gym.Env[Any, Any]], training: list[Any], limit: int) -> None:
    """Raises InputError if calls of an environment change what another one returns. Warns if an
    environment does not repeat its episodes, or draws from random numbers that all share. `limit`:
    largest length of an episode."""
    envs: list[Any] = []
    for env in training:
        base = unwrapped(env) if isinstance(env, VectorEnv) else plain(env)
        envs += map(plain, base.envs) if isinstance(base, SyncVectorEnv) else [base]
    envs += map(plain, evaluations)
    group = _Group(envs, min(limit, LONG_STEPS))
    random_seed = group.check()
    if random_seed is not None:
        warnings.warn(
            f"env: two episodes after reset(seed={random_seed}) differ, so that trainings do not "
            "repeat and returns depend on eval_every; draw random numbers from self.np_random "
            "after super().reset(seed=seed), and let reset clear all other state", stacklevel=4)
    elif group.draws_global:
        warnings.warn(
            "env: the environments draw from the global random numbers of NumPy or Python, which "
            "all of them share, so that returns depend on eval_every; draw from self.np_random "
            "after super().reset(seed=seed)", stacklevel=4)


class _Group:
    """Environments that must not share state. The last one only disturbs the others.

    Attributes:
        draws_global: whether they draw from global random numbers
    """

    def __init__(self, envs: list[Any], ahead: int) -> None:
        """`ahead`: number of steps by which the last one runs ahead of the others."""
        steps = min(STEPS, max(MANY_STEPS // len(envs), 6))
        self._probes = [Probe(env, seed, steps) for seed, env in enumerate(envs)]
        self._ahead = ahead
        before = _global_random()
        self._undisturbed = [probe.run() for probe in self._probes]
        self.draws_global = _global_random() != before

    def check(self) -> int | None:
        """The seed whose episodes differ although no other environment runs; None if there is none.
        Raises InputError if one environment changes what another returns."""
        for i, place in self._disturbed().items():
            env, (call, name) = self._probes[i].env, place
            if isinstance(env, VectorEnv):
                continue  # its parts may share random numbers
            if not repeats(self._probes[i], self._undisturbed[i], call) or not all(
                    self._disturbed().get(i) == place for _ in range(TOGETHER)):
                return i
            raise _upswing.InputError(
                f"env: expected environments that share no state, got {name_of(env)}, where calls "
                f"of one change what another returns as {name}; give each its own in __init__")
        return None

    def _disturbed(self) -> dict[int, tuple[int, str]]:
        """Runs all probes in turns. Returns the first difference of each probe to its undisturbed
        record, by the probe's index, if there is one."""
        probes = self._probes
        running = dict(enumerate(probe.calls() for probe in probes))
        states: dict[int, Any] = {}
        turn = 0
        while running:
            for i, calls in list(running.items()):
                if self.draws_global and i in states:  # its own, as undisturbed
                    _set_global_random(states[i])
                if next(calls, probes) is probes:
                    del running[i]
                if self.draws_global:
                    states[i] = _global_random()
            turn += 1
            if turn == 2:  # each has begun an episode and made a step
                running.pop(len(probes) - 1, None)
                with contextlib.suppress(Exception):  # the training meets a fault itself
                    probes[-1].run_ahead(self._ahead)
        found = [first_difference(record, probe.record)
                 for record, probe in zip(self._undisturbed[:-1], probes)]
        return {i: place for i, place in enumerate(found) if place[1]}


def _global_random() -> tuple[Any, ...]:
    """The state of the global random numbers of NumPy and Python."""
    name, keys, *others = np.random.get_state()
    return name, np.asarray(keys).tobytes(), tuple(others), random.getstate()


def _set_global_random(state: tuple[Any, ...]) -> None:
    name, keys, others, python_state = state
    np.random.set_state((name, np.frombuffer(keys, np.uint32), *others))
    random.setstate(python_state)
