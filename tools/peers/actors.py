"""SAC and PPO on Gymnasium's Pendulum-v1: the settings of both libraries, and Upswing's measurements."""

import functools
import os
import resource
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PROGRAM = Path(os.environ.get("UPSWING", ROOT / "build/release/bin/upswing"))
EPISODES = 100  # per evaluation

LEARNING_RATE = 1e-3
REPLAY = 100_000

# SAC uses one environment, and one round (two critics, actor, temperature) after each step.
SAC_GAMMA = 0.99
TAU = 0.005
ALPHA = 0.5  # initial temperature; the target entropy is -1
LEARNING_STARTS = 100  # steps before the first round, with random actions
WARM_UP = 200  # rounds before the clock starts

# PPO collects rollouts of all environments, and learns from each in a few passes.
ENVS = 4
HORIZON = 1024  # steps of each environment per rollout
ROLLOUT = ENVS * HORIZON
EPOCHS = 2
PPO_GAMMA = 0.9
LAMBDA = 0.95
CLIP = 0.2
INITIAL_STD = 2.0  # of actions, in units of the limit
MAX_GRADIENT_NORM = 0.5  # of Upswing

# Training settings.
WIDTH = 64  # of both hidden layers
BATCH = {"sac": 100, "ppo": 256}
STEPS = {"sac": 20_000, "ppo": 300_000 - 300_000 % ROLLOUT}


class Failed(Exception):
    """An error with a one-line message for the user."""


def run(command, **more):
    """Runs a command to its end and returns its output. Raises Failed with the last line of its
    output."""
    done = subprocess.run(list(map(str, command)), stdin=subprocess.DEVNULL, capture_output=True,
                          encoding="utf-8", check=False, **more)
    if done.returncode != 0:
        words = (done.stderr.strip() or done.stdout.strip() or "it said nothing").splitlines()
        name = " ".join(Path(word).name for word in map(str, command[:3]))
        raise Failed(f"{name} ended with {done.returncode}: {words[-1]}")
    return done.stdout


def children_cpu_seconds():
    """CPU time of all finished child processes."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def unclocked_steps(what):
    """Number of steps before the clock starts."""
    return LEARNING_STARTS + WARM_UP if what == "sac" else ROLLOUT


def settings(what, seed):
    """Our SAC or PPO without the features that the other lacks."""
    common = {"hidden": f"{WIDTH},{WIDTH}", "batch": BATCH[what], "threads": 1, "seed": seed,
              "reward_scale": 1, "learning_rate": LEARNING_RATE,
              "learning_rate_end": LEARNING_RATE, "mirror": False, "layer_norm": False,
              "stop_when_solved": False, "eval_episodes": EPISODES}
    if what == "sac":
        return common | {
            "envs": 1, "updates_per_step": 1, "actor_period": 1, "n_step": 1, "gamma": SAC_GAMMA,
            "tau": TAU, "alpha": ALPHA, "alpha_rate": LEARNING_RATE, "target_entropy": -1,
            "smoothness": 0, "replay": REPLAY, "learning_starts": LEARNING_STARTS,
            "policy_tau": 1, "max_gradient_norm": 1e9, "twin": True, "prioritized": False,
            "entropy_reward": True, "reward_centering": 0}
    return common | {
        "envs": ENVS, "horizon": HORIZON, "epochs": EPOCHS, "gamma": PPO_GAMMA,
        "lambda": LAMBDA, "clip": CLIP, "initial_std": INITIAL_STD, "max_std": 5,
        "entropy_bonus": 0, "entropy_bonus_end": 0, "value_clip": 0, "kl_target": 0,
        "activation": "relu", "max_gradient_norm": MAX_GRADIENT_NORM, "normalize": False}


@functools.cache
def own_task():
    """The program of examples/own_task, which has Pendulum-v1, against the installed library."""
    build, library = ROOT / "build/own_task", ROOT / "build/own_task/library"
    run(["cmake", "--install", PROGRAM.parent.parent, "--prefix", library])
    run(["cmake", "-S", ROOT / "examples/own_task", "-B", build,
         "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_PREFIX_PATH={library}"])
    run(["cmake", "--build", build])
    return build / "own_task"


def train(what, steps, seed):
    """Trains for `steps` steps, with one evaluation at the end. Returns the CPU time of the whole
    process, the training time, and the evaluation's mean return."""
    given = settings(what, seed) | {"steps": steps, "eval_every": steps + 1}
    program = own_task()
    cpu = children_cpu_seconds()
    output = run([program, what, *(f"{name}={str(value).lower()}" for name, value in given.items())])
    cpu = children_cpu_seconds() - cpu
    words = output.splitlines()[-2].split()  # 20000 steps  12.345 s  return -150.2
    return cpu, float(words[2]), float(words[5])


def measure(what, seed):
    """Measures a training to its last step, and the mean return of its last policy. A second
    training, which ends where the clock starts, has the same start and evaluation; its times are
    subtracted for the rates."""
    short, steps = unclocked_steps(what), STEPS[what]
    cpu_short, seconds_short, _ = train(what, short, seed)
    cpu, seconds, mean_return = train(what, steps, seed)
    return {"steps_per_second": (steps - short) / (seconds - seconds_short),
            "cpu_seconds_per_step": (cpu - cpu_short) / (steps - short),
            "mean_return": mean_return}
