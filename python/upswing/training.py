"""Trainings."""

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
    """What is left of a training.

    Attributes:
        best: the policy with the best evaluation, as the program's policy.safetensors; None if
            there was no evaluation
        last: the policy as it stood at the end
        solved: whether two evaluations in a row were passed
        finished: whether it ended by itself: solved, or at its last step
        solved_step, solved_seconds: steps and training time until then; None if it is not solved
        steps, episodes, updates: control steps, episodes and gradient steps
        seconds: time of training, evaluations excluded, s
        best_step, best_success_rate, best_return: of the evaluation of `best`
        agent, seed, threads: what trained
        path: its run folder; None if it wrote none
        config: all settings as TOML; in a file, `train(config=...)` takes them
        evaluations, metrics: rows of evals.csv and metrics.csv (docs/run-folder.md)
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
    """Trains an agent until it has solved the task, as `upswing train` does, bit for bit.

    It writes nothing unless `out` names a folder. Ctrl-C raises KeyboardInterrupt after the step
    that runs; a run folder then has a checkpoint, from which `resume` goes on.

    Args:
        agent: a named agent (see `upswing.agents`), by default "d3qn"
        seed: of every random stream
        out: run folder to make, as the program's (docs/run-folder.md)
        config: TOML file of settings; keyword arguments override it
        resume: run folder to go on with; `steps`, `threads`, `checkpoint_every` and
            `stop_when_solved` may be given again
        progress: whether a line on standard error says how far it is; by default in a terminal
        on_episode, on_metrics, on_evaluation: called with a row of episodes.csv, metrics.csv and
            evals.csv (docs/run-folder.md has the units) as a dictionary; where one returns False,
            the training stops
        on_best: called with the best policy so far, at the evaluation that says so; the same holds
        **settings: any setting of the agent, see `upswing.settings(agent)`

    Returns:
        Training: what is left of it

    Raises:
        InputError: a setting is out of its range, or they contradict each other
        Failure: a number is not finite, or a file cannot be written

    >>> training = upswing.train(agent="fast", seed=1, hidden=[64, 64], mass2=1.1)
    >>> training.best.save("policy.safetensors")
    """
    named: dict[str, Any] = {"agent": agent, "seed": seed}
    if resume is not None and (out is not None or config is not None):
        raise _upswing.InputError(
            "resume: takes settings and folder from the run; expected neither out nor config")
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
        """Hears of what was due at a step; says whether to go on."""
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
    """A line that says how far a training is, and one that stays for each evaluation."""

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
