"""Training of agents."""

from __future__ import annotations

import contextlib
import dataclasses
import logging as _logging
import os
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any, TextIO

import numpy as np
from typing_extensions import Unpack

from . import _upswing
from ._foreign import EnvLike, Source
from ._lanes import Interrupts
from .policy import Policy
from ._settings import PathLike, path_of, texts_of
from ._types import TrainingSettings

Row = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Training:
    """Result of a training.

    Attributes:
        best: policy with the best evaluation, as in policy.safetensors; `last` if the training
            stopped before its first evaluation, and `best_step` is then None
        last: policy at the end of the training
        solved: whether two evaluations in a row passed
        finished: whether the training ended by itself: solved, or at its last step; not by a
            callback or Ctrl-C
        solved_step, solved_seconds: steps and training time until solved; None if not solved
        steps, episodes, updates: number of control steps, episodes and updates
        seconds: training time without evaluations that the training waits for [s]
        best_step, best_success_rate, best_return: results of the evaluation of `best`
        agent, seed, threads: agent, seed and number of threads
        path: run folder; None if none was written
        config: all settings as TOML, for a file that `train(config=...)` reads
        evaluations, metrics: rows of evals.csv and metrics.csv
    """

    best: Policy
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
    env: EnvLike | None = None,
    num_envs: int | None = None,
    eval_env: EnvLike | None = None,
    max_episode_steps: int | None = None,
    solved_return: float | None = None,
    seed: int | None = None,
    out: PathLike | None = None,
    config: PathLike | None = None,
    resume: PathLike | None = None,
    progress: bool | None = None,
    logging: int | str | None = None,
    on_episode: Callable[[Row], Any] | None = None,
    on_metrics: Callable[[Row], Any] | None = None,
    on_evaluation: Callable[[Row], Any] | None = None,
    on_best: Callable[[Policy], Any] | None = None,
    **settings: Unpack[TrainingSettings],
) -> Training:
    """Trains an agent until it solves the task, bit for bit as `upswing train` does.

    The training writes no files without `out`. Ctrl-C ends it after the current step; a run folder
    then has a checkpoint for `resume`. At a prompt and in a notebook `train` returns the training so
    far. A script gets KeyboardInterrupt, whose attribute `training` is the training so far.

    With `env` the task is a Gymnasium environment: Python steps it, the C++ code learns. The
    observations are a Box of one dimension. The actions are a Box (agents of SAC and PPO; agents
    of DQN if it has one component) or Discrete (agents of DQN and PPO). The agent gives its
    algorithm and its network; other settings have the defaults in docs/howto/gymnasium.md.

    Args:
        agent: named agent, see `upswing.agents` (default "d3qn"; with `env` "ppo" for Discrete
            actions and "sac" for a Box)
        env: id of a Gymnasium environment, an environment (copied for more), a vector environment,
            or a function that makes a new environment in each call
        num_envs: number of parallel environments (default 1, PPO 8; a vector environment has its
            own number)
        eval_env: environment for evaluations, or a function that makes it, apart from `env` and with
            its spaces (default: a copy of `env`)
        max_episode_steps: largest number of steps of an episode (default: of the environment, or
            10,000 if it has no time limit)
        solved_return: mean return of an evaluation that passes; two passed evaluations in a row
            end the training (default: train to the last step)
        seed: seed of all random numbers
        out: new run folder, as the program writes it
        config: TOML file of settings; keyword arguments override it
        resume: run folder to resume; only `steps`, `threads`, `checkpoint_every` and
            `stop_when_solved` may change. A run with `env` needs the same `env`,
            `max_episode_steps` and `solved_return` again. It continues with new episodes
        progress: show progress on standard error, or as a bar in a notebook (default: in a terminal
            and in a notebook, without `logging`)
        logging: level, such as "INFO" or logging.DEBUG, from which on Python's logger "upswing" gets
            messages: evaluations and the end are INFO, rows of metrics.csv DEBUG (default: the
            logger's own level). Without a handler they go to standard error
        on_episode, on_metrics, on_evaluation: functions that get a row of episodes.csv, metrics.csv
            or evals.csv as a dictionary; the training stops if one returns False
        on_best: function that gets the best policy so far, at its evaluation; the training stops if
            it returns False
        **settings: any setting of the agent, see `upswing.settings(agent)`, such as `reward`, an
            expression, or `start_policy`, the policy to start from: a file, a run folder or a
            shipped policy. Also plant, a plant file (TOML with a table [plant]) or a shipped plant,
            between `config` and these settings

    Returns:
        Training: result of the training

    Raises:
        InputError: a setting is out of range, settings contradict each other, or an environment
            breaks Gymnasium's interface
        Failure: a number is not finite, or a file cannot be written
        Exception: any exception of `env` and of the callbacks, unchanged

    >>> training = upswing.train(agent="fast", seed=1, hidden=[64, 64], mass2=1.1)
    >>> training.best.save("policy.safetensors")
    >>> upswing.train("fast", start_policy="policy.safetensors", mass2=1.3, reward="E + 5*inverted")
    >>> upswing.train("ppo", env="LunarLander-v3", steps=500_000, num_envs=16, out="runs/lander")
    """
    own = texts_of(dict(settings))
    config_path, out_path, resume_path = (path_of(name, path) for name, path in (
        ("config", config), ("out", out), ("resume", resume)))
    source, of_env = _source_of(agent, env, num_envs, eval_env, max_episode_steps, solved_return,
                                resume is None and config is None, dict(settings))
    named: dict[str, Any] = {"agent": agent, "seed": seed} | of_env
    if resume is not None and (out is not None or config is not None):
        raise _upswing.InputError(
            "resume: expected neither out nor config with it: the run has its own settings and "
            "folder")
    texts = texts_of({name: value for name, value in named.items() if value is not None}) + own
    for name, function in (("on_episode", on_episode), ("on_metrics", on_metrics),
                           ("on_evaluation", on_evaluation), ("on_best", on_best)):
        if function is not None and not callable(function):
            raise _upswing.InputError(f"{name}: expected a function, got {function!r}")
    judged = source is None or solved_return is not None
    log = _Log(logging, judged)
    line: _ProgressLine | None = None
    if progress or progress is logging is None:
        line = _NotebookBar(judged) if _in_notebook() else _ProgressLine(sys.stderr, judged)
        if progress is None and not line.terminal:
            line = None
    rows: dict[str, list[Row]] = {"evaluation": [], "metrics": []}
    listeners = {"episode": on_episode, "metrics": on_metrics, "evaluation": on_evaluation}

    def tick(events: list[tuple[str, Any]], state: Row) -> bool:
        """Handles the events of a step; returns whether to continue."""
        wanted = True
        for kind, what in events:
            listener: Callable[[Any], Any] | None = listeners.get(kind, on_best)
            if kind in rows:
                rows[kind].append(what)
                log.row(kind, what)
            elif kind == "best":
                what = Policy(what)
            if listener is not None:
                answer = listener(what)
                if isinstance(answer, (bool, np.bool_)) and not answer:
                    wanted = False
        if line is not None:
            line.show(events, state)
        if interrupts is not None:
            interrupts.check()
        return wanted

    def warn(text: str) -> None:
        warnings.warn(text, stacklevel=3)

    interrupts = Interrupts() if source is not None else None
    make = source.make if source is not None else None
    try:
        with interrupts or contextlib.nullcontext():
            may_stop = on_best is not None or any(listeners.values())
            result = _upswing.train(texts, config_path, out_path, resume_path, make, tick,
                                    warn, may_stop)
    except Exception as error:
        folder = out_path or resume_path
        # Before Python 3.11 an exception has no notes. The package's own errors say it themselves.
        if (os.path.isdir(folder) and hasattr(error, "add_note")
                and not isinstance(error, _upswing.Error)):
            error.add_note(f"upswing: {folder} keeps the last checkpoint; train(resume={folder!r}) "
                           "continues from there")
        raise
    finally:
        if line is not None:
            line.clear()
        if source is not None:
            source.close()
    best, last = result.pop("best"), result.pop("last")
    # Ctrl-C may come after the last step.
    interrupted = result.pop("interrupted") or (interrupts is not None and interrupts.pending)
    training = Training(best=Policy(last if best is None else best), last=Policy(last),
                        evaluations=rows["evaluation"], metrics=rows["metrics"], **result)
    log.end(training)
    if not interrupted:
        return training
    what = f"training interrupted at step {training.steps:,}"
    if training.path is not None:
        what += f"; train(resume={training.path!r}) continues"
    if not hasattr(sys, "ps1"):  # a script
        interrupt = KeyboardInterrupt(what)
        interrupt.training = training  # type: ignore[attr-defined]
        raise interrupt
    warn(what)
    return training


def _source_of(agent: str | None, env: EnvLike | None, num_envs: int | None,
               eval_env: EnvLike | None, max_episode_steps: int | None,
               solved_return: float | None, choose_agent: bool, settings: dict[str, Any]
               ) -> tuple[Source | None, dict[str, Any]]:
    """The environments of `env`, and the settings that follow from it. `choose_agent`: the default
    agent depends on the actions. Raises InputError."""
    arguments = {"num_envs": num_envs, "eval_env": eval_env,
                 "max_episode_steps": max_episode_steps, "solved_return": solved_return}
    if env is None:
        for name, value in arguments.items():
            if value is not None:
                raise _upswing.InputError(f"{name}: expected env with it, got none")
        return None, {}
    for name, instead in (("envs", "num_envs"), ("environment", "env")):
        if name in settings:
            raise _upswing.InputError(f"{name}: expected none with env; set {instead}")
    source = Source(env, num_envs, eval_env, max_episode_steps, solved_return)
    for name in ("levels", "actions"):
        if name in settings and source.discrete:
            raise _upswing.InputError(
                f"{name}: expected none with discrete actions, got {settings[name]!r}")
    found: dict[str, Any] = {"environment": source.description}
    if source.num_envs > 0 or num_envs is not None:
        found["envs"] = source.num_envs
    if agent is None and choose_agent:
        found["agent"] = "ppo" if source.discrete else "sac"
    return source, found


def _result(row: Row, judged: bool) -> str:
    """The result of an evaluation. `judged`: whether episodes can succeed."""
    success = f"  success {100 * row['success_rate']:>4.0f}%" if judged else ""
    return f"return {row['mean_return']:>6.0f}{success}"


class _Log:
    """Messages of a training to Python's logger `upswing`."""

    _logger = _logging.getLogger("upswing")

    def __init__(self, level: int | str | None, judged: bool) -> None:
        known = _logging.getLevelName(level.upper()) if isinstance(level, str) else level
        if isinstance(known, bool) or not isinstance(known, (int, type(None))):
            raise _upswing.InputError(
                f"logging: expected a level such as 'INFO' or logging.DEBUG, got {level!r}")
        self._level = known
        self._judged = judged

    def row(self, kind: str, row: Row) -> None:
        step = f"step {row['step']:,}: "
        if kind == "evaluation":
            self._send(_logging.INFO, step + " ".join(_result(row, self._judged).split()))
        else:
            self._send(_logging.DEBUG, step + ", ".join(
                f"{name} {value:.4g}" for name, value in row.items() if name != "step"))

    def end(self, training: Training) -> None:
        solved = f"solved at step {training.solved_step:,}" if training.solved else "not solved"
        self._send(_logging.INFO, f"step {training.steps:,}: training ended, {solved}")

    def _send(self, level: int, text: str) -> None:
        if self._level is None:
            self._logger.log(level, text)
        elif level >= self._level:
            record = self._logger.makeRecord("upswing", level, __file__, 0, text, (), None)
            if self._logger.hasHandlers():
                self._logger.handle(record)
            else:
                _logging.StreamHandler().handle(record)


class _ProgressLine:
    """A line with the progress of a training, and a permanent line per evaluation."""

    def __init__(self, file: TextIO, judged: bool) -> None:
        self._file = file
        self._judged = judged  # whether episodes can succeed
        self.terminal = file.isatty()
        self._last = 0.0
        self._shown = False

    def show(self, events: list[tuple[str, Any]], state: Row) -> None:
        for kind, what in events:
            if kind == "evaluation":
                self.clear()
                print(f"{what['step']:>12,} steps {state['seconds']:>10.1f} s  "
                      f"{_result(what, self._judged)}", file=self._file, flush=True)
        now = time.monotonic()
        if not self.terminal or now - self._last < 0.2:
            return
        self._last = now
        print(f"\r\033[K{self._status(state)}", end="", file=self._file, flush=True)
        self._shown = True

    @staticmethod
    def _status(state: Row) -> str:
        rate = state["steps"] / state["seconds"] if state["seconds"] > 0 else 0
        return f"{state['steps']:>12,} of {state['total_steps']:,} steps, {rate:,.0f}/s"

    def clear(self) -> None:
        if self._shown:
            print("\r\033[K", end="", file=self._file, flush=True)
        self._shown = False


def _in_notebook() -> bool:
    """Whether output goes to a notebook of Jupyter."""
    interactive = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(interactive, "kernel")


class _NotebookBar(_ProgressLine):
    """A bar with the progress of a training and its last evaluation, for a notebook."""

    def __init__(self, judged: bool) -> None:
        super().__init__(sys.stderr, judged)
        self.terminal = True  # wanted by default
        self._handle: Any = None
        self._evaluated = self._text = ""
        self._value, self._max = 0, 1

    def show(self, events: list[tuple[str, Any]], state: Row) -> None:
        for kind, what in events:
            if kind == "evaluation":
                self._evaluated = f", {' '.join(_result(what, self._judged).split())} at step {what['step']:,}"
        self._value, self._max = state["steps"], state["total_steps"]
        self._text = self._status(state).strip() + self._evaluated
        now = time.monotonic()
        if now - self._last >= 0.2:
            self._last = now
            self._draw()

    def clear(self) -> None:
        self._draw()  # the last numbers stay

    def _draw(self) -> None:
        from IPython.display import display  # pylint: disable=import-outside-toplevel
        shown = {"text/plain": self._text, "text/html":
                 f"<progress value={self._value} max={self._max}></progress> {self._text}"}
        if self._handle is None:
            show: Callable[..., Any] = display
            self._handle = show(shown, raw=True, display_id=True)
        else:
            self._handle.update(shown, raw=True)
