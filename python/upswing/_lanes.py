"""Steps of the Gymnasium environments of a training, between numpy arrays and the environments."""

from __future__ import annotations

import signal
import threading
from types import TracebackType
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.vector import (AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv,
                              VectorWrapper)

from . import _upswing
from ._limit import Limit
from ._spaces import RESET, STEP, Spaces, flags, numbers, unpacked
from .envs import DoublePendulumVectorEnv

Env = gym.Env[Any, Any]
VecEnv = VectorEnv[Any, Any, Any]
Arrays = dict[str, npt.NDArray[Any]]  # shared with the C++ code: see CallbackEnv


OBS_TYPES = (np.dtype(np.float32), np.dtype(np.float64))  # types of an observation


class Lanes:
    """Single environments, stepped one after the other. `once`: an environment whose episode has
    ended is not stepped again, as evaluations need only one episode of each."""

    def __init__(self, envs: list[Any], space: Spaces, limit: Limit, arrays: Arrays,
                 once: bool) -> None:
        self._envs, self._space, self._limit, self._once = envs, space, limit, once
        self._arrays = arrays
        self.lengths = [0] * len(envs)  # steps of the running episodes
        self._ended = [False] * len(envs)
        self._may_hold_end = [True] * len(envs)  # whether the end of an episode may be in the arrays
        self._wheres = [f"environment {i}: expected " for i in range(len(envs))]

    @property
    def ended(self) -> bool:
        """Whether all episodes have ended; only with `once`."""
        return all(self._ended)

    def begin(self, seeds: list[int]) -> None:
        for i, (env, seed) in enumerate(zip(self._envs, seeds)):
            self._reset(i, env, seed)

    def step(self) -> None:
        a, limit, shape = self._arrays, self._limit.steps, self._space.obs_shape
        obs_rows, next_obs_rows = a["obs"], a["next_obs"]
        actions = self._space.actions_of(a["action"])
        # Usual types are recognised here, because each check costs as much as a small environment.
        for i, env in enumerate(self._envs):
            if self._ended[i]:
                continue
            returned = env.step(actions[i])
            if type(returned) is not tuple or len(returned) != 5:
                returned = unpacked(returned, STEP, self._wheres[i])
            obs, reward, terminated, truncated, _ = returned
            if type(obs) is not np.ndarray or obs.shape != shape or obs.dtype not in OBS_TYPES:
                obs = numbers(obs, shape, self._wheres[i] + "observations")
            next_obs_rows[i] = obs
            if type(reward) is not float:
                reward = numbers(reward, (), self._wheres[i] + "a reward")
            a["reward"][i] = reward
            if terminated is not False or truncated is not False:
                terminated = bool(flags(terminated, (), self._wheres[i] + "terminated"))
                truncated = bool(flags(truncated, (), self._wheres[i] + "truncated"))
            self.lengths[i] += 1
            done, out = terminated, truncated and not terminated
            if self.lengths[i] >= limit and not (done or out):
                self._limit.note_reached()
                out = True
            if not (done or out):
                if self._may_hold_end[i]:
                    a["terminated"][i] = a["truncated"][i] = False
                    self._may_hold_end[i] = False
                obs_rows[i] = obs
                continue
            a["terminated"][i], a["truncated"][i] = done, out
            self._may_hold_end[i] = True
            if self._once:
                self._ended[i] = True
            else:
                self._reset(i, env, None)

    def _reset(self, i: int, env: Env, seed: int | None) -> None:
        returned = env.reset(seed=seed) if seed is not None else env.reset()
        obs = unpacked(returned, RESET, self._wheres[i])[0]
        self._arrays["obs"][i] = numbers(obs, self._space.obs_shape,
                                         self._wheres[i] + "observations")
        self.lengths[i] = 0


WANTED = ("env: expected a vector environment with AutoresetMode.SAME_STEP, or with a reset that knows "
          "options[\"reset_mask\"], as gymnasium.make_vec(..., vectorization_mode=\"sync\") makes it")


def resets_itself(env: VecEnv) -> bool:
    """Whether ended episodes begin again in the step that ends them."""
    mode = env.metadata.get("autoreset_mode", AutoresetMode.NEXT_STEP)
    return AutoresetMode(mode) == AutoresetMode.SAME_STEP


def knows_seeds(env: VecEnv) -> bool:
    """Whether the reset takes one seed for each environment, as that of a single environment."""
    inner = env
    while isinstance(inner, VectorWrapper) and (
            type(inner).reset.__module__.startswith("gymnasium.")):
        inner = inner.env
    return isinstance(inner, (SyncVectorEnv, AsyncVectorEnv, DoublePendulumVectorEnv))


class VectorLanes:
    """The environments of a VectorEnv. Ended episodes begin again in the step that ends them: by
    the environment itself with AutoresetMode.SAME_STEP, else by a reset with a mask."""

    def __init__(self, env: VecEnv, space: Spaces, limit: Limit, arrays: Arrays) -> None:
        self._env, self._space, self._limit, self._arrays = env, space, limit, arrays
        self._same_step = resets_itself(env)
        self._lengths = np.zeros(env.num_envs, np.int64)

    def begin(self, seeds: list[int]) -> None:
        # One seed for each environment, as for single environments, if all parts know such seeds.
        each: Any = seeds if knows_seeds(self._env) else seeds[0]
        returned = self._env.reset(seed=each)
        self._store(unpacked(returned, RESET, "env: expected ")[0], "obs")
        self._lengths[:] = 0

    def step(self) -> None:
        a, count = self._arrays, (self._env.num_envs,)
        actions = self._space.batch_of(a["action"])
        obs, reward, terminated, truncated, info = unpacked(self._env.step(actions), STEP,
                                                            "env: expected ")
        self._store(obs, "next_obs")
        self._store(obs, "obs")
        a["reward"][:] = numbers(reward, count, "env: expected rewards")
        dead = flags(terminated, count, "env: expected terminated").copy()
        done = dead | flags(truncated, count, "env: expected truncated")
        self._lengths += 1
        late = ~done & (self._lengths >= self._limit.steps)
        if late.any():
            self._limit.note_reached()
        a["terminated"][:] = dead
        a["truncated"][:] = (done | late) & ~dead
        self._lengths[done | late] = 0
        if self._same_step:
            for i in np.flatnonzero(done):
                try:
                    final = info["final_obs"][i]
                except (KeyError, IndexError, TypeError):
                    final = None
                a["next_obs"][i] = numbers(final, self._space.obs_shape,
                                           f"environment {i}: expected infos[\"final_obs\"]")
        again = late if self._same_step else done | late
        if again.any():
            self._begin_again(again)

    def _begin_again(self, mask: npt.NDArray[np.bool_]) -> None:
        """Begins episodes where `mask` is set. Raises Failure if others begin too."""
        obs = unpacked(self._env.reset(options={"reset_mask": mask}), RESET, "env: expected ")[0]
        before = self._arrays["obs"].copy()
        self._store(obs, "obs")
        if not np.array_equal(before[~mask], self._arrays["obs"][~mask]):
            raise _upswing.Failure(f"{WANTED}, got one that resets every environment")

    def _store(self, obs: Any, name: str) -> None:
        array = self._arrays[name]
        array[:] = numbers(obs, array.shape, "env: expected observations")


class Interrupts:
    """Ctrl-C ends a training between two steps instead of within a step of an environment. A second
    Ctrl-C ends it at once."""

    def __init__(self) -> None:
        self.pending = False  # whether Ctrl-C was pressed
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

    def check(self) -> None:
        """Raises KeyboardInterrupt after Ctrl-C."""
        if self.pending:
            raise KeyboardInterrupt

    def _note(self, _number: int, _frame: Any) -> None:
        if self.pending:
            raise KeyboardInterrupt
        self.pending = True
