"""Steps of the Gymnasium environments of a training, between numpy arrays and the environments."""

from __future__ import annotations

import signal
import threading
from types import TracebackType
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode, VectorEnv

from . import _upswing
from ._spaces import one_line

if TYPE_CHECKING:
    from ._foreign import Source

Env = gym.Env[Any, Any]
VecEnv = VectorEnv[Any, Any, Any]
Arrays = dict[str, npt.NDArray[Any]]  # shared with the C++ code: see CallbackEnv


class Lanes:
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


WANTED = ("env: expected a vector environment with AutoresetMode.SAME_STEP, or with a reset that knows "
          "options[\"reset_mask\"], as gymnasium.make_vec(..., vectorization_mode=\"sync\") makes it")


def check_reset(env: VecEnv) -> None:
    """Raises InputError if the training could not begin single episodes of a vector environment."""
    if _resets_itself(env) or env.num_envs == 1:
        return
    mask = np.arange(env.num_envs) == 0
    try:
        before = np.array(env.reset(seed=0)[0])
        after = np.array(env.reset(options={"reset_mask": mask})[0])
        knows = np.array_equal(before[1:], after[1:], equal_nan=True)
    except Exception as error:
        raise _upswing.InputError(f"{WANTED}, got {one_line(error)}") from error
    if not knows:
        raise _upswing.InputError(f"{WANTED}, got {type(env.unwrapped).__name__}, whose reset "
                                  "resets every environment")


def _resets_itself(env: VecEnv) -> bool:
    """Whether ended episodes begin again in the step that ends them."""
    mode = env.metadata.get("autoreset_mode", AutoresetMode.NEXT_STEP)
    return AutoresetMode(mode) == AutoresetMode.SAME_STEP


class VectorLanes:
    """The environments of a VectorEnv. Ended episodes begin again in the step that ends them: by
    the environment itself with AutoresetMode.SAME_STEP, else by a reset with a mask."""

    def __init__(self, env: VecEnv, source: Source, arrays: Arrays) -> None:
        self._env, self._source, self._arrays = env, source, arrays
        self._same_step = _resets_itself(env)
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
            raise _upswing.Failure(f"{WANTED}, got one that resets every environment")

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
