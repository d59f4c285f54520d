"""Upswing: controllers that swing up and balance a double pendulum with one motor.

The package runs the environments, trainings, evaluations and maps of the C++ program:

>>> import gymnasium as gym, upswing
>>> envs = gym.make_vec("upswing/DoublePendulum-v0", num_envs=1024, physics="closed-form")
>>> training = upswing.train(agent="fast", seed=1)
>>> upswing.evaluate(training.best)["success_rate"]
1.0

Settings are keyword arguments with the names, units, ranges and defaults of the program's flags;
`upswing.settings()` lists them. A wrong argument raises `InputError`, a `ValueError`. A failure of
the work itself, such as writing to a full disk, raises `Failure`, a `RuntimeError`.
"""

from gymnasium.envs.registration import register as _register

from . import _mujoco as _mujoco  # loads MuJoCo's library, which the next module needs
from ._upswing import Error, Failure, InputError
from ._upswing import version as __version__
from . import machine
from .envs import DoublePendulumEnv, DoublePendulumVectorEnv
from .evaluation import Evaluation, Map, evaluate, map  # pylint: disable=redefined-builtin
from .policy import Policy, load_policy
from ._settings import Setting, agents, settings
from .training import Training, train

__all__ = [
    "DoublePendulumEnv",
    "DoublePendulumVectorEnv",
    "Error",
    "Evaluation",
    "Failure",
    "InputError",
    "Map",
    "Policy",
    "Setting",
    "Training",
    "__version__",
    "agents",
    "evaluate",
    "load_policy",
    "machine",
    "map",
    "settings",
    "train",
]

for _error in (Error, Failure, InputError):
    _error.__module__ = __name__  # the name of the class in messages and pickles

_register(
    id="upswing/DoublePendulum-v0",
    entry_point="upswing.envs:DoublePendulumEnv",
    vector_entry_point="upswing.envs:DoublePendulumVectorEnv",
)
# The task of evaluations: 20 s from hanging.
_register(
    id="upswing/DoublePendulumSwingUp-v0",
    entry_point="upswing.envs:DoublePendulumEnv",
    vector_entry_point="upswing.envs:DoublePendulumVectorEnv",
    max_episode_steps=1000,
    kwargs={"episode_seconds": 20, "random_start_share": 0},
)
