"""Gymnasium environments of the double pendulum, computed by the C++ code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.utils import EzPickle
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from typing_extensions import Unpack

from . import _upswing
from ._environments import (Core, Pictures, check_render_mode, seed_of,
                            with_loaded_plant)
from ._settings import settings as settings_of, whole_number
from ._types import EnvironmentSettings


class DoublePendulumEnv(gym.Env[npt.NDArray[np.float32], Any], EzPickle):
    """A double pendulum with one motor, to swing up and balance.

    Create it by `gym.make("upswing/DoublePendulum-v0")`. docs/reference/task.md has the formulas.

    Observation (8,), float32: cos q1, sin q1, w1/10, cos q2, sin q2, w2/20, energy (0 hanging at
    rest, 1 upright at rest), height of the tip (-1 to 1). Angles are in rad, 0 hanging, q2 relative
    to link 1; velocities are in rad/s. `memory` adds 3 numbers per past step: changes of w1 and w2
    [rad/s] and the torque over 5 N·m. `any_pose` adds, before them, the goal: for each link 1 if it is
    to point up and -1 if down.

    Action: torque (1,) [N·m], held for `control_period` and limited to `torque_limit`. With actions="levels":
    index of one of `levels` evenly spaced torques, from the largest negative one upwards.

    Reward: per step 0 hanging at rest to 7 upright at rest. An episode is truncated after
    `episode_seconds`; it terminates only if the simulation diverges.

    Info: "torque", the applied torque [N·m]; "at_goal", whether both links are within 30° of
    upright, or of the goal; "reward_terms", whose sum is the reward.

    Args:
        actions: "continuous" or "levels"
        levels: number of torques with actions="levels" (default 9)
        render_mode: "rgb_array" for pictures, "human" for a window in real time, or None
        width, height: size of pictures [pixels]
        **settings: settings of the environment with the defaults of a training, the ones with
            `environment` in `upswing.settings()`: agent, which sets the defaults; physics ("mujoco"
            or "closed-form"), episode_seconds, random_start_share, random_start_drive,
            start_noise, memory, any_pose; the plant
            (mass1, …, torque_limit, actuated_joint, rotor_inertia, gear_ratio, coulomb1, coulomb2,
            center1, center2, inertia1, inertia2, armature, armature1); plant, a plant file (TOML
            with a table [plant]) or a shipped plant such as "realaigym", which these change;
            sensor_noise, delay, encoder_counts, velocity_window, velocity_filter, sensor_latency,
            late_share, late; randomize, …; the reward weights

    >>> env = gym.make("upswing/DoublePendulum-v0", physics="closed-form", mass2=1.2, delay=0.02)
    >>> obs, info = env.reset(seed=1, options={"state": [3.14, 0, 0, 0]})
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 50}

    def __init__(
        self,
        *,
        actions: str = "continuous",
        levels: int | None = None,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        **settings: Unpack[EnvironmentSettings],
    ) -> None:
        settings = cast(EnvironmentSettings, with_loaded_plant(settings))
        EzPickle.__init__(self, actions=actions, levels=levels, render_mode=render_mode,
                          width=width, height=height, **settings)
        check_render_mode(render_mode, self.metadata)
        if "threads" in settings:
            raise _upswing.InputError("threads: expected several environments (gym.make_vec)")
        self._core = Core(1, {"threads": 1, **settings}, actions, levels, False)
        self.metadata = {**self.metadata, **self._core.rates()}
        self._pictures = Pictures(self._core, width, height)
        self.observation_space: gym.Space[npt.NDArray[np.float32]] = self._core.observation_space
        self.action_space: gym.Space[Any] = self._core.action_space
        self.render_mode = render_mode
        self._closed = False
        self._ended = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Starts an episode.

        Args:
            seed: seed of this and the following episodes; None continues the random stream
            options: {"state": [q1, q2, w1, w2]} [rad, rad/s] sets the start state; with any_pose,
                {"goal": "up-down"} sets the goal of this episode, link 1 first

        Returns:
            Observation (D,), float32, and info
        """
        if self._closed:
            raise gym.error.ClosedEnvironmentError("reset: the environment is closed")
        if options and "reset_mask" in options:
            raise _upswing.InputError("options: expected state or goal, got 'reset_mask'")
        super().reset(seed=None if seed is None else seed_of(seed))
        self._core.begin(self._core.seeds_of(seed, self.np_random), options)
        self._ended = False
        if self.render_mode == "human":
            self._pictures.show()
        return self._core.env.obs[0].copy(), {}

    def step(
        self, action: Any
    ) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Holds a torque for a control period, metadata["control_period"] [s].

        Args:
            action: torque (1,) [N·m] or index of a torque level

        Returns:
            Observation (D,), float32; reward; terminated; truncated; info
        """
        core = self._core
        core.check(self._closed)
        if self._ended:
            raise gym.error.ResetNeeded("step: expected a call of reset, because the episode has ended")
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
        if self.render_mode == "human":
            self._pictures.show()
        return env.obs[0].copy(), float(env.reward[0]), terminated, truncated, info

    @property
    def state(self) -> npt.NDArray[np.float64]:
        """True state q1, q2 [rad], w1, w2 [rad/s], without sensor errors; (4,)."""
        state: npt.NDArray[np.float64] = self._core.states()[0]
        return state

    @property
    def plant(self) -> dict[str, float]:
        """Plant of the current episode: value by setting."""
        return self._core.env.plant(0)

    @property
    def torques(self) -> npt.NDArray[np.float64]:
        """Torque levels [N·m], (L,); empty with continuous actions."""
        return self._core.levels

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Draws the current state and the last torque with MuJoCo.

        Returns:
            Pixels (height, width, 3) in red, green, blue with render_mode="rgb_array"; None with
            "human", where `reset` and `step` draw, and without a `render_mode`

        Raises:
            Failure: something to draw with is missing; the message says what to install
        """
        if self._closed:
            raise gym.error.ClosedEnvironmentError("render: the environment is closed")
        if self.render_mode is None:
            gym.logger.warn('render: expected a render_mode in gym.make, got None')
            return None
        return self._pictures.pixels(0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Closes the environment; a second call does nothing."""
        self._closed = True
        self._pictures.close()


class DoublePendulumVectorEnv(VectorEnv[npt.NDArray[np.float32], Any, npt.NDArray[Any]], EzPickle):
    """Many double pendulums (see `DoublePendulumEnv`), stepped together by threads in C++.

    Create it by `gym.make_vec("upswing/DoublePendulum-v0", num_envs=1024)`. N is the number of
    environments, D the size of an observation. A step releases the interpreter's lock.

    After `reset(seed=s)`, environment i has the episodes of a single environment with seed s + i.

    Args:
        num_envs: number N of environments (1 to 4096)
        actions, levels, settings: as in `DoublePendulumEnv`; also threads, the number of threads
            (0: one per processor, at most 8)
        autoreset_mode: AutoresetMode.NEXT_STEP ("NextStep"): the step after the end of an episode
            starts the next one and ignores the action. AutoresetMode.SAME_STEP ("SameStep"): the
            next episode starts at once, and infos["final_obs"] has the last observation
        copy: return copies from `reset` and `step`; False returns views of memory that the next
            step overwrites
        render_mode: "rgb_array" or None
        width, height: size of pictures [pixels]
        max_episode_steps: largest length of an episode [control steps]; None: episode_seconds
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
        levels: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        max_episode_steps: int | None = None,
        **settings: Unpack[EnvironmentSettings],
    ) -> None:
        if max_episode_steps is not None:
            usual = settings_of(settings.get("agent", "d3qn"))["episode_seconds"].default
            period = Core(1, dict(settings), actions, levels, False).step_seconds
            settings["episode_seconds"] = min(
                settings.get("episode_seconds", usual),
                round(period * whole_number("max_episode_steps", max_episode_steps), 12))
        settings = cast(EnvironmentSettings, with_loaded_plant(settings))
        EzPickle.__init__(self, num_envs, actions=actions, levels=levels,
                          autoreset_mode=autoreset_mode, copy=copy, render_mode=render_mode,
                          width=width, height=height, **settings)
        check_render_mode(render_mode, self.metadata)
        mode = _autoreset_mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": mode}
        self._same_step = mode == AutoresetMode.SAME_STEP
        # Settings of a single environment like these, with the plant as it was read.
        self.single_settings: dict[str, Any] = {
            "actions": actions, "levels": levels,
            **{name: value for name, value in settings.items() if name != "threads"}}
        self._core = Core(num_envs, dict(settings), actions, levels, self._same_step)
        self.metadata = {**self.metadata, **self._core.rates()}
        self._pictures = Pictures(self._core, width, height)
        self.num_envs: int = self._core.num_envs
        self.render_mode = render_mode
        self._copy = copy
        self.single_observation_space: gym.Space[Any] = self._core.observation_space
        self.single_action_space: gym.Space[Any] = self._core.action_space
        self.observation_space: gym.Space[Any] = batch_space(self.single_observation_space,
                                                             self.num_envs)
        self.action_space: gym.Space[Any] = batch_space(self.single_action_space, self.num_envs)
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
        """Starts an episode in every environment.

        Args:
            seed: seed s for the seeds s, s + 1, …, or one seed per environment; None continues the
                random streams
            options: {"state": q1, q2, w1, w2 [rad, rad/s]}, (4,) or (N, 4), sets the start states;
                with any_pose, {"goal": a pose such as "up-down", or N poses} sets the goals of
                these episodes;
                {"reset_mask": bools (N,)} selects the environments to reset

        Returns:
            Observations (N, D), float32, and an empty dictionary
        """
        if self.closed:
            raise gym.error.ClosedEnvironmentError("reset: the environments are closed")
        super().reset(seed=seed_of(seed) if isinstance(seed, (int, np.integer)) else None)
        self._core.begin(self._core.seeds_of(seed, self.np_random), options)
        return (self._obs.copy() if self._copy else self._obs), {}

    def step(
        self, actions: Any
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float64], npt.NDArray[np.bool_],
               npt.NDArray[np.bool_], dict[str, Any]]:
        """Holds a torque in every environment for a control period.

        Args:
            actions: torques (N, 1) [N·m], float32 or float64, or indices of torque levels (N,)

        Returns:
            Observations (N, D), float32; rewards (N,), float64; terminated and truncated (N,),
            bool; infos. With SAME_STEP, infos has "final_obs" (N,), an array (D,) for each ended
            episode and None for the others, "final_info", and the masks "_final_obs" and
            "_final_info" of ended episodes
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
        """Pictures of all N environments, as from `DoublePendulumEnv.render`."""
        if self.closed:
            raise gym.error.ClosedEnvironmentError("render: the environments are closed")
        if self.render_mode is None:
            gym.logger.warn('render: expected render_mode="rgb_array" in gym.make_vec, got None')
            return None
        return tuple(self._pictures.pixels(i) for i in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        self._pictures.close()

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
        """Applied torques of the last step [N·m], (N, 1); a view."""
        return self._core.env.torque

    @property
    def at_goal(self) -> npt.NDArray[np.bool_]:
        """Whether both links are within 30° of upright after the last step, (N,); a view."""
        return self._at_goal

    @property
    def reward_terms(self) -> dict[str, npt.NDArray[np.float64]]:
        """Terms of the last step's rewards, (N,) each; their sum is the reward; views."""
        terms = self._core.env.reward_terms
        return {name: terms[:, k] for k, name in enumerate(self._core.reward_terms)}

    @property
    def states(self) -> npt.NDArray[np.float64]:
        """True states q1, q2 [rad], w1, w2 [rad/s], without sensor errors; (N, 4)."""
        return self._core.states()

    @property
    def plants(self) -> list[dict[str, float]]:
        """Plants of the current episodes: values by setting."""
        return [self._core.env.plant(i) for i in range(self.num_envs)]

    @property
    def torques(self) -> npt.NDArray[np.float64]:
        """Torque levels [N·m], (L,); empty with continuous actions."""
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
