"""The double pendulum as environments of Gymnasium, computed by the C++ code."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from . import _upswing
from ._settings import text_of, texts_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._types import EnvironmentSettings

Floats = npt.NDArray[np.floating[Any]]
Integers = npt.NDArray[np.integer[Any]]


class _Core:
    """What one and many environments have in common."""

    def __init__(self, num_envs: int, settings: dict[str, Any], actions: str, levels: int,
                 same_step: bool) -> None:
        if "envs" in settings:
            raise _upswing.InputError("envs: expected num_envs instead")
        self.env = _upswing.Environments(text_of(num_envs), texts_of(settings), actions,
                                         text_of(levels), same_step)
        spec = self.env.spec()
        self.num_envs: int = spec["num_envs"]
        self.step_seconds: float = spec["step_seconds"]
        self.reward_terms: list[str] = spec["reward_terms"]
        self.state_names: list[str] = spec["state_names"]
        self.levels = np.array(spec["levels"])
        self.settings: str = spec["settings"]
        self.threads: int = spec["threads"]
        self.is_reset = False
        # cos, sin, w, cos, sin, w, energy, height; what a memory adds has no bounds either.
        high = np.full(spec["obs_size"], np.inf, np.float32)
        high[[0, 1, 3, 4, 7]] = 1
        self.observation_space = spaces.Box(-high, high, dtype=np.float32)
        limit = np.array(spec["action_limit"], np.float32)
        self.action_space: spaces.Box | spaces.Discrete = (
            spaces.Discrete(len(self.levels)) if len(self.levels) > 0
            else spaces.Box(-limit, limit, dtype=np.float32))

    def actions_of(self, actions: Any) -> npt.NDArray[Any]:
        """An array as the C++ code takes it: float32 or float64 torques, int32 or int64 levels."""
        array = np.asarray(actions)
        kind = array.dtype.kind
        if len(self.levels) > 0:
            if kind not in "iu":
                raise _upswing.InputError(
                    f"action: expected whole numbers, torque levels from 0 to "
                    f"{len(self.levels) - 1}, got {array.dtype}")
            if array.dtype not in (np.int32, np.int64):
                array = array.astype(np.int64)
        elif array.dtype not in (np.float32, np.float64):
            if kind != "f":
                raise _upswing.InputError(
                    f"action: expected torques in N·m as floating-point numbers, got {array.dtype} "
                    "(or actions=\"levels\")")
            array = array.astype(np.float32)
        return np.ascontiguousarray(array) if array.ndim > 0 else array

    def check(self, closed: bool) -> None:
        """Raises unless a step can be made."""
        if closed:
            raise gym.error.ClosedEnvironmentError("step: the environment is closed")
        if not self.is_reset:
            raise gym.error.ResetNeeded("step: expected a call of reset before it")

    def seeds_of(self, seed: Any, generator: np.random.Generator) -> list[int | None]:
        """A seed for each environment: None goes on with its random stream."""
        n = self.num_envs
        if seed is None:
            if self.is_reset:
                return [None] * n
            seed = int(generator.integers(2**53))
        if isinstance(seed, (Sequence, np.ndarray)) and not isinstance(seed, str):
            if len(seed) != n:
                raise _upswing.InputError(f"seed: expected {n} seeds, got {len(seed)}")
            fresh = iter([] if self.is_reset else generator.integers(2**53, size=n).tolist())
            return [next(fresh, None) if one is None else _seed(one) for one in seed]
        first = _seed(seed)
        return [(first + i) % 2**64 for i in range(n)]

    def begin(self, seeds: list[int | None], options: dict[str, Any] | None) -> None:
        """Begins episodes."""
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        states = options.pop("state", None)
        if options:
            raise _upswing.InputError(
                f"options: expected state or reset_mask, got {', '.join(map(repr, options))}")
        n = self.num_envs
        if mask is None:
            mask = np.ones(n, np.bool_)
        else:
            mask = np.asarray(mask)
            if mask.shape != (n,) or mask.dtype != np.bool_ or not mask.any():
                raise _upswing.InputError(
                    f"reset_mask: expected {n} bools, one of them true at least, got {mask.dtype} "
                    f"of shape {mask.shape}")
            if not self.is_reset and not mask.all():
                raise gym.error.ResetNeeded("reset_mask: expected a reset of all before it")
        if states is not None:
            size = len(self.state_names)
            try:
                states = np.asarray(states, np.float64)
                if states.shape not in ((size,), (n, size)):
                    raise ValueError
                states = np.broadcast_to(states, (n, size))
            except (ValueError, TypeError):
                raise _upswing.InputError(
                    f"state: expected {', '.join(self.state_names)} (rad, rad/s) of shape "
                    f"({size},) or ({n}, {size}), got shape {np.shape(states)}") from None
            if not np.isfinite(states[mask]).all():
                raise _upswing.InputError("state: expected finite numbers")
        self.env.reset(seeds, mask.astype(np.uint8).tolist())
        if states is not None:
            for i in np.flatnonzero(mask):
                self.env.set_state(int(i), states[i].tolist())
        self.is_reset = True

    def states(self) -> npt.NDArray[np.float64]:
        return np.array([self.env.get_state(i) for i in range(self.num_envs)])


def _seed(seed: Any) -> int:
    try:
        number = operator.index(seed)
    except TypeError:
        raise _upswing.InputError(f"seed: expected an integer, got {seed!r}") from None
    if not 0 <= number < 2**64:
        raise _upswing.InputError(f"seed: expected an integer from 0 to 2^64 - 1, got {number}")
    return number


class DoublePendulumEnv(gym.Env[npt.NDArray[np.float32], Any]):
    """A double pendulum with a motor at its first joint, to be swung up and balanced.

    `gym.make("upswing/DoublePendulum-v0")` makes it. docs/task.md has it as formulas.

    Observation (8,), float32: cos q1, sin q1, w1/10, cos q2, sin q2, w2/20, energy (0 hanging at
    rest, 1 upright at rest), height of the tip (-1 to 1); angles in rad, 0 hanging, q2 relative to
    the first link, velocities in rad/s. With `memory`, 3 more for each past step: changes of w1 and
    w2 (rad/s), torque over 5 N·m.

    Action: the torque (1,), N·m, held for 0.02 s, limited to `torque_limit`; with
    actions="levels" the number of one of `levels` torques, evenly spaced, the largest negative
    first.

    Reward: docs/task.md; from 0 a step hanging still to 7 upright at rest. An episode is
    truncated after `episode_seconds`; it terminates only if its numbers blow up.

    Info: "torque" that acted, N·m; "at_goal", whether both links are within 30° of upright;
    "reward_terms", whose sum is the reward.

    Args:
        actions: "continuous" or "levels"
        levels: how many torques there are with actions="levels"
        render_mode: "rgb_array" or None
        width, height: of pictures, pixels
        **settings: as those of trainings, with the same defaults (`upswing.settings()`, those with
            `environment`): agent, whose environment it is; physics ("mujoco" or "closed-form"),
            episode_seconds, random_start_share, start_noise, memory; the plant (mass1, …,
            torque_limit, model); sensor_noise, delay; randomize, …; the reward's weights

    >>> env = gym.make("upswing/DoublePendulum-v0", physics="closed-form", mass2=1.2, delay=0.02)
    >>> obs, info = env.reset(seed=1, options={"state": [3.14, 0, 0, 0]})
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}

    def __init__(
        self,
        *,
        actions: str = "continuous",
        levels: int = 9,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        **settings: Unpack[EnvironmentSettings],
    ) -> None:
        _check_render_mode(render_mode, self.metadata)
        self._size = (int(width), int(height))
        self._core = _Core(1, {"threads": 1, **settings}, actions, levels, False)
        self.observation_space = self._core.observation_space
        self.action_space = self._core.action_space
        self.render_mode = render_mode
        self._closed = False
        self._ended = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Begins an episode.

        Args:
            seed: of this and the episodes that follow; None: they go on as they would
            options: {"state": [q1, q2, w1, w2]} (rad, rad/s) is where it begins

        Returns:
            Observation (D,), float32, and info
        """
        if self._closed:
            raise gym.error.ClosedEnvironmentError("reset: the environment is closed")
        super().reset(seed=None if seed is None else _seed(seed))
        self._core.begin(self._core.seeds_of(seed, self.np_random), options)
        self._ended = False
        return self._core.env.obs[0].copy(), {}

    def step(
        self, action: Any
    ) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Holds a torque for 0.02 s.

        Args:
            action: torque (1,), N·m, or the number of a torque level

        Returns:
            Observation (D,), float32; reward; terminated; truncated; info
        """
        core = self._core
        core.check(self._closed)
        if self._ended:
            raise gym.error.ResetNeeded("step: the episode has ended; expected a call of reset")
        array = core.actions_of(action)
        wanted = () if len(core.levels) > 0 else (1,)
        if array.shape != wanted:
            raise _upswing.InputError(
                f"action: expected shape {wanted}, got {array.shape}")
        core.env.step(array.reshape((1, 1) if wanted else (1,)))
        env = core.env
        terminated, truncated = bool(env.terminated[0]), bool(env.truncated[0])
        self._ended = terminated or truncated
        info = {
            "torque": float(env.torque[0, 0]),
            "at_goal": bool(env.at_goal[0]),
            "reward_terms": dict(zip(core.reward_terms, env.reward_terms[0].tolist())),
        }
        return env.obs[0].copy(), float(env.reward[0]), terminated, truncated, info

    @property
    def state(self) -> npt.NDArray[np.float64]:
        """q1, q2 (rad), w1, w2 (rad/s), whatever the sensors say; (4,)."""
        return self._core.states()[0]

    @property
    def plant(self) -> dict[str, float]:
        """The plant of the running episode, by the settings' names."""
        return self._core.env.plant(0)

    @property
    def torques(self) -> npt.NDArray[np.float64]:
        """The torques that there are to choose from, N·m, (L,); empty with continuous actions."""
        return self._core.levels

    def render(self) -> npt.NDArray[np.uint8] | None:
        """A picture of it as it stands, with the torque that acted last, by MuJoCo's renderer.

        Returns:
            Pixels (height, width, 3), red, green, blue; None without a `render_mode`

        Raises:
            Failure: there is no EGL, which draws without a display (Debian's libegl1 and
                libgl1-mesa-dri)
        """
        if self._closed:
            raise gym.error.ClosedEnvironmentError("render: the environment is closed")
        if self.render_mode is None:
            gym.logger.warn('render: expected render_mode="rgb_array", given to gym.make')
            return None
        return self._core.env.draw(0, *self._size)

    def close(self) -> None:
        """Ends it; closing it once more does nothing."""
        self._closed = True


class DoublePendulumVectorEnv(VectorEnv[npt.NDArray[np.float32], Any, npt.NDArray[Any]]):
    """Many double pendulums (see `DoublePendulumEnv`), stepped together by the C++ code's threads.

    `gym.make_vec("upswing/DoublePendulum-v0", num_envs=1024)` makes it. Letters: N environments, D
    numbers in an observation. While it steps, the interpreter's lock is released.

    Environment i of `reset(seed=s)` has the episodes of a single one with seed s + i.

    Args:
        num_envs: N, 1 to 4096
        actions, levels, **settings: as of `DoublePendulumEnv`; and threads, 0: one for each
            processor, at most 8
        autoreset_mode: AutoresetMode.NEXT_STEP: of an episode that has ended, the next step begins
            another one and ignores the action. AutoresetMode.SAME_STEP: it begins at once; the last
            observation is in infos["final_obs"]. Their values, "NextStep" and "SameStep", will do
        copy: whether what `reset` and `step` return are copies; else they are views, without a copy
            of anything, of memory that the next step overwrites
        render_mode: "rgb_array" or None
        width, height: of pictures, pixels
    """

    metadata: dict[str, Any] = {
        "render_modes": ["rgb_array"],
        "render_fps": 50,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        actions: str = "continuous",
        levels: int = 9,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        **settings: Unpack[EnvironmentSettings],
    ) -> None:
        _check_render_mode(render_mode, self.metadata)
        self._size = (int(width), int(height))
        mode = _autoreset_mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": mode}
        self._same_step = mode == AutoresetMode.SAME_STEP
        self._core = _Core(num_envs, dict(settings), actions, levels, self._same_step)
        self.num_envs = self._core.num_envs
        self.render_mode = render_mode
        self._copy = copy
        self.single_observation_space = self._core.observation_space
        self.single_action_space = self._core.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        env = self._core.env
        self._obs, self._final_obs, self._reward = env.obs, env.final_obs, env.reward
        self._terminated = env.terminated.view(np.bool_)
        self._truncated = env.truncated.view(np.bool_)
        self._at_goal = env.at_goal.view(np.bool_)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Begins an episode of every environment.

        Args:
            seed: s, for s, s + 1, … in turn; or one for each environment; None: they go on as they
                would
            options: {"state": q1, q2, w1, w2 (rad, rad/s)}, (4,) or (N, 4), where they begin;
                {"reset_mask": bools (N,)}, which of them to begin

        Returns:
            Observations (N, D), float32, and an empty dictionary
        """
        if self.closed:
            raise gym.error.ClosedEnvironmentError("reset: the environments are closed")
        super().reset(seed=_seed(seed) if isinstance(seed, (int, np.integer)) else None)
        self._core.begin(self._core.seeds_of(seed, self.np_random), options)
        return (self._obs.copy() if self._copy else self._obs), {}

    def step(
        self, actions: Any
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float64], npt.NDArray[np.bool_],
               npt.NDArray[np.bool_], dict[str, Any]]:
        """Holds a torque in every environment for 0.02 s.

        Args:
            actions: torques (N, 1), N·m, float32 or float64; or torque levels (N,), integers

        Returns:
            Observations (N, D), float32; rewards (N,), float64; terminated and truncated (N,),
            bool; infos: with SAME_STEP, where episodes have ended, "final_obs" (N,), an array (D,)
            or None for each environment, "final_info", and which they are, "_final_obs",
            "_final_info"
        """
        core = self._core
        core.check(self.closed)
        core.env.step(core.actions_of(actions))
        infos: dict[str, Any] = {}
        if self._same_step:
            ended = self._terminated | self._truncated
            if ended.any():
                infos = self._final_infos(ended)
        if not self._copy:
            return self._obs, self._reward, self._terminated, self._truncated, infos
        return (self._obs.copy(), self._reward.copy(), self._terminated.copy(),
                self._truncated.copy(), infos)

    def render(self) -> tuple[npt.NDArray[np.uint8], ...] | None:
        """A picture of each, as of `DoublePendulumEnv.render`: a tuple of N."""
        if self.closed:
            raise gym.error.ClosedEnvironmentError("render: the environments are closed")
        if self.render_mode is None:
            gym.logger.warn('render: expected render_mode="rgb_array", given to gym.make_vec')
            return None
        return tuple(self._core.env.draw(i, *self._size) for i in range(self.num_envs))

    def _final_infos(self, ended: npt.NDArray[np.bool_]) -> dict[str, Any]:
        final = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(ended):
            final[i] = self._final_obs[i].copy()
        torque, at_goal = self.torque[:, 0].copy(), self._at_goal.copy()
        return {
            "final_obs": final, "_final_obs": ended,
            "final_info": {"torque": torque, "_torque": ended.copy(),
                           "at_goal": at_goal, "_at_goal": ended.copy()},
            "_final_info": ended.copy(),
        }

    @property
    def torque(self) -> npt.NDArray[np.float64]:
        """Torques of the last step as they acted, N·m, (N, 1); a view."""
        return self._core.env.torque

    @property
    def at_goal(self) -> npt.NDArray[np.bool_]:
        """Whether both links are within 30° of upright after the last step, (N,); a view."""
        return self._at_goal

    @property
    def reward_terms(self) -> dict[str, npt.NDArray[np.float64]]:
        """The terms of the last step's rewards, (N,) each, which add up to them; views."""
        terms = self._core.env.reward_terms
        return {name: terms[:, k] for k, name in enumerate(self._core.reward_terms)}

    @property
    def states(self) -> npt.NDArray[np.float64]:
        """q1, q2 (rad), w1, w2 (rad/s) of each, whatever the sensors say; (N, 4)."""
        return self._core.states()

    @property
    def plants(self) -> list[dict[str, float]]:
        """The plants of the running episodes, by the settings' names."""
        return [self._core.env.plant(i) for i in range(self.num_envs)]

    @property
    def torques(self) -> npt.NDArray[np.float64]:
        """The torques that there are to choose from, N·m, (L,); empty with continuous actions."""
        return self._core.levels


def _autoreset_mode(mode: str | AutoresetMode) -> AutoresetMode:
    try:
        mode = AutoresetMode(mode)
    except ValueError:
        pass
    if mode not in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP):
        raise _upswing.InputError(
            f"autoreset_mode: expected AutoresetMode.NEXT_STEP or SAME_STEP, got {mode!r}")
    return mode


def _check_render_mode(mode: str | None, metadata: dict[str, Any]) -> None:
    if mode is not None and mode not in metadata["render_modes"]:
        raise _upswing.InputError(
            f"render_mode: expected None or one of {metadata['render_modes']}, got {mode!r}")
