"""Gymnasium environments that `train` makes and steps for the C++ code."""

from __future__ import annotations

import contextlib
import copy
import json
import re
import warnings
from collections.abc import Callable
from typing import Any, Union

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import VectorEnv
from gymnasium.wrappers import RescaleAction
from gymnasium.wrappers.vector import RescaleAction as RescaleVectorAction

from . import _upswing
from ._lanes import Arrays, Lanes, VectorLanes, check_reset
from ._settings import whole_number
from ._spaces import Spaces, brief, one_line

Env = gym.Env[Any, Any]
VecEnv = VectorEnv[Any, Any, Any]
EnvLike = Union[str, Env, VecEnv, Callable[[], Any]]


class Source:
    """The environments of a training and its evaluations.

    Attributes:
        num_envs: number of training environments
        description: the setting `environment` of the C++ code
        discrete: whether the actions are discrete
        cause: exception of an environment that stopped the training
    """

    def __init__(self, env: EnvLike, num_envs: int | None, eval_env: EnvLike | None,
                 max_episode_steps: int | None, solved_return: float | None) -> None:
        first = _make(env, "env")
        self._first: Env | VecEnv = first  # the first training environment, or all of them
        self._make_more = _copier(env, first, "env")
        self._made: list[Any] = [] if first.unwrapped is getattr(env, "unwrapped", None) else [first]
        self.num_envs = _count_of(first, num_envs)
        trial = _evaluation_env(first, self._make_more, eval_env)
        if trial.unwrapped is not getattr(eval_env, "unwrapped", None):
            self._made.append(trial)
        if isinstance(first, VectorEnv) and eval_env is None:
            self._make_evaluation: Callable[[], Any] = lambda: _part_of(first)
        else:
            # Copies are copies of the trial, which no training changes.
            self._make_evaluation = (_copier(env, trial, "env") if eval_env is None
                                     else _copier(eval_env, trial, "eval_env"))
        self._evaluation: list[Env] = [trial]
        self.space = Spaces(_single(first, "observation_space"), _single(first, "action_space"))
        evaluated = Spaces(trial.observation_space, trial.action_space)
        if evaluated != self.space:
            raise _upswing.InputError(
                f"eval_env: expected the spaces of env, {self.space}, got {evaluated}; pass an "
                "environment with the same spaces")
        self.discrete = bool(self.space.choices)
        self._limit = _limit_of(first, trial, max_episode_steps)
        self.cause: BaseException | None = None
        if isinstance(first, VectorEnv):
            check_reset(first)
        self._try(trial)
        self.description = self._describe(solved_return)

    def make(self, seeds: list[int], for_evaluation: bool, arrays: Arrays) -> Callable[[], None]:
        """Resets environments for the C++ code; returns the function that steps them."""
        try:
            lanes: Lanes | VectorLanes
            if for_evaluation:
                while len(self._evaluation) < len(seeds):
                    self._evaluation.append(self._make_evaluation())
                    self._made.append(self._evaluation[-1])
                lanes = Lanes(self._evaluation[:len(seeds)], self, arrays, once=True)
            elif isinstance(self._first, VectorEnv):
                lanes = VectorLanes(self._first, self, arrays)
            else:
                more = [self._make_more() for _ in seeds[1:]]
                self._made += more
                envs = [self._first, *more]
                lanes = Lanes(envs, self, arrays, once=False)
            lanes.begin(seeds)
        except _upswing.Error:
            raise
        except Exception as error:
            raise self.failure("reset", error) from error
        return lanes.step

    @property
    def limit(self) -> int:
        """Largest number of steps of an episode."""
        return self._limit

    def failure(self, what: str, error: BaseException, index: int | None = None) -> RuntimeError:
        """The error for an exception of an environment in `what`, "reset" or "step"."""
        self.cause = error
        where = "" if index is None else f"environment {index}: "
        failure: RuntimeError = _upswing.Failure(f"{where}{what} raised {one_line(error)}")
        return failure

    def close(self) -> None:
        """Closes the environments that this object made."""
        for env in self._made:
            with contextlib.suppress(Exception):  # the training is over
                env.close()
        self._made.clear()

    def _try(self, env: Env) -> None:
        """Makes a reset and a step, before anything is written. Raises InputError."""
        call = "reset"
        try:
            obs, _ = env.reset(seed=0)
            self.space.check(obs, "env: reset")
            call = "step"
            obs, reward, _, _, _ = env.step(self.space.any_action())
            self.space.check(obs, "env: step")
            reward = float(reward)
        except _upswing.Error:
            raise
        except Exception as error:
            raise _upswing.InputError(
                f"env: expected an environment that works, but its {call} raised "
                f"{one_line(error)}") from error
        if not np.isfinite(reward):
            raise _upswing.InputError(f"env: expected finite rewards, got {reward}")

    def _describe(self, solved_return: float | None) -> str:
        env = self._evaluation[0]
        name = env.spec.id if env.spec is not None else type(env.unwrapped).__name__
        description: dict[str, Any] = {
            "name": re.sub(r"[^A-Za-z0-9_./:-]", "-", name)[:50],
            "observations": self.space.obs_shape[0],
            "action_limit": self.space.limits, "choices": self.space.choices,
            "episode_steps": self._limit}
        if solved_return is not None:
            value = solved_return
            if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or (
                    not np.isfinite(value)):
                raise _upswing.InputError(
                    f"solved_return: expected a finite number, got {value!r}")
            description["solved_return"] = float(value)
        return json.dumps(description)


def _make(env: EnvLike, name: str) -> Any:
    """The environment itself, of an id or made by a function; with actions within ± a limit."""
    if isinstance(env, str):
        try:
            made: Any = gym.make(env)
        except Exception as error:
            raise _upswing.InputError(
                f"{name}: expected the id of an environment that gymnasium.make knows, got "
                f"{env!r}: {one_line(error)}") from error
    elif isinstance(env, (gym.Env, VectorEnv)):
        made = env
    elif callable(env):
        try:
            made = env()
        except Exception as error:
            raise _upswing.InputError(
                f"{name}: expected a function that makes an environment, but it raised "
                f"{one_line(error)}") from error
    else:
        made = env
    if not isinstance(made, (gym.Env, VectorEnv)):
        got = type(made).__name__ if made is env else f"a function that returns {type(made).__name__}"
        raise _upswing.InputError(
            f"{name}: expected the id of an environment, a gymnasium.Env, a VectorEnv or a function "
            f"that makes one, got {got}")
    if isinstance(made, VectorEnv) and made.closed:
        raise _upswing.InputError(f"{name}: expected an open environment, got a closed one")
    return _symmetric(made)


def _symmetric(env: Any) -> Any:
    """The environment, wrapped if needed so that actions are within ± a limit."""
    space = _single(env, "action_space")
    if not isinstance(space, spaces.Box) or space.dtype is None or space.dtype.kind != "f":
        return env
    finite = np.isfinite(space.low).all() and np.isfinite(space.high).all()
    if not finite or (space.low == -space.high).all():
        return env
    warnings.warn(
        f"env: the bounds of the actions are not symmetric about 0 ({brief(space)}); the policy "
        "acts within -1 and 1: use it with gymnasium.wrappers.RescaleAction(env, -1, 1)",
        stacklevel=5)
    low = np.full(space.shape, -1, space.dtype)
    return (RescaleVectorAction if isinstance(env, VectorEnv) else RescaleAction)(env, low, -low)


def _copier(env: EnvLike, made: Any, name: str) -> Callable[[], Any]:
    """A function that makes further environments like `made`, the environment of `env`."""
    if isinstance(env, str) or (callable(env) and not isinstance(env, (gym.Env, VectorEnv))):
        def make() -> Any:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return _make(env, name)
        return make

    def duplicate() -> Any:
        try:
            return copy.deepcopy(made)
        except Exception as error:
            raise _upswing.InputError(
                f"{name}: expected an environment that copy.deepcopy can copy, because the "
                f"training needs several, got {one_line(error)}; pass a function that makes one"
            ) from error
    return duplicate


def _evaluation_env(first: Any, more: Callable[[], Any], eval_env: EnvLike | None) -> Env:
    """The first environment of evaluations."""
    if eval_env is not None:
        made = _make(eval_env, "eval_env")
    elif not isinstance(first, VectorEnv):
        made = more()
    else:
        made = _part_of(first)
    if isinstance(made, VectorEnv):
        raise _upswing.InputError(
            "eval_env: expected a single environment, got a vector environment")
    env: Env = made
    return env


def _part_of(env: VecEnv) -> Any:
    """A single environment like those of a vector environment."""
    functions = getattr(env.unwrapped, "env_fns", None)
    with contextlib.suppress(Exception), warnings.catch_warnings():  # the error below says what to do
        warnings.simplefilter("ignore")
        if functions:
            return _symmetric(functions[0]())
        if env.spec is not None:
            of_vector = ("num_envs", "vectorization_mode", "vector_kwargs", "autoreset_mode")
            settings = {k: v for k, v in env.spec.kwargs.items() if k not in of_vector}
            return _symmetric(gym.make(env.spec.id, **settings))
    raise _upswing.InputError(
        "eval_env: expected an environment or a function that makes one, because evaluations need "
        f"single environments and {type(env.unwrapped).__name__} does not say how to make them, "
        "got none")


def _count_of(first: Any, num_envs: int | None) -> int:
    """The number of training environments. Raises InputError."""
    if not isinstance(first, VectorEnv):
        return 0 if num_envs is None else whole_number("num_envs", num_envs)
    if num_envs is not None and num_envs != first.num_envs:
        raise _upswing.InputError(
            f"num_envs: expected none with a vector environment of {first.num_envs}, got {num_envs}")
    return int(first.num_envs)


def _wrapped_limit(env: Any) -> int | None:
    """The limit of the outermost TimeLimit around an environment; None without one."""
    while isinstance(env, gym.Wrapper):
        if isinstance(env, gym.wrappers.TimeLimit):
            return env._max_episode_steps  # pylint: disable=protected-access
        env = env.env
    return None


def _limit_of(env: Any, single: Env, asked: int | None) -> int:
    """Largest length of an episode in steps. `single` is an environment like `env`, which may be a
    vector environment. Raises InputError."""
    own = env.spec.max_episode_steps if env.spec is not None else None
    if own is None and isinstance(env, VectorEnv) and single.spec is not None:
        own = single.spec.max_episode_steps
    if own is None:
        own = _wrapped_limit(single)
    if asked is None and own is None:
        raise _upswing.InputError(
            "max_episode_steps: expected a number of steps, because "
            f"{type(single.unwrapped).__name__} has no time limit of its own and an episode might "
            "never end, got none")
    limits = [limit for limit in (own, asked) if limit is not None]
    limit = min(whole_number("max_episode_steps", value) for value in limits)
    if limit < 1:
        raise _upswing.InputError(f"max_episode_steps: expected 1 or more, got {limit}")
    return limit


def _single(env: Any, name: str) -> Any:
    """A space of a single environment."""
    return getattr(env, f"single_{name}" if isinstance(env, VectorEnv) else name)
