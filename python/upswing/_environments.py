"""Common part of the single and the vector environment: settings, spaces, seeds, starts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from . import _upswing
from ._mujoco import stop_clock
from ._settings import path_of, text_of, texts_of, whole_number


class LoadedPlant:
    """The settings of a plant file as it was read. A copy of an environment has it in place of the
    file, which may have changed."""

    def __init__(self, path: Any) -> None:
        """`path`: plant file or name of a shipped plant. Raises InputError."""
        self.name = path_of("plant", path)
        self.settings: list[tuple[str, str, str]] = _upswing.load_plant(self.name)

    def __repr__(self) -> str:
        return f"<plant {self.name}>"


def with_loaded_plant(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of environments, with the plant file loaded if there is one. Raises InputError."""
    plant = settings.get("plant")
    if plant is None or isinstance(plant, LoadedPlant):
        return dict(settings)
    return {**settings, "plant": LoadedPlant(plant)}


class Core:
    """Settings, spaces and episodes of one or more environments."""

    def __init__(self, num_envs: int, settings: dict[str, Any], actions: str,
                 levels: int | None, same_step: bool) -> None:
        if "envs" in settings:
            raise _upswing.InputError("envs: expected none; num_envs is the number of environments")
        if levels is not None and actions == "continuous":
            raise _upswing.InputError("levels: expected actions=\"levels\" with it")
        settings = with_loaded_plant(settings)
        plant: LoadedPlant | None = settings.pop("plant", None)
        self.env = _upswing.Environments(text_of(num_envs), plant.settings if plant else [],
                                         texts_of(settings), text_of(actions),
                                         text_of(9 if levels is None else levels), same_step)
        spec = self.env.spec()
        self.num_envs: int = spec["num_envs"]
        self.step_seconds: float = spec["step_seconds"]
        self.reward_terms: list[str] = spec["reward_terms"]
        self.goals: list[str] = spec["goals"]
        self.levels = np.array(spec["levels"])
        self.settings: str = spec["settings"]
        self.threads: int = spec["threads"]
        self.is_reset = False
        # cos, sin, w, cos, sin, w, energy, height; then the memory, without bounds.
        high = np.full(spec["obs_size"], np.inf, np.float32)
        high[[0, 1, 3, 4, 7]] = 1
        self.observation_space = spaces.Box(-high, high, dtype=np.float32)
        limit = np.array(spec["action_limit"], np.float32)
        self.action_space: spaces.Box | spaces.Discrete = (
            spaces.Discrete(len(self.levels)) if len(self.levels) > 0
            else spaces.Box(-limit, limit, dtype=np.float32))

    def rates(self) -> dict[str, float]:
        """Entries of an environment's metadata: control period [s] and pictures per second."""
        return {"control_period": self.step_seconds, "render_fps": round(1 / self.step_seconds)}

    def actions_of(self, actions: Any) -> npt.NDArray[Any]:
        """Actions as an array for the C++ code: float32 or float64 torques, int32 or int64 levels."""
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
                    f"action: expected torques [N·m] as floating-point numbers, got {array.dtype}; "
                    "torque levels need actions=\"levels\"")
            array = array.astype(np.float32)
        return np.ascontiguousarray(array) if array.ndim > 0 else array

    def check(self, closed: bool) -> None:
        """Raises an error unless a step is possible."""
        if closed:
            raise gym.error.ClosedEnvironmentError("step: the environment is closed")
        if not self.is_reset:
            raise gym.error.ResetNeeded("step: expected a call of reset first")

    def seeds_of(self, seed: Any, generator: np.random.Generator) -> list[int | None]:
        """A seed for each environment; None continues its random stream."""
        n = self.num_envs
        if seed is None:
            if self.is_reset:
                return [None] * n
            seed = int(generator.integers(2**53))
        if isinstance(seed, (Sequence, np.ndarray)) and not isinstance(seed, str):
            if len(seed) != n:
                raise _upswing.InputError(f"seed: expected {n} seeds, got {len(seed)}")
            fresh = iter([] if self.is_reset else generator.integers(2**53, size=n).tolist())
            return [next(fresh, None) if one is None else seed_of(one) for one in seed]
        first = seed_of(seed)
        return [(first + i) % 2**64 for i in range(n)]

    def begin(self, seeds: list[int | None], options: dict[str, Any] | None) -> None:
        """Starts episodes."""
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        states = options.pop("state", None)
        goals = options.pop("goal", None)
        if options:
            raise _upswing.InputError("options: expected state, goal or reset_mask, "
                                      f"got {', '.join(map(repr, options))}")
        n = self.num_envs
        if mask is None:
            mask = np.ones(n, np.bool_)
        else:
            mask = np.asarray(mask)
            if mask.shape != (n,) or mask.dtype != np.bool_ or not mask.any():
                raise _upswing.InputError(
                    f"reset_mask: expected {n} bools with at least one True, got {mask.dtype} "
                    f"of shape {mask.shape}")
            if not self.is_reset and not mask.all():
                raise gym.error.ResetNeeded("reset_mask: expected a reset of all environments first")
        if states is not None:
            size = 4
            try:
                states = np.asarray(states, np.float64)
                if states.shape not in ((size,), (n, size)):
                    raise ValueError
                states = np.broadcast_to(states, (n, size))
            except (ValueError, TypeError):
                raise _upswing.InputError(
                    f"state: expected q1, q2, w1, w2 (rad, rad/s) of shape "
                    f"({size},) or ({n}, {size}), got shape {np.shape(states)}") from None
            if not np.isfinite(states[mask]).all():
                raise _upswing.InputError("state: expected finite numbers, got others")
        chosen = np.flatnonzero(mask).tolist()
        names = [None] * n if goals is None else self.goals_of(goals, chosen)
        self.env.reset(seeds, mask.astype(np.uint8).tolist())
        if states is not None or goals is not None:
            for i in chosen:
                self.env.set_start(i, None if states is None else states[i].tolist(), names[i])
        self.is_reset = True

    def goals_of(self, goals: Any, chosen: list[int]) -> list[Any]:
        """A goal for each environment. A chosen environment needs the name of a pose."""
        if not self.goals:
            raise _upswing.InputError("goal: expected an environment with any_pose=True")
        names = goals.tolist() if isinstance(goals, np.ndarray) else goals
        names = [names] * self.num_envs if isinstance(names, str) else names
        expected = f"goal: expected {', '.join(self.goals)}"
        if not isinstance(names, (list, tuple)) or len(names) != self.num_envs:
            raise _upswing.InputError(f"{expected}, or a list of {self.num_envs} of them")
        for i in chosen:
            if not isinstance(names[i], str) or names[i] not in self.goals:
                raise _upswing.InputError(f"{expected}, got {names[i]!r}")
        return list(names)

    def states(self) -> npt.NDArray[np.float64]:
        return np.array([self.env.get_state(i) for i in range(self.num_envs)])


def seed_of(seed: Any) -> int:
    """A seed from 0 to 2^64 - 1. Raises InputError."""
    number = whole_number("seed", seed)
    if not 0 <= number < 2**64:
        raise _upswing.InputError(f"seed: expected an integer from 0 to 2^64 - 1, got {number}")
    return number


def picture_size(width: int, height: int) -> tuple[int, int]:
    """Width and height of pictures [pixels]. Raises InputError."""
    size = whole_number("width", width), whole_number("height", height)
    for name, value in zip(("width", "height"), size):
        if not 16 <= value <= 8192:
            raise _upswing.InputError(f"{name}: expected 16 to 8192 pixels, got {value}")
    return size


class Pictures:
    """Draws environments with MuJoCo: as pixels, or in a window. `_view` is imported by the first
    picture, because training needs none."""

    def __init__(self, core: Core, width: int, height: int) -> None:
        self._core, self._size = core, picture_size(width, height)
        self._scenes: dict[int, Any] = {}
        self._canvas: Any = None
        self._viewer: Any = None

    def pixels(self, i: int) -> npt.NDArray[np.uint8]:
        """Pixels (height, width, 3) of environment i. Raises Failure."""
        scene = self._scene(i)
        if self._canvas is None:
            self._canvas = self._drawing(lambda view: view.Canvas(*self._size))
        pixels: npt.NDArray[np.uint8] = self._canvas.draw(scene)
        return pixels

    def show(self) -> None:
        """Shows environment 0 in a window, which opens when it is needed, in real time. Raises
        Failure."""
        scene = self._scene(0)
        if self._viewer is None or self._viewer.scene is not scene:
            self._close_viewer()
            self._viewer = self._drawing(lambda view: view.Viewer(scene))
        self._viewer.draw()
        self._viewer.wait(self._core.step_seconds)

    def close(self) -> None:
        if self._canvas is not None:
            self._canvas.close()
        self._close_viewer()
        self._canvas = None

    def _close_viewer(self) -> None:
        if self._viewer is not None:
            self._viewer.close()
        self._viewer = None

    def _scene(self, i: int) -> Any:
        """Environment i's scene in its present state, another one for each plant."""
        plant, env = self._core.env.plant(i), self._core.env
        scene = self._scenes.get(i)
        if scene is None or scene.plants != [plant]:
            width, height = self._size
            scene = self._drawing(lambda view: view.Scene([plant], width / height))
            self._scenes[i] = scene
        scene.goals = [env.goal(i)]
        scene.show(env.get_state(i), env.torque[i])
        return scene

    @staticmethod
    def _drawing(make: Callable[[Any], Any]) -> Any:
        """What `make` returns for the module that draws. Raises Failure if something is missing."""
        try:
            from . import _view  # pylint: disable=import-outside-toplevel
        except ImportError as error:
            raise _upswing.Failure(f"render: {error}") from error
        stop_clock()
        try:
            return make(_view)
        except _view.CannotDraw as error:
            raise _upswing.Failure(f"render: {error}") from error


def check_render_mode(mode: str | None, metadata: dict[str, Any]) -> None:
    """Raises InputError unless the render mode exists."""
    if mode is not None and mode not in metadata["render_modes"]:
        raise _upswing.InputError(
            f"render_mode: expected None or one of {metadata['render_modes']}, got {mode!r}")
