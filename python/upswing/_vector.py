"""Checks of a vector environment before its first step. They find resets and arrays with which a
training would learn from other numbers."""

from __future__ import annotations

import copy
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv

from . import _upswing
from ._lanes import WANTED, resets_itself
from ._probes import MORE_STEPS, ended, equal, leaves, name_of, unwrapped, views
from ._spaces import RESET, STEP, one_line, unpacked

Env = gym.Env[Any, Any]
VecEnv = VectorEnv[Any, Any, Any]

SOON = 64  # steps within which an episode must end for a check of the next episode's first step


def check_reset(env: VecEnv) -> None:
    """Raises InputError if the training could not begin single episodes of a vector environment."""
    if resets_itself(env):
        return
    base = unwrapped(env)
    mode = AutoresetMode(env.metadata.get("autoreset_mode", AutoresetMode.NEXT_STEP))
    if isinstance(base, AsyncVectorEnv) and not base.shared_memory and (
            mode == AutoresetMode.NEXT_STEP):
        raise _upswing.InputError(
            f"env: expected {type(base).__name__} with shared_memory=True or another autoreset "
            "mode, got shared_memory=False with AutoresetMode.NEXT_STEP, where the first step "
            "after a reset resets again; use AutoresetMode.SAME_STEP or DISABLED")
    if mode == AutoresetMode.NEXT_STEP and type(base) is not SyncVectorEnv and (
            type(base) is not AsyncVectorEnv or base.worker is not None):
        _check_first_step(base)
    if env.num_envs == 1:
        return
    mask = np.arange(env.num_envs) == 0
    before = np.array(unpacked(env.reset(seed=0), RESET, "env: expected ")[0])
    try:
        after = np.array(env.reset(options={"reset_mask": mask})[0])
        knows = np.array_equal(before[1:], after[1:], equal_nan=True)
    except Exception as error:
        raise _upswing.InputError(f"{WANTED}, got {one_line(error)}") from error
    if not knows:
        raise _upswing.InputError(f"{WANTED}, got {type(env).__name__}, whose reset resets or "
                                  "changes every environment")


def _check_first_step(base: VecEnv) -> None:
    """Raises InputError if the first step after a reset of ended episodes ignores its actions,
    because the environment resets again. Finds it in episodes that end soon."""
    space = copy.deepcopy(base.action_space)

    def first_step(seed: int, after_end: bool) -> tuple[npt.NDArray[np.bool_], list[Any]]:
        """The episodes that ended, and what the first step returns for the actions of this seed."""
        base.reset(seed=0)
        over = np.zeros(base.num_envs, np.bool_)
        space.seed(0)
        for _ in range(SOON if after_end else 0):
            terminated, truncated = base.step(space.sample())[2:4]
            over = np.logical_or(terminated, truncated)
            if over.any():
                base.reset(options={"reset_mask": over.copy()})
                break
        space.seed(seed)
        obs, reward, *_ = base.step(space.sample())
        return over, [np.array(part) for part in (*views(obs), reward)]

    try:
        seen = [first_step(seed, after_end) for after_end in (False, True) for seed in (1, 2)]
    except Exception:  # check_reset tells of resets without a mask
        return

    def answers(k: int, results: list[Any]) -> bool:
        """Whether environment k returns other numbers for other actions."""
        (_, one), (_, other) = results
        return not all(equal(x[k], y[k]) for x, y in zip(one, other))

    for k in np.flatnonzero(seen[2][0]).tolist():
        if answers(k, seen[:2]) and not answers(k, seen[2:]):
            raise _upswing.InputError(
                "env: expected a reset with a mask after which the next step counts, got "
                f"{type(base).__name__}, whose next step ignores its actions and resets "
                f"environment {k} again; use AutoresetMode.SAME_STEP or DISABLED")


def check_arrays(env: VecEnv) -> None:
    """Raises InputError if a vector environment would read observations after another call has
    changed them: SyncVectorEnv after the calls of all its environments, and
    AutoresetMode.SAME_STEP after the reset."""
    base = unwrapped(env)
    if isinstance(base, SyncVectorEnv):
        _check_others(list(base.envs))
    if not (resets_itself(env) and isinstance(base, (SyncVectorEnv, AsyncVectorEnv))):
        return
    if isinstance(base, SyncVectorEnv):
        _check_last(base.envs[0])
        return
    part = base.env_fns[0]()  # the others are in other processes
    try:
        _check_last(part)
    finally:
        part.close()


def _check_last(part: Env) -> None:
    """Raises InputError if a reset of the environment changes its last observation."""
    space = copy.deepcopy(part.action_space)
    space.seed(0)
    obs = unpacked(part.reset(seed=0), RESET, "env: expected ")[0]
    for _ in range(MORE_STEPS):
        returned = unpacked(part.step(space.sample()), STEP, "env: expected ")
        obs = returned[0]
        if ended(returned):
            break
    last = leaves(obs)
    first = unpacked(part.reset(), RESET, "env: expected ")[0]
    shared = any(np.shares_memory(x, y) for x in _arrays(obs) for y in _arrays(first))
    if shared or not all(map(equal, last, views(obs))):
        raise _upswing.InputError(
            "env: expected observations that a later reset does not change, for "
            f"AutoresetMode.SAME_STEP, got {name_of(part)}, which returns the same array again; "
            "return a copy, or use NEXT_STEP")


def _check_others(parts: list[Env]) -> None:
    """Raises InputError if environments return observations in one array."""
    views = [_arrays(unpacked(part.reset(seed=k), RESET, "env: expected ")[0])
             for k, part in enumerate(parts)]
    for k, part in enumerate(parts):
        for j in range(k):
            if any(np.shares_memory(x, y) for x in views[j] for y in views[k]):
                raise _upswing.InputError(
                    "env: expected observations that other environments do not change, got "
                    f"{name_of(part)}, where environments {j} and {k} return the same array; "
                    "return a copy")


def _arrays(value: Any) -> list[npt.NDArray[Any]]:
    return [view for view in views(value) if isinstance(view, np.ndarray)]
