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
from .policy import PolicyLike, handle_of
from ._settings import texts_of
from ._types import MapSettings, TrialSettings


class Evaluation(dict[str, Any]):
    """How a policy did over many episodes: the figures of `upswing eval --json`, by their names.

    Such as "success_rate", "success_interval_95", "swing_up_seconds" (median and quartiles, s),
    "return", "peak_torque" (N·m), "energy_used" (J).

    Attributes:
        per_episode: what each episode was and how it went: the columns of `--episodes-csv`, each
            an array (episodes,); NaN where an episode has no such figure
    """

    def __init__(self, figures: dict[str, Any], per_episode: dict[str, npt.NDArray[np.float64]]):
        super().__init__(figures)
        self.per_episode = per_episode

    def __repr__(self) -> str:
        return (f"<upswing.Evaluation {self['policy']}: {self['successes']} of "
                f"{self['episodes']} episodes succeed, mean return "
                f"{self['return']['mean']:.4g}>")


def evaluate(
    policy: PolicyLike,
    *,
    episodes: int = 100,
    seed: int = 0,
    physics: str = "mujoco",
    model: str | os.PathLike[str] | None = None,
    unknown_plant: bool = False,
    threads: int = 0,
    memory: int = 0,
    progress: Callable[[float], Any] | None = None,
    **settings: Unpack[TrialSettings],
) -> Evaluation:
    """Evaluates a policy over many episodes, as `upswing eval` does.

    An episode of the double pendulum lasts 20 s from hanging with normal noise of 0.1 (rad, rad/s).
    It succeeds if both links are within 30° of upright for the whole of the last 10 s. The return is
    the undiscounted sum of the reward over the first 10 s.

    Args:
        policy: a `Policy`, the path of a file or a run folder, a controller's name, or a function:
            observations (N, D), float32 → torques (N,) or (N, 1), N·m, such as that of another
            library's agent; it may be called in any thread, one call at a time
        episodes: how many
        seed: of start states, noise and random plants
        physics: "mujoco" or "closed-form"
        model: MJCF file to use instead of the policy's model
        unknown_plant: scale the observed energy and height by the training's plant
        threads: to use; 0: one for each processor, at most 8
        memory: of a function: past control steps that its observations remember
        progress: called now and then with the share that is done, 0 to 1
        **settings: plant, sensors, motor and what is random, such as mass2=1.2, sensor_noise=0.02,
            encoder_counts=4096, delay=0.02, randomize=0.25; by default the policy's own plant,
            nothing else

    >>> upswing.evaluate("runs/d3qn-seed1", episodes=1000, randomize=0.1)["success_rate"]
    """
    arguments = {"episodes": episodes, "seed": seed, "threads": threads, "physics": physics}
    figures, table = _upswing.evaluate(
        handle_of(policy, memory), texts_of(dict(settings)), texts_of(arguments),
        "" if model is None else os.fspath(model), bool(unknown_plant), progress)
    return Evaluation(json.loads(figures), _columns(table))


def _columns(table: str) -> dict[str, npt.NDArray[np.float64]]:
    """The columns of a table; NaN for empty cells."""
    rows = list(csv.reader(io.StringIO(table)))
    numbers = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows[1:]])
    return {name: numbers[:, k].copy() for k, name in enumerate(rows[0])}


class Map(dict[str, Any]):
    """A map of a policy: what `upswing map --json` says, by its names, and its cells.

    Attributes:
        x, y: the axes' values, (nx,) and (ny,)
        x_label, y_label: such as "mass2 (kg)"
        successes: successful episodes in each cell, (ny, nx)
        success_rate: the same as a share, (ny, nx)
        swing_up_seconds: their median swing-up time, s, (ny, nx); NaN where none succeeds
    """

    def __init__(self, figures: dict[str, Any], successes: npt.NDArray[np.int64],
                 swing_up_seconds: npt.NDArray[np.float64]):
        super().__init__(figures)
        self.x, self.y = (np.array(self[axis]["values"]) for axis in "xy")
        self.x_label, self.y_label = (
            self[axis]["name"] + (f" ({self[axis]['unit']})" if self[axis]["unit"] else "")
            for axis in "xy")
        self.successes = successes
        self.success_rate = successes / self["episodes_per_cell"]
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
    physics: str = "closed-form",
    check: float = 0.02,
    unknown_plant: bool = False,
    threads: int = 0,
    memory: int = 0,
    out: str | os.PathLike[str] | None = None,
    progress: Callable[[float], Any] | None = None,
    **settings: Unpack[MapSettings],
) -> Map:
    """Maps how a policy does on other plants or from other starts, as `upswing map` does.

    Args:
        policy: as `evaluate` takes it, of the double pendulum
        x, y: axes, "NAME=FROM:TO[:CELLS]", where both ends may be percentages on top of the
            training's value; names are those of the plant, sensor_noise (rad, rad/s), delay (s),
            sensor_latency (s), encoder_counts, velocity_window (s), velocity_filter (s),
            and the start: q1, q2 (degrees), w1, w2 (rad/s); by default the mass and the length
            of the second link, within 50%
        episodes: in a cell; by default 10, or 1 where the start is given
        seed: of starts and noise
        physics: "closed-form" or "mujoco"
        check: share of the cells to repeat in MuJoCo
        unknown_plant: scale the observed energy and height by the training's plant
        threads: to use; 0: one for each processor, at most 8
        memory: of a function: past control steps that its observations remember
        out: new folder for map.csv, map.svg and map.png; by default nothing is written
        progress: called now and then with the share that is done, 0 to 1
        **settings: what is on neither axis, such as gravity=9.7

    >>> result = upswing.map("runs/d3qn-seed1", x="q1=-180:180:73", y="q2=-180:180:73")
    """
    arguments = {"seed": seed, "threads": threads, "physics": physics, "check": check}
    if episodes is not None:
        arguments["episodes"] = episodes
    figures, successes, swing_up_seconds = _upswing.map(
        handle_of(policy, memory), texts_of(dict(settings)), texts_of(arguments), x or "", y or "",
        bool(unknown_plant), "" if out is None else os.fspath(out), progress)
    return Map(json.loads(figures), successes, swing_up_seconds)
