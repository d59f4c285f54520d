"""SAC and PPO: the common settings of all libraries, and Upswing's measurements."""

import functools
import tempfile
from pathlib import Path

import ours

# The tasks: Gymnasium's Pendulum-v1, and the double pendulum with any torque up to its limit.
TASKS = {"pendulum-v1": {"limit": 2.0, "ppo_gamma": 0.9},
         "double-pendulum": {"limit": 5.0, "ppo_gamma": 0.99}}

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
LAMBDA = 0.95
CLIP = 0.2
INITIAL_STD = 2.0  # of actions, in units of the limit
MAX_GRADIENT_NORM = 0.5  # of Upswing and Stable-Baselines3

# Settings of the double pendulum's environments.
DOUBLE_PENDULUM = {"physics": "mujoco", "episode_seconds": 10, "random_start_share": 0,
                   "start_noise": 0.1, "start_noise_end": 0.1}

# Training settings if none are requested.
DEFAULTS = {"sac": {"width": 64, "batch": 100, "steps": 20_000},
            "ppo": {"width": 64, "batch": 256, "steps": 300_000}}


def unclocked_steps(what):
    """Number of steps before the clock starts."""
    return LEARNING_STARTS + WARM_UP if what == "sac" else ROLLOUT


def all_steps(what, steps):
    """Total number of steps: for PPO whole rollouts, at least two."""
    if what == "ppo":
        steps = max(2 * ROLLOUT, steps - steps % ROLLOUT)
    if steps <= unclocked_steps(what):
        raise ours.Failed(f"steps: expected more than {unclocked_steps(what)}, before which the "
                          f"clock does not run, got {steps}")
    return steps


def settings(what, task, width, batch, threads, seed):
    """Our SAC or PPO without the features that the others lack."""
    common = {"hidden": f"{width},{width}", "batch": batch, "threads": threads, "seed": seed,
              "reward_scale": 1, "learning_rate": LEARNING_RATE,
              "learning_rate_end": LEARNING_RATE, "mirror": False, "layer_norm": False,
              "stop_when_solved": False, "eval_episodes": ours.EPISODES}
    if what == "sac":
        return common | {
            "envs": 1, "updates_per_step": 1, "actor_period": 1, "n_step": 1, "gamma": SAC_GAMMA,
            "tau": TAU, "alpha": ALPHA, "alpha_rate": LEARNING_RATE, "target_entropy": -1,
            "smoothness": 0, "replay": REPLAY, "learning_starts": LEARNING_STARTS,
            "policy_tau": 1, "max_gradient_norm": 1e9, "twin": True, "prioritized": False,
            "entropy_reward": True, "reward_centering": 0}
    return common | {
        "envs": ENVS, "horizon": HORIZON, "epochs": EPOCHS, "gamma": TASKS[task]["ppo_gamma"],
        "lambda": LAMBDA, "clip": CLIP, "initial_std": INITIAL_STD, "max_std": 5,
        "entropy_bonus": 0, "entropy_bonus_end": 0, "value_clip": 0, "kl_target": 0,
        "activation": "relu", "max_gradient_norm": MAX_GRADIENT_NORM, "normalize": False}


def flag(name, value):
    """A setting as a flag of `upswing train`."""
    flag_name = name.replace("_", "-")
    if isinstance(value, bool):
        return f"--{'' if value else 'no-'}{flag_name}"
    return f"--{flag_name}={value}"


@functools.cache
def own_task():
    """The program of examples/own_task, which has Pendulum-v1, against the installed library."""
    build, library = ours.ROOT / "build/own_task", ours.ROOT / "build/own_task/library"
    ours.run(["cmake", "--install", ours.PROGRAM.parent.parent, "--prefix", library])
    ours.run(["cmake", "-S", ours.ROOT / "examples/own_task", "-B", build,
              "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_PREFIX_PATH={library}"])
    ours.run(["cmake", "--build", build])
    return build / "own_task"


def train(what, task, given, steps):
    """Trains for `steps` steps, with one evaluation at the end. Returns the CPU time of the whole
    process, the training time, and the evaluation's mean return."""
    given = given | {"steps": steps, "eval_every": steps + 1}
    if task == "pendulum-v1":
        program = own_task()
        cpu = ours.children_cpu_seconds()
        output = ours.run([program, what, *(f"{name}={str(value).lower()}"
                                            for name, value in given.items())])
        cpu = ours.children_cpu_seconds() - cpu
        words = output.splitlines()[-2].split()  # 20000 steps  12.345 s  return -150.2
        return cpu, float(words[2]), float(words[5])
    with tempfile.TemporaryDirectory(prefix="upswing-peers-") as folder:
        out = Path(folder, "run")
        given |= DOUBLE_PENDULUM | {"agent": what, "checkpoint_every": steps + 1, "out": out}
        cpu = ours.children_cpu_seconds()
        ours.run([ours.PROGRAM, "train", *(flag(*setting) for setting in given.items())])
        cpu = ours.children_cpu_seconds() - cpu
        row = ours.read_rows(out / "evals.csv")[-1]
        return cpu, row["seconds"], row["mean_return"]


def measure(what, task, width, batch, threads, steps, seed):
    """Measures a training to its last step, and the mean return of its last policy. A second
    training, which ends where the clock starts, has the same start and evaluation; its times are
    subtracted for the rates."""
    given = settings(what, task, width, batch, threads, seed)
    short, steps = unclocked_steps(what), all_steps(what, steps)
    cpu_short, seconds_short, _ = train(what, task, given, short)
    cpu, seconds, mean_return = train(what, task, given, steps)
    return {"steps_per_second": (steps - short) / (seconds - seconds_short),
            "cpu_seconds_per_step": (cpu - cpu_short) / (steps - short),
            "mean_return": mean_return, "seconds": seconds}


def sac(**arguments):
    """Measures a training with SAC, with one round per step."""
    return measure("sac", **arguments)


def ppo(**arguments):
    """Measures a training with PPO."""
    return measure("ppo", **arguments)
