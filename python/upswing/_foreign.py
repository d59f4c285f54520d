"""Gymnasium environments that `train` makes and steps for the C++ code."""

from __future__ import annotations

import contextlib
import copy
import itertools
import json
import re
import warnings
from collections.abc import Callable
from typing import Any, Union

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv, VectorEnv, VectorWrapper
from gymnasium.wrappers import NormalizeObservation, NormalizeReward, RescaleAction
from gymnasium.wrappers.vector import (DictInfoToList, HumanRendering, RecordEpisodeStatistics,
                                       RecordVideo)
from gymnasium.wrappers.vector import RescaleAction as RescaleVectorAction

from . import _upswing
from ._copies import check_copies, check_rows
from ._lanes import Arrays, Lanes, VectorLanes
from ._limit import Limit
from .envs import DoublePendulumVectorEnv
from ._settings import whole_number
from .policy import Policy
from ._sharing import check_apart
from ._spaces import Spaces, brief, check_finite, one_line
from ._vector import check_arrays, check_reset

Env = gym.Env[Any, Any]
VecEnv = VectorEnv[Any, Any, Any]
EnvLike = Union[str, Env, VecEnv, Callable[[], Any]]


class Source:
    """The environments of a training and its evaluations.

    Attributes:
        space, limit: spaces and largest length of an episode
        num_envs: number of training environments
        description: the setting `environment` of the C++ code
        discrete: whether the actions are discrete
    """

    def __init__(self, env: EnvLike, num_envs: int | None, eval_env: EnvLike | None,
                 max_episode_steps: int | None, solved_return: float | None) -> None:
        self._env, self._eval_env = env, eval_env
        self._bases: dict[int, Any] = {}  # unwrapped environments by identity
        self._made: list[Any] = []
        first = self._own(_make(env, "env"), env, "env")
        self._first: Env | VecEnv = first  # the first training environment, or all of them
        self._make_more = _copier(env, first, "env")
        self.num_envs = _count_of(first, num_envs)
        if eval_env is not None:
            trial = _make(eval_env, "eval_env")
            self._make_evaluation = _copier(eval_env, trial, "eval_env")
        else:
            make = _part_maker(first) if isinstance(first, VectorEnv) else self._make_more
            trial = make()
            # Copies are copies of the trial, which no training changes.
            self._make_evaluation = (make if isinstance(first, VectorEnv)
                                     else _copier(env, trial, "env"))
        self._evaluation_name = "env" if eval_env is None else "eval_env"
        self._own(trial, eval_env, self._evaluation_name)
        if isinstance(trial, VectorEnv):
            raise _upswing.InputError(
                "eval_env: expected a single environment, got a vector environment")
        _check_statistics(trial, eval_env)
        self._evaluation: list[Env] = [trial]
        self.space = Spaces(_single(first, "observation_space"), _single(first, "action_space"))
        evaluated = Spaces(_single(trial, "observation_space"), _single(trial, "action_space"))
        if evaluated != self.space or (
                eval_env is not None and not evaluated.bounded_as(self.space)):
            raise _upswing.InputError(
                f"eval_env: expected the spaces of env, {self.space}, got {evaluated}; pass an "
                "environment with the same spaces")
        self.discrete = bool(self.space.choices)
        self.limit = Limit(first, trial, max_episode_steps)
        self._try(trial)
        if isinstance(first, VectorEnv):
            check_arrays(first)
            check_reset(first)
            self._try(first)
        # An environment that is passed itself needs a copy only for a second episode.
        if not isinstance(eval_env, gym.Env):
            self._add_evaluation()
        self.description = self._describe(solved_return)

    def make(self, for_evaluation: bool, count: int, evaluations: int, arrays: Arrays
             ) -> Lanes | VectorLanes:
        """The environments as the C++ code begins and steps them. The training's come first, which
        checks them together with those of its `evaluations`."""
        if for_evaluation:
            return Lanes(self._evaluation[:count], self.space, self.limit, arrays, once=True)
        while len(self._evaluation) < evaluations:
            self._add_evaluation()
        more = [] if isinstance(self._first, VectorEnv) else [
            self._own(self._make_more(), None, "env") for _ in range(1, count)]
        if isinstance(self._eval_env, gym.Env):
            check_copies(self._evaluation, "eval_env")
        if isinstance(self._env, gym.Env):
            copies = self._evaluation if self._eval_env is None else more
            check_copies([self._first, *copies], "env")
        if isinstance(self._first, VectorEnv):
            if self._eval_env is None:
                check_rows(self._first, self._evaluation)
            check_apart(self._evaluation, [self._first], self.limit.steps)
            return VectorLanes(self._first, self.space, self.limit, arrays)
        check_apart(self._evaluation, [self._first, *more], self.limit.steps)
        return Lanes([self._first, *more], self.space, self.limit, arrays, once=False)

    def close(self) -> None:
        """Closes the environments that this object made."""
        for env in self._made:
            with contextlib.suppress(Exception):  # the training is over
                env.close()
        self._made.clear()

    def _own(self, env: Any, given: Any, name: str) -> Any:
        """Notes an environment, to be closed unless it was `given`. Returns it. Raises InputError
        if it has a part in common with an earlier one."""
        if env.unwrapped is not getattr(given, "unwrapped", None):
            self._made.append(env)
        parts = getattr(env.unwrapped, "envs", None) if isinstance(env, VectorEnv) else None
        bases = [part.unwrapped for part in parts or [] if isinstance(part, gym.Env)]
        for base in [env.unwrapped, *bases]:
            if id(base) in self._bases:
                raise _upswing.InputError(
                    f"{name}: expected an environment of its own for each training environment and "
                    f"for evaluations, got the same {type(base).__name__} twice; pass a function "
                    "that makes a new one in each call")
            self._bases[id(base)] = base
        return env

    def _add_evaluation(self) -> None:
        self._evaluation.append(self._own(self._make_evaluation(), None, self._evaluation_name))

    def _try(self, env: Env | VecEnv) -> None:
        """Makes a reset and a step, before anything is written. Raises InputError."""
        vector, n = isinstance(env, VectorEnv), getattr(env, "num_envs", 1)
        arrays = self.space.arrays(n)
        lanes = (VectorLanes(env, self.space, self.limit, arrays) if vector  # type: ignore[arg-type]
                 else Lanes([env], self.space, self.limit, arrays, once=True))
        lanes.begin(list(range(n)))
        check_finite(arrays, "reset")
        lanes.step()
        check_finite(arrays, "step")

    def _describe(self, solved_return: float | None) -> str:
        description: dict[str, Any] = {
            "name": _name_of(self._evaluation[0]),
            "observations": self.space.obs_shape[0],
            "action_limit": self.space.limits, "choices": self.space.choices,
            "episode_steps": self.limit.steps}
        if solved_return is not None:
            value = solved_return
            if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or (
                    not np.isfinite(value)):
                raise _upswing.InputError(
                    f"solved_return: expected a finite number, got {value!r}")
            description["solved_return"] = float(value)
        return json.dumps(description)


def _make(env: EnvLike, name: str, symmetric: bool = True) -> Any:
    """The environment itself, of an id or made by a function. `symmetric`: with actions within ± a
    limit."""
    if isinstance(env, str):
        try:
            made: Any = gym.make(env)
        except gym.error.Error as error:
            raise _upswing.InputError(
                f"{name}: expected the id of an environment that gymnasium.make can make, got "
                f"{env!r}: {one_line(error)}") from error
    elif isinstance(env, (gym.Env, VectorEnv)):
        made = env
    elif callable(env):
        made = env()
    else:
        made = env
    if not isinstance(made, (gym.Env, VectorEnv)):
        got = type(made).__name__ if made is env else f"a function that returns {type(made).__name__}"
        raise _upswing.InputError(
            f"{name}: expected the id of an environment, a gymnasium.Env, a VectorEnv or a function "
            f"that makes one, got {got}")
    if isinstance(made, VectorEnv) and made.closed:
        raise _upswing.InputError(f"{name}: expected an open environment, got a closed one")
    return _symmetric(made) if symmetric else made


def _symmetric(env: Any) -> Any:
    """The environment, wrapped if needed so that actions are within ± a limit."""
    space = _single(env, "action_space")
    if not isinstance(space, spaces.Box) or space.dtype is None or space.dtype.kind != "f":
        return env
    bounded = np.isfinite(space.low).all() and np.isfinite(space.high).all()
    if not bounded or (space.low >= space.high).any() or (space.low == -space.high).all():
        return env  # Spaces refuses unusable bounds
    warnings.warn(
        f"env: the bounds of the actions are not symmetric about 0 ({brief(space)}); the policy "
        "acts within -1 and 1: use it with gymnasium.wrappers.RescaleAction(env, -1, 1)",
        stacklevel=6)
    low = np.full(space.shape, -1, space.dtype)
    rescale: Any = RescaleVectorAction if isinstance(env, VectorEnv) else RescaleAction
    wrapped = rescale(env, low, -low)
    # Rounding may carry an end of the scale beyond the bound.
    scaler = wrapped.wrapper if isinstance(env, VectorEnv) else wrapped
    scale = scaler.func
    scaler.func = lambda action: np.clip(scale(action), space.low, space.high)
    return wrapped


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


# Vector wrappers without which observations, rewards and ends are the same; scaled actions are
# compared as spaces.
_PLAIN = (DictInfoToList, HumanRendering, RecordEpisodeStatistics, RecordVideo, RescaleVectorAction)


def _part_maker(env: VecEnv) -> Callable[[], Any]:
    """A function that makes single environments like those of a vector environment, in turn. Raises
    InputError if they might not be alike."""
    base: Any = env
    while type(base) in _PLAIN:
        base = base.env
    functions = base.env_fns if type(base) in (AsyncVectorEnv, SyncVectorEnv) else []
    if isinstance(base, VectorWrapper) or not (functions or base.spec):
        raise _upswing.InputError(
            "eval_env: expected a single environment or a function that makes one, because "
            f"evaluations cannot take theirs from {type(base).__name__}, got none; pass an "
            "environment with the same observations and rewards")
    if not functions:
        of_vector = ("num_envs", "vectorization_mode", "vector_kwargs", "autoreset_mode")
        settings = {k: v for k, v in base.spec.kwargs.items() if k not in of_vector}
        if isinstance(base, DoublePendulumVectorEnv):
            settings = base.single_settings
        functions = [lambda: gym.make(base.spec.id, **settings)]
    in_turn = itertools.cycle(functions)

    def make() -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _symmetric(next(in_turn)())
    return make


def _check_statistics(env: Env, given: EnvLike | None) -> None:
    """Raises InputError if copies of an evaluation's environment have statistics of their own."""
    wrapper: Any = env
    while isinstance(wrapper, gym.Wrapper):
        if isinstance(wrapper, (NormalizeObservation, NormalizeReward)) and (
                given is None or isinstance(given, gym.Env)):
            raise _upswing.InputError(
                "eval_env: expected a function that makes an environment, because copies of "
                f"{type(wrapper).__name__} do not share its statistics, got "
                f"{'none' if given is None else 'an environment'}")
        wrapper = wrapper.env


def _count_of(first: Any, num_envs: int | None) -> int:
    """The number of training environments. Raises InputError."""
    if not isinstance(first, VectorEnv):
        return 0 if num_envs is None else whole_number("num_envs", num_envs)
    if num_envs is not None and num_envs != first.num_envs:
        raise _upswing.InputError(
            f"num_envs: expected none with a vector environment of {first.num_envs}, got {num_envs}")
    return int(first.num_envs)


def run_episodes(policy: Callable[[npt.NDArray[np.float32]], Any], env: EnvLike, episodes: int,
                 seed: int, max_episode_steps: int | None, progress: Callable[[float], Any] | None
                 ) -> tuple[str, dict[str, npt.NDArray[np.float64]]]:
    """The name of an environment, and return, length and termination of each episode of a policy.
    Raises InputError."""
    # A function acts within the environment's own bounds.
    made = _make(env, "env", symmetric=isinstance(policy, Policy))
    if isinstance(made, VectorEnv):
        raise _upswing.InputError("env: expected a single environment, got a vector environment")
    space = Spaces(_single(made, "observation_space"), _single(made, "action_space"))
    limit = Limit(made, made, max_episode_steps)
    if isinstance(policy, Policy):
        _check_policy(policy, space)
    arrays = space.arrays(1)
    columns: dict[str, list[float]] = {"return": [], "length": [], "terminated": []}
    try:
        for k in range(episodes):
            lanes, total = Lanes([made], space, limit, arrays, once=True), 0.0
            lanes.begin([(seed + k) % 2**31])
            check_finite(arrays, "reset")
            while not lanes.ended:
                arrays["action"][0] = space.row_of(policy(arrays["obs"].astype(np.float32)))
                lanes.step()
                check_finite(arrays, "step")
                total += arrays["reward"][0]
            columns["return"].append(total)
            columns["length"].append(lanes.lengths[0])
            columns["terminated"].append(arrays["terminated"][0])
            if progress is not None:
                progress((k + 1) / episodes)
    finally:
        if made.unwrapped is not getattr(env, "unwrapped", None):
            made.close()
    return _name_of(made), {name: np.array(column, np.float64) for name, column in columns.items()}


def _check_policy(policy: Policy, space: Spaces) -> None:
    """Raises InputError unless the policy was trained for such observations and actions."""
    if (policy.obs_size, policy.action_size) != (space.obs_shape[0], len(space.limits)):
        raise _upswing.InputError(
            f"policy: expected one for {space}, got one of {policy.task} for {policy.obs_size} "
            f"numbers of an observation and {policy.action_size} of an action")
    told = re.search(r'^environment = (".+")$', policy.info["config"] or "", re.MULTILINE)
    trained = json.loads(json.loads(told[1])) if told else {}
    for name, wanted in (("choices", space.choices), ("action_limit", space.limits)):
        if trained.get(name, wanted) != wanted:
            choices, limits = trained["choices"], trained["action_limit"]
            got = f"the actions {choices}" if choices else f"actions within ±{limits}"
            raise _upswing.InputError(
                f"policy: expected one for {space}, got one of {policy.task} for {got[:120]}")


def _name_of(env: Env) -> str:
    name = env.spec.id if env.spec is not None else type(env.unwrapped).__name__
    return re.sub(r"[^A-Za-z0-9_./:-]", "-", name)[:50]


def _single(env: Any, name: str) -> Any:
    """A space of a single environment."""
    return getattr(env, f"single_{name}" if isinstance(env, VectorEnv) else name, None)
