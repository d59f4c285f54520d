"""Evaluations and maps of a policy."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from typing_extensions import Unpack

from . import _upswing
from ._environments import seed_of
from ._foreign import EnvLike, run_episodes
from .policy import Policy, PolicyLike, handle_of, load_policy
from ._settings import PathLike, path_of, texts_of, whole_number
from ._types import MapSettings, TrialSettings


class Evaluation(dict[str, Any]):
    """Results of a policy over many episodes: the figures of `upswing eval --json` by name.

    Examples: "success_rate", "success_interval_95", "swing_up_seconds" (median and quartiles [s]),
    "return", "peak_torque" [N·m], "energy_used" [J].

    Attributes:
        per_episode: columns of `--episodes-csv`, conditions and results of each episode, as arrays
            (episodes,); NaN where an episode lacks a figure
    """

    def __init__(self, figures: dict[str, Any], per_episode: dict[str, npt.NDArray[np.float64]]):
        super().__init__(figures)
        self.per_episode = per_episode

    def __repr__(self) -> str:
        succeed = f"{self['successes']} of " if "successes" in self else ""
        return (f"<upswing.Evaluation {self['policy']}: {succeed}{self['episodes']} episodes"
                f"{' succeed' if succeed else ''}, mean return {self['return']['mean']:.4g}>")


def evaluate(
    policy: PolicyLike,
    *,
    env: EnvLike | None = None,
    max_episode_steps: int | None = None,
    episodes: int = 100,
    seed: int = 0,
    physics: str = "mujoco",
    plant: PathLike | None = None,
    unknown_plant: bool = False,
    threads: int = 0,
    memory: int = 0,
    goal: str | None = None,
    progress: Callable[[float], Any] | None = None,
    **settings: Unpack[TrialSettings],
) -> Evaluation:
    """Evaluates a policy over many episodes, as `upswing eval` does.

    An episode of the double pendulum lasts 20 s and starts hanging, with normal noise of 0.1 (rad,
    rad/s).
    It succeeds if both links are within 30° of upright throughout the last 10 s. The return is the
    undiscounted sum of the reward over the first 10 s, weighted by the control period
    over the usual one (0.02 s, in the plant's natural time).

    Args:
        policy: a `Policy`, the path of a policy file or run folder, the name of a controller, or a
            function from observations (N, D), float32, to torques (N,) or (N, 1) [N·m], such as an
            agent of another library; calls may come from any thread, one at a time
        env: Gymnasium environment in place of the double pendulum: its id, itself, or a function
            that makes it. Only `episodes`, `seed` (episode k has seed + k), `max_episode_steps` and
            `progress` go with it. The figures are "return" and "length" (mean and standard
            deviation), the columns "return", "length" [steps] and "terminated"
        max_episode_steps: largest length of an episode of `env`, as for `train`
        episodes: number of episodes
        seed: seed of start states, noise and random plants
        physics: "mujoco" or "closed-form"
        plant: plant file (TOML with a table [plant]) or shipped plant such as "realaigym", instead
            of the policy's own plant; `settings` change it
        unknown_plant: scale observed energy and height by the training's plant, not the episode's
        threads: number of threads (0: one per processor, at most 8)
        memory: for a function, the number of past control steps in its observations
        goal: pose that a policy for any pose is to reach from hanging: "up-up", "up-down",
            "down-up" or "down-down", link 1 first; None: each episode draws start and goal
        progress: function that gets the finished share (0 to 1) from time to time
        **settings: plant, sensors, motor and random plants, such as mass2=1.2, sensor_noise=0.02,
            encoder_counts=4096, delay=0.02, randomize=0.25; by default the policy's own plant
            without disturbances

    >>> upswing.evaluate("runs/d3qn-seed1", episodes=1000, randomize=0.1)["success_rate"]
    """
    arguments = {"episodes": episodes, "seed": seed, "threads": threads, "physics": physics}
    if goal is not None:
        arguments["goal"] = goal
    if env is not None:
        others = arguments | {"plant": plant, "unknown_plant": unknown_plant, "memory": memory,
                              "goal": goal}
        usual = {"threads": 0, "physics": "mujoco", "plant": None, "unknown_plant": False,
                 "memory": 0, "goal": None}
        wrong = [*settings, *(name for name, value in usual.items() if others[name] != value)]
        if wrong:
            raise _upswing.InputError(f"{wrong[0]}: expected none with env")
        return _evaluate_env(policy, env, max_episode_steps, whole_number("episodes", episodes),
                             seed_of(seed), progress)
    if max_episode_steps is not None:
        raise _upswing.InputError("max_episode_steps: expected env with it, got none")
    figures, table = _upswing.evaluate(
        handle_of(policy, memory), texts_of(dict(settings)), texts_of(arguments),
        path_of("plant", plant), bool(unknown_plant), progress)
    return Evaluation(json.loads(figures), _columns(table))


def _evaluate_env(policy: PolicyLike, env: EnvLike, max_episode_steps: int | None, episodes: int,
                  seed: int, progress: Callable[[float], Any] | None) -> Evaluation:
    if episodes < 1:
        raise _upswing.InputError(f"episodes: expected 1 or more, got {episodes}")
    if isinstance(policy, (str, bytes, os.PathLike)):
        policy = load_policy(policy)
    if not callable(policy):
        raise _upswing.InputError(f"policy: expected a Policy, a path or a function of observations, "
                                  f"got {type(policy).__name__}")
    task, columns = run_episodes(policy, env, episodes, seed, max_episode_steps, progress)
    name = policy.name if isinstance(policy, Policy) else getattr(policy, "__name__", "a function")
    figures: dict[str, Any] = {"policy": name, "task": f"gymnasium/{task}", "episodes": episodes,
                               "seed": seed}
    for column in ("return", "length"):
        values = columns[column]
        figures[column] = {"mean": float(values.mean()),
                           "deviation": float(values.std(ddof=1)) if episodes > 1 else 0.0}
    return Evaluation(figures, columns)


def _columns(table: str) -> dict[str, npt.NDArray[np.float64]]:
    """Columns of a CSV table; NaN for empty cells."""
    rows = list(csv.reader(io.StringIO(table)))
    numbers = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows[1:]])
    return {name: numbers[:, k].copy() for k, name in enumerate(rows[0])}


class Map(dict[str, Any]):
    """A map of a policy: the figures of `upswing map --json` by name, and the cells.

    Attributes:
        x, y: values of the axes, (nx,) and (ny,)
        x_label, y_label: labels of the axes, such as "mass2 (kg)"
        successes: successful episodes per cell, (ny, nx)
        success_rate: share of successful episodes per cell, (ny, nx)
        swing_up_seconds: median swing-up time of successful episodes [s], (ny, nx); NaN without any
    """

    def __init__(self, figures: dict[str, Any], successes: npt.NDArray[np.int64],
                 swing_up_seconds: npt.NDArray[np.float64]):
        super().__init__(figures)
        def label_of(axis: dict[str, Any]) -> str:
            return str(axis["name"]) + (f" ({axis['unit']})" if axis["unit"] else "")

        self.x: npt.NDArray[np.float64] = np.array(self["x"]["values"])
        self.y: npt.NDArray[np.float64] = np.array(self["y"]["values"])
        self.x_label: str = label_of(self["x"])
        self.y_label: str = label_of(self["y"])
        self.successes = successes
        self.success_rate: npt.NDArray[np.float64] = successes / int(self["episodes_per_cell"])
        self.swing_up_seconds = swing_up_seconds

    def __repr__(self) -> str:
        return (f"<upswing.Map of {self['policy']} over {self.x_label} and {self.y_label}: "
                f"{100 * self['mean_success_rate']:.1f}% of all episodes succeed>")


def map(  # pylint: disable=redefined-builtin
    policy: PolicyLike,
    x: str | None = None,
    y: str | None = None,
    *,
    episodes: int | None = None,
    seed: int = 0,
    physics: str | None = None,
    plant: PathLike | None = None,
    unknown_plant: bool = False,
    threads: int = 0,
    memory: int = 0,
    out: PathLike | None = None,
    progress: Callable[[float], Any] | None = None,
    **settings: Unpack[MapSettings],
) -> Map:
    """Maps the success of a policy over two quantities, as `upswing map` does.

    Args:
        policy: policy of the double pendulum, as for `evaluate`
        x, y: axes "NAME=FROM:TO[:CELLS]"; FROM and TO may be percentages relative to the training's
            value. NAME is a parameter of the plant, sensor_noise [rad, rad/s], delay [s],
            sensor_latency [s], encoder_counts, velocity_window [s], velocity_filter [s], or a
            start: q1, q2 [°], w1, w2 [rad/s]. Defaults: mass2 and length2 within ±50%
        episodes: number of episodes per cell (default 10; 1 if the start is given)
        seed: seed of starts and noise
        physics: "closed-form" (default) or "mujoco"
        plant: plant file or shipped plant, as for `evaluate`
        unknown_plant: scale observed energy and height by the training's plant, not the cell's
        threads: number of threads (0: one per processor, at most 8)
        memory: for a function, the number of past control steps in its observations
        out: new folder for map.csv, map.svg and map.png; by default no files are written
        progress: function that gets the finished share (0 to 1) from time to time
        **settings: values of quantities on neither axis, such as gravity=9.7

    >>> result = upswing.map("runs/d3qn-seed1", x="q1=-180deg:180deg:73", y="q2=-180deg:180deg:73")
    """
    arguments: dict[str, Any] = {"seed": seed, "threads": threads}
    if physics is not None:
        arguments["physics"] = physics
    if episodes is not None:
        arguments["episodes"] = episodes
    figures, successes, swing_up_seconds = _upswing.map(
        handle_of(policy, memory), texts_of(dict(settings)), texts_of(arguments), x or "", y or "",
        path_of("plant", plant), bool(unknown_plant), path_of("out", out), progress)
    return Map(json.loads(figures), successes, swing_up_seconds)
