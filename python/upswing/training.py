"""Training of agents."""

from __future__ import annotations

import dataclasses
import os
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any, TextIO

import numpy as np
from typing_extensions import Unpack

from . import _upswing
from .policy import Policy
from ._settings import text_of, texts_of
from ._types import TrainingSettings

Row = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Training:
    """Result of a training.

    Attributes:
        best: policy with the best evaluation, as in policy.safetensors; None without an evaluation
        last: policy at the end of the training
        solved: whether two evaluations in a row passed
        finished: whether the training ended by itself: solved, or at its last step
        solved_step, solved_seconds: steps and training time until solved; None if not solved
        steps, episodes, updates: number of control steps, episodes and updates
        seconds: training time without evaluations [s]
        best_step, best_success_rate, best_return: results of the evaluation of `best`
        agent, seed, threads: agent, seed and number of threads
        path: run folder; None if none was written
        config: all settings as TOML, for a file that `train(config=...)` reads
        evaluations, metrics: rows of evals.csv and metrics.csv
    """

    best: Policy | None
    last: Policy
    solved: bool
    finished: bool
    solved_step: int | None
    solved_seconds: float | None
    steps: int
    episodes: int
    updates: int
    seconds: float
    best_step: int | None
    best_success_rate: float | None
    best_return: float | None
    agent: str
    seed: int
    threads: int
    path: str | None
    config: str = dataclasses.field(repr=False)
    evaluations: list[Row] = dataclasses.field(repr=False)
    metrics: list[Row] = dataclasses.field(repr=False)


def train(
    agent: str | None = None,
    *,
    seed: int | None = None,
    out: str | os.PathLike[str] | None = None,
    config: str | os.PathLike[str] | None = None,
    resume: str | os.PathLike[str] | None = None,
    progress: bool | None = None,
    on_episode: Callable[[Row], Any] | None = None,
    on_metrics: Callable[[Row], Any] | None = None,
    on_evaluation: Callable[[Row], Any] | None = None,
    on_best: Callable[[Policy], Any] | None = None,
    **settings: Unpack[TrainingSettings],
) -> Training:
    """Trains an agent until it solves the task, bit for bit as `upswing train` does.

    The training writes no files without `out`. Ctrl-C raises KeyboardInterrupt after the current
    step; a run folder then has a checkpoint for `resume`.

    Args:
        agent: named agent, see `upswing.agents` (default "d3qn")
        seed: seed of all random numbers
        out: new run folder, as the program writes it
        config: TOML file of settings; keyword arguments override it
        resume: run folder to resume; only `steps`, `threads`, `checkpoint_every` and
            `stop_when_solved` may change
        progress: show progress on standard error (default: in a terminal)
        on_episode, on_metrics, on_evaluation: functions that get a row of episodes.csv, metrics.csv
            or evals.csv as a dictionary; the training stops if one returns False
        on_best: function that gets the best policy so far, at its evaluation; the training stops if
            it returns False
        **settings: any setting of the agent, see `upswing.settings(agent)`; also plant, a plant file
            (TOML with a table [plant]) or a shipped plant, between `config` and these settings

    Returns:
        Training: result of the training

    Raises:
        InputError: a setting is out of range, or settings contradict each other
        Failure: a number is not finite, or a file cannot be written

    >>> training = upswing.train(agent="fast", seed=1, hidden=[64, 64], mass2=1.1)
    >>> training.best.save("policy.safetensors")
    """
    named: dict[str, Any] = {"agent": agent, "seed": seed}
    if resume is not None and (out is not None or config is not None):
        raise _upswing.InputError(
            "resume: expected neither out nor config with it: the run has its own settings and "
            "folder")
    texts = texts_of({name: value for name, value in named.items() if value is not None}
                     | dict(settings))
    for name, path in (("out", out), ("config", config), ("resume", resume)):
        if path is not None and not text_of(path):
            raise _upswing.InputError(f"{name}: expected a path, got an empty text")
    for name, function in (("on_episode", on_episode), ("on_metrics", on_metrics),
                           ("on_evaluation", on_evaluation), ("on_best", on_best)):
        if function is not None and not callable(function):
            raise _upswing.InputError(f"{name}: expected a function, got {function!r}")
    line = _ProgressLine(sys.stderr) if progress or progress is None else None
    if line is not None and progress is None and not line.terminal:
        line = None
    rows: dict[str, list[Row]] = {"evaluation": [], "metrics": []}
    listeners = {"episode": on_episode, "metrics": on_metrics, "evaluation": on_evaluation}

    def tick(events: list[tuple[str, Any]], state: Row) -> bool:
        """Handles the events of a step; returns whether to continue."""
        wanted = True
        for kind, what in events:
            if kind == "best":
                listener: Callable[[Any], Any] | None = on_best
                what = Policy(what)
            else:
                listener = listeners[kind]
            if kind in rows:
                rows[kind].append(what)
            if listener is not None:
                answer = listener(what)
                if isinstance(answer, (bool, np.bool_)) and not answer:
                    wanted = False
        if line is not None:
            line.show(events, state)
        return wanted

    def warn(text: str) -> None:
        warnings.warn(text, stacklevel=3)

    try:
        result = _upswing.train(texts, _path(config), _path(out), _path(resume), tick, warn)
    finally:
        if line is not None:
            line.clear()
    best, last = result.pop("best"), result.pop("last")
    return Training(best=Policy(best) if best is not None else None, last=Policy(last),
                    evaluations=rows["evaluation"], metrics=rows["metrics"], **result)


def _path(path: str | os.PathLike[str] | None) -> str:
    return "" if path is None else os.fspath(path)


class _ProgressLine:
    """A line with the progress of a training, and a permanent line per evaluation."""

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self.terminal = file.isatty()
        self._last = 0.0
        self._shown = False

    def show(self, events: list[tuple[str, Any]], state: Row) -> None:
        for kind, what in events:
            if kind == "evaluation":
                self.clear()
                print(f"{what['step']:>12,} steps {state['seconds']:>10.1f} s  return "
                      f"{what['mean_return']:>6.0f}  success {100 * what['success_rate']:>4.0f}%",
                      file=self._file, flush=True)
        now = time.monotonic()
        if not self.terminal or now - self._last < 0.2:
            return
        self._last = now
        rate = state["steps"] / state["seconds"] if state["seconds"] > 0 else 0
        print(f"\r\033[K{state['steps']:>12,} of {state['total_steps']:,} steps, {rate:,.0f}/s",
              end="", file=self._file, flush=True)
        self._shown = True

    def clear(self) -> None:
        if self._shown:
            print("\r\033[K", end="", file=self._file, flush=True)
        self._shown = False
