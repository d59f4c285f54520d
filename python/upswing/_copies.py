"""Checks that copies and further environments act as the ones of the caller."""

from __future__ import annotations

import copy
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import concatenate, create_empty_array

from . import _upswing
from ._lanes import knows_seeds
from ._probes import (REPEATS, STEPS, Probe, Returned, equal, first_difference, name_of, plain,
                      repeats, unwrapped, views)
from ._spaces import RESET, STEP, unpacked

Env = gym.Env[Any, Any]
VecEnv = VectorEnv[Any, Any, Any]


def check_copies(envs: list[Any], name: str) -> None:
    """Raises InputError if the first of the environments acts otherwise than the second, its copy.
    Warns if only their attributes differ. `name` is the argument."""
    if len(envs) < 2:
        return
    env, duplicate = envs[:2]
    whole = env
    env, duplicate = plain(env), plain(duplicate)
    before = _constants(env), _constants(duplicate)
    probes = Probe(env, 0), Probe(duplicate, 0)
    records = [probe.run() for probe in probes]
    call, part = first_difference(*records)
    if part and all(repeats(probe, record, call) for probe, record in zip(probes, records)):
        raise _upswing.InputError(
            f"{name}: expected an environment whose copies act as it does, got {name_of(whole)}, "
            f"whose copy {_told(records, call, part)} after the same seed and actions, as if "
            "changes after its construction were lost; pass a function that makes the environment with its "
            "changes")
    after = _constants(env), _constants(duplicate)
    for key, value in before[0].items():
        constant = all(equal(old.get(key), new.get(key)) for old, new in zip(before, after))
        if constant and not equal(value, after[1].get(key)):
            warnings.warn(
                f"{name}: a copy of {name_of(whole)} has {key} {after[1].get(key)!r} in place of "
                f"{value!r}; if this changes its episodes, pass a function that makes the "
                "environment with its changes", stacklevel=4)
            return


def _told(records: list[list[Returned]], call: int, name: str) -> str:
    """The first difference in words."""
    if call >= min(map(len, records)):
        return "ends its episode at another step"
    whole, other = (record[call].get(name, []) for record in records)
    for x, y in zip(whole, other):
        if np.shape(x) == np.shape(y) and not equal(x, y):
            x, y = np.asarray(x), np.asarray(y)
            k = next(k for k in range(x.size) if not equal(x.flat[k], y.flat[k]))
            return f"returns {y.flat[k]} in place of {x.flat[k]} as {name}"
    return f"returns another {name}"


def _constants(env: Any) -> dict[str, Any]:
    """Attributes that are numbers, texts or arrays, of an environment and its wrappers."""
    found: dict[str, Any] = {}
    simple = (bool, int, float, str, np.generic, np.ndarray)
    while True:
        for name, value in getattr(env, "__dict__", {}).items():
            if isinstance(value, simple):
                found[f"{type(env).__name__}.{name}"] = copy.copy(value)
        if not isinstance(env, gym.Wrapper):
            return found
        env = env.env


def check_rows(env: VecEnv, singles: list[Env]) -> None:
    """Raises InputError if environments of a vector environment act otherwise than `singles`, which
    the same functions made. These are compared with the first ones."""
    base = unwrapped(env)
    if not knows_seeds(env):
        return
    count = min(base.num_envs, len(singles))
    parts: list[Any] = singles[:count]
    # The training may have wrapped it, so that the bounds of its actions are symmetric.
    parts = [part if part.action_space == base.single_action_space else part.env for part in parts]
    rows = _rows(base, count)
    for k, part in enumerate(parts):
        probe = Probe(part, k)
        record = _as(rows[k], probe.run())
        call, name = first_difference(rows[k], record)
        if not name:
            continue
        again = _rows(base, count)[k]
        if first_difference(rows[k], again)[0] > call and all(
                first_difference(record, _as(rows[k], probe.run()))[0] > call
                for _ in range(REPEATS)):
            raise _upswing.InputError(
                f"env: expected evaluations to have the environments of {type(base).__name__}, but "
                f"another {name_of(part)} of its function {k} "
                f"{_told([rows[k], record], call, name)} after the same seed and actions, as if "
                "changes after its construction were lost; make the changes in the functions, or "
                "pass eval_env")


def _rows(base: VecEnv, count: int) -> list[list[Returned]]:
    """What the first environments of a vector environment return, as a Probe with the index as its
    seed records it, up to the first end of an episode."""
    n = base.num_envs
    spaces = [copy.deepcopy(base.single_action_space) for _ in range(n)]
    for k, space in enumerate(spaces):
        space.seed(k)
    records: list[list[Returned]] = [[] for _ in range(count)]
    seeds: Any = list(range(n))
    obs = views(unpacked(base.reset(seed=seeds), RESET, "env: expected ")[0])
    for k, record in enumerate(records):
        record.append({"observation": [np.array(view[k]) for view in obs]})
    for _ in range(STEPS):
        empty: Any = create_empty_array(base.single_action_space, n)
        actions = concatenate(base.single_action_space, [space.sample() for space in spaces], empty)
        obs, *others, _ = unpacked(base.step(actions), STEP, "env: expected ")
        done = np.any(others[1]) or np.any(others[2])
        for k, record in enumerate(records):
            seen: Returned = {name: [np.array(part[k])] for name, part in zip(
                ("reward", "terminated", "truncated"), others)}
            # After an end the observation may be that of the next episode.
            record.append(seen if done else {
                "observation": [np.array(view[k]) for view in views(obs)], **seen})
        if done:
            break
    return records


def _as(rows: list[Returned], record: list[Returned]) -> list[Returned]:
    """A single environment's record with the calls and types that a vector environment has."""
    return [{name: [np.asarray(y).astype(x.dtype).reshape(x.shape) if np.size(y) == x.size else y
                    for x, y in zip(row[name], returned.get(name, []))] for name in row}
            for row, returned in zip(rows, record)]
