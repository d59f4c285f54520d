"""Gymnasium environments that `train` makes and steps for the C++ code."""

from __future__ import annotations

import copy
import json
import re
import signal
import threading
import warnings
from collections.abc import Callable
from types import TracebackType
from typing import Any, Union

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.wrappers import RescaleAction
from gymnasium.wrappers.vector import RescaleAction as RescaleVectorAction

from . import _upswing
from ._settings import whole_number

Env = gym.Env[Any, Any]
VecEnv = VectorEnv[Any, Any, Any]
EnvLike = Union[str, Env, VecEnv, Callable[[], Any]]
Arrays = dict[str, npt.NDArray[Any]]
MOST_CHOICES = 1001


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
        self.num_envs = _count_of(first, num_envs)
        trial = _evaluation_env(first, self._make_more, eval_env)
        self._make_evaluation = _evaluation_copier(first, self._make_more, eval_env, trial)
        self._evaluation: list[Env] = [trial]
        self.space = _Spaces(_single(first, "observation_space"), _single(first, "action_space"))
        evaluated = _Spaces(trial.observation_space, trial.action_space)
        if evaluated != self.space:
            raise _upswing.InputError(
                f"eval_env: expected the spaces of env, {self.space}, got {evaluated}; pass an "
                "environment with the same spaces")
        self.discrete = bool(self.space.choices)
        self._limit = _limit_of(first, max_episode_steps)
        self.cause: BaseException | None = None
        self._try(trial)
        self.description = self._describe(solved_return)

    def make(self, seeds: list[int], for_evaluation: bool, arrays: Arrays) -> Callable[[], None]:
        """Resets environments for the C++ code; returns the function that steps them."""
        try:
            lanes: _Lanes | _VectorLanes
            if for_evaluation:
                while len(self._evaluation) < len(seeds):
                    self._evaluation.append(self._make_evaluation())
                lanes = _Lanes(self._evaluation[:len(seeds)], self, arrays, once=True)
            elif isinstance(self._first, VectorEnv):
                lanes = _VectorLanes(self._first, self, arrays)
            else:
                envs = [self._first, *(self._make_more() for _ in seeds[1:])]
                lanes = _Lanes(envs, self, arrays, once=False)
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

    def failure(self, what: str, error: BaseException, index: int | None = None) -> _upswing.Failure:
        """The error for an exception of an environment in `what`, "reset" or "step"."""
        self.cause = error
        where = "" if index is None else f"environment {index}: "
        return _upswing.Failure(f"{where}{what} raised {_one_line(error)}")

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
                f"{_one_line(error)}") from error
        if not np.isfinite(reward):
            raise _upswing.InputError(f"env: expected finite rewards, got {reward}")

    def _describe(self, solved_return: float | None) -> str:
        env = self._first
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


class _Spaces:
    """Checked spaces of an environment. Raises InputError for others."""

    def __init__(self, obs: spaces.Space[Any], action: spaces.Space[Any]) -> None:
        if not isinstance(obs, spaces.Box) or len(obs.shape) != 1 or obs.shape[0] == 0:
            raise _upswing.InputError(
                f"env: expected a Box observation space of one dimension, got {_brief(obs)}; "
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
                    f"env: expected actions of floating-point numbers, got {_brief(action)}")
            if not (np.isfinite(action.low).all() and np.isfinite(action.high).all()):
                raise _upswing.InputError(
                    f"env: expected finite bounds of the actions, got {_brief(action)}; give "
                    "the environment an action_space with finite bounds")
            if not (action.low < action.high).all():
                raise _upswing.InputError(
                    f"env: expected lower bounds of the actions below the upper ones, got "
                    f"{_brief(action)}")
            self.limits = [float(high) for high in action.high.ravel()]
        else:
            raise _upswing.InputError(
                f"env: expected a Box or Discrete action space, got {_brief(action)}")

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
        return isinstance(other, _Spaces) and (
            self.obs_shape == other.obs_shape and self.action == other.action)

    def __str__(self) -> str:
        return f"observations of shape {self.obs_shape} and actions {_brief(self.action)}"


class _Lanes:
    """Single environments, stepped one after the other. `once`: an environment whose episode has
    ended is not stepped again, as evaluations need only one episode of each."""

    def __init__(self, envs: list[Any], source: Source, arrays: Arrays, once: bool) -> None:
        self._envs, self._source, self._once = envs, source, once
        self._arrays = arrays
        self._lengths = [0] * len(envs)
        self._ended = [False] * len(envs)

    def begin(self, seeds: list[int]) -> None:
        for i, (env, seed) in enumerate(zip(self._envs, seeds)):
            self._reset(i, env, seed)

    def step(self) -> None:
        source, limit = self._source, self._source.limit
        a = self._arrays
        for i, env in enumerate(self._envs):
            if self._ended[i]:
                continue
            try:
                obs, reward, terminated, truncated, _ = env.step(source.space.action_of(a["action"][i]))
                a["reward"][i] = reward
            except Exception as error:
                raise source.failure("step", error, i) from error
            self._store(i, obs, "next_obs")
            self._lengths[i] += 1
            done = bool(terminated)
            out = not done and (bool(truncated) or self._lengths[i] >= limit)
            a["terminated"][i], a["truncated"][i] = done, out
            if not (done or out):
                a["obs"][i] = a["next_obs"][i]
            elif self._once:
                self._ended[i] = True
            else:
                self._reset(i, env, None)

    def _reset(self, i: int, env: Env, seed: int | None) -> None:
        try:
            obs, _ = env.reset(seed=seed) if seed is not None else env.reset()
        except Exception as error:
            raise self._source.failure("reset", error, i) from error
        self._store(i, obs, "obs")
        self._lengths[i] = 0

    def _store(self, i: int, obs: Any, name: str) -> None:
        shape = self._source.space.obs_shape
        if np.shape(obs) != shape:
            raise _upswing.Failure(
                f"environment {i}: expected observations of shape {shape}, as the environment's "
                f"observation_space, got shape {np.shape(obs)}")
        self._arrays[name][i] = obs


class _VectorLanes:
    """The environments of a VectorEnv. Ended episodes begin again in the step that ends them: by
    the environment itself with AutoresetMode.SAME_STEP, else by a reset with a mask."""

    def __init__(self, env: VecEnv, source: Source, arrays: Arrays) -> None:
        self._env, self._source, self._arrays = env, source, arrays
        mode = env.metadata.get("autoreset_mode", AutoresetMode.NEXT_STEP)
        self._same_step = AutoresetMode(mode) == AutoresetMode.SAME_STEP
        self._lengths = np.zeros(env.num_envs, np.int64)

    def begin(self, seeds: list[int]) -> None:
        obs, _ = self._env.reset(seed=seeds[0])
        self._store(obs, "obs")

    def step(self) -> None:
        try:
            self._step()
        except _upswing.Error:
            raise
        except Exception as error:
            raise self._source.failure("step", error) from error

    def _step(self) -> None:
        a, space = self._arrays, self._source.space
        if space.choices:
            actions = a["action"][:, 0].astype(np.int64)
        else:
            shape = (self._env.num_envs, *(space.action.shape or ()))
            actions = a["action"].astype(space.action.dtype).reshape(shape)
        obs, reward, terminated, truncated, info = self._env.step(actions)
        self._store(obs, "next_obs")
        self._store(obs, "obs")
        done = np.asarray(terminated, bool) | np.asarray(truncated, bool)
        self._lengths += 1
        late = ~done & (self._lengths >= self._source.limit)
        a["reward"][:] = reward
        a["terminated"][:] = terminated
        a["truncated"][:] = (done | late) & ~np.asarray(terminated, bool)
        self._lengths[done | late] = 0
        if self._same_step:
            for i in np.flatnonzero(done):
                a["next_obs"][i] = info["final_obs"][i]
        again = late if self._same_step else done | late
        if again.any():
            self._begin_again(again)

    def _begin_again(self, mask: npt.NDArray[np.bool_]) -> None:
        """Begins episodes where `mask` is set. Raises Failure if others begin too."""
        obs, _ = self._env.reset(options={"reset_mask": mask})
        before = self._arrays["obs"].copy()
        self._store(obs, "obs")
        if not np.array_equal(before[~mask], self._arrays["obs"][~mask]):
            raise _upswing.Failure(
                "env: expected a vector environment with AutoresetMode.SAME_STEP, or with a reset "
                "that knows options[\"reset_mask\"], got one that resets every environment")

    def _store(self, obs: Any, name: str) -> None:
        array = self._arrays[name]
        if np.shape(obs) != array.shape:
            raise _upswing.Failure(
                f"env: expected observations of shape {array.shape}, got {np.shape(obs)}")
        array[:] = obs


class Interrupts:
    """Ctrl-C ends a training between two steps instead of within a step of an environment. A second
    Ctrl-C ends it at once."""

    def __init__(self) -> None:
        self._pending = False
        self._before: Any = None

    def __enter__(self) -> Interrupts:
        if (threading.current_thread() is threading.main_thread()
                and signal.getsignal(signal.SIGINT) is signal.default_int_handler):
            self._before = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)
        if self._pending and kind is None:
            raise KeyboardInterrupt

    def check(self) -> None:
        """Raises KeyboardInterrupt after Ctrl-C."""
        if self._pending:
            raise KeyboardInterrupt

    def _note(self, _number: int, _frame: Any) -> None:
        if self._pending:
            raise KeyboardInterrupt
        self._pending = True


def _make(env: EnvLike, name: str) -> Any:
    """The environment itself, of an id or made by a function; with actions within ± a limit."""
    if isinstance(env, str):
        try:
            made: Any = gym.make(env)
        except Exception as error:
            raise _upswing.InputError(
                f"{name}: expected the id of an environment that gymnasium.make knows, got "
                f"{env!r}: {_one_line(error)}") from error
    elif isinstance(env, (gym.Env, VectorEnv)):
        made = env
    elif callable(env):
        try:
            made = env()
        except Exception as error:
            raise _upswing.InputError(
                f"{name}: expected a function that makes an environment, but it raised "
                f"{_one_line(error)}") from error
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
        f"env: the bounds of the actions are not symmetric about 0 ({_brief(space)}); the policy "
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
                f"training needs several, got {_one_line(error)}; pass a function that makes one"
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


def _evaluation_copier(first: Any, more: Callable[[], Any], eval_env: EnvLike | None,
                       trial: Any) -> Callable[[], Any]:
    """A function that makes further environments of evaluations."""
    if eval_env is not None:
        return _copier(eval_env, trial, "eval_env")
    return (lambda: _part_of(first)) if isinstance(first, VectorEnv) else more


def _part_of(env: VecEnv) -> Any:
    """A single environment like those of a vector environment."""
    functions = getattr(env.unwrapped, "env_fns", None)
    try:
        if functions:
            return _symmetric(functions[0]())
        if env.spec is not None:
            return _symmetric(gym.make(env.spec.id, **env.spec.kwargs))
    except Exception:  # the next line says what to do
        pass
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


def _limit_of(env: Any, asked: int | None) -> int:
    """Largest length of an episode in steps. Raises InputError."""
    own = env.spec.max_episode_steps if env.spec is not None else None
    if own is None and isinstance(env, VectorEnv):
        parts = getattr(env.unwrapped, "envs", None)
        part = parts[0].spec if parts else None
        own = part.max_episode_steps if part is not None else None
    if asked is None and own is None:
        raise _upswing.InputError(
            f"max_episode_steps: expected a number of steps, because {type(env.unwrapped).__name__} "
            "has no time limit of its own and an episode might never end, got none")
    limits = [limit for limit in (own, asked) if limit is not None]
    limit = min(whole_number("max_episode_steps", value) for value in limits)
    if limit < 1:
        raise _upswing.InputError(f"max_episode_steps: expected 1 or more, got {limit}")
    return limit


def _single(env: Any, name: str) -> Any:
    """A space of a single environment."""
    return getattr(env, f"single_{name}" if isinstance(env, VectorEnv) else name)


def _brief(space: Any) -> str:
    """A space as one short line."""
    text = " ".join(str(space).split())
    return text if len(text) <= 120 else text[:117] + "..."


def _one_line(error: BaseException) -> str:
    """Kind and message of an exception, as one line."""
    text = " ".join(str(error).split())
    text = text if len(text) <= 300 else text[:297] + "..."
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
