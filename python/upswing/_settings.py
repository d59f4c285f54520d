"""The list of settings, and Python values as texts that the C++ code checks."""

from __future__ import annotations

import dataclasses
import operator
import os
from typing import Any, Union

import numpy as np

from . import _upswing


@dataclasses.dataclass(frozen=True)
class Setting:
    """One setting.

    Attributes:
        name: keyword argument; the program's flag has - for _
        section: section of the configuration file, such as "plant"
        type: "bool", "int", "float", "str" or "list[int]"
        default: default value
        low, high: smallest and largest allowed number; None: no limit
        step: allowed numbers are multiples of it; None: any number
        choices: allowed texts; empty: any text
        unit: unit, such as "s"; may be empty
        help: description, a noun phrase or an imperative
        environment: whether environments have the setting too, not only trainings
        members: names of the settings that an alias sets, such as mass1 and mass2; empty for others
    """

    name: str
    section: str
    type: str
    default: Any
    low: float | None
    high: float | None
    step: float | None
    choices: list[str]
    unit: str
    help: str
    environment: bool
    members: list[str] = dataclasses.field(default_factory=list)


def settings(agent: str = "d3qn") -> dict[str, Setting]:
    """The settings of a named agent's training by name, with the agent's defaults.

    Settings with `environment` are keyword arguments of the environments too.

    >>> upswing.settings("fast")["learning_rate"].default
    0.002
    """
    return _by_name(*_upswing.training_settings(agent))


def trial_settings() -> dict[str, Setting]:
    """The settings of `evaluate` by name: plant, sensors, motor and random plants."""
    return _by_name(*_upswing.trial_settings())


def agents() -> dict[str, str]:
    """The named agents with a description each."""
    return dict(_upswing.agents())


def _by_name(options: list[dict[str, Any]], aliases: list[dict[str, Any]]) -> dict[str, Setting]:
    found = {option["name"]: Setting(**option) for option in options}
    for alias in aliases:
        first = found[alias["members"][0]]
        found[alias["name"]] = dataclasses.replace(
            first, name=alias["name"], section=alias["section"], help=alias["help"],
            members=alias["members"])
    return found


def whole_number(name: str, value: Any) -> int:
    """The value of an integer argument. Raises InputError."""
    try:
        return operator.index(value)
    except TypeError:
        raise _upswing.InputError(f"{name}: expected an integer, got {value!r}") from None


def text_of(value: Any) -> str:
    """A value as the text of a flag."""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, (list, tuple, np.ndarray)):
        return ",".join(text_of(item) for item in value)
    if isinstance(value, (bytes, os.PathLike)):
        return os.fsdecode(value)
    return str(value)


# Names of earlier versions and of Stable-Baselines3, and their replacements.
_OTHER_NAMES = {
    "task": "env in train and evaluate, which are for the double pendulum without it",
    "total_timesteps": "steps", "n_envs": "num_envs with env, else envs", "net_arch": "hidden",
    "policy_kwargs": "hidden", "buffer_size": "replay", "batch_size": "batch",
    "from": "start_policy", "from_policy": "start_policy",
    "callback": "on_evaluation, on_metrics, on_episode or on_best", "verbose": "progress or logging",
    "tensorboard_log": "out, a run folder with TensorBoard events", "eval_freq": "eval_every",
    "n_eval_episodes": "eval_episodes", "n_steps": "horizon", "n_epochs": "epochs",
    "gae_lambda": "**{\"lambda\": 0.95}", "clip_range": "clip", "train_freq": "updates_per_step",
    "gradient_steps": "updates_per_step", "target_update_interval": "target_period",
    "ent_coef": "entropy_bonus (PPO) or alpha (SAC)", "exploration_final_eps": "epsilon_end",
    "exploration_initial_eps": "epsilon_start", "exploration_fraction": "epsilon_decay",
    "max_grad_norm": "max_gradient_norm", "device": "threads"}


def texts_of(values: dict[str, Any]) -> list[tuple[str, str]]:
    """Name and text of each setting. Raises InputError."""
    for name in values:
        if name in _OTHER_NAMES:
            raise _upswing.InputError(
                f"{name}: expected a setting, got {name!r}; use {_OTHER_NAMES[name]}")
    texts = [(name, text_of(value)) for name, value in values.items()]
    for name, text in texts:
        if "\0" in text:
            raise _upswing.InputError(
                f"{name}: expected a text without null characters, got {text!r}")
    return texts


PathLike = Union[str, bytes, os.PathLike[str], os.PathLike[bytes]]


def path_of(name: str, path: PathLike | None) -> str:
    """The path in an argument; empty for None. Raises InputError."""
    if path is None:
        return ""
    if not isinstance(path, (str, bytes, os.PathLike)):
        raise _upswing.InputError(f"{name}: expected a path, got {path!r}")
    text = os.fsdecode(path)
    if not text or "\0" in text:
        raise _upswing.InputError(
            f"{name}: expected a path, got {repr(text) if text else 'an empty text'}")
    return text
