"""SAC and PPO: the common settings of all libraries, and Upswing's measurements."""

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

# Settings of our task. Pendulum-v1 lacks them; here, settings that our agents change have their
# defaults again.
OUR_TASK = {"pendulum-v1": {"physics": "mujoco", "random-start-share": 0.5},
            "double-pendulum": {"physics": "mujoco", "episode-seconds": 10, "random-start-share": 0,
                                "start-noise": 0.1, "start-noise-end": 0.1}}

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


def sac_settings():
    """Our SAC without the features that the others lack."""
    return {"agent": "sac", "envs": 1, "updates-per-step": 1, "actor-period": 1, "n-step": 1,
            "gamma": SAC_GAMMA, "tau": TAU, "alpha": ALPHA, "alpha-rate": LEARNING_RATE,
            "target-entropy": -1, "bins": 0, "smoothness": 0, "replay": REPLAY,
            "learning-starts": LEARNING_STARTS, "policy-tau": 1, "max-gradient-norm": 1e9}


def ppo_settings(task):
    """Our PPO without the features that the others lack."""
    return {"agent": "ppo", "envs": ENVS, "horizon": HORIZON, "epochs": EPOCHS,
            "gamma": TASKS[task]["ppo_gamma"], "lambda": LAMBDA, "clip": CLIP,
            "initial-std": INITIAL_STD, "max-std": 5, "entropy-bonus": 0,
            "entropy-bonus-end": 0, "value-clip": 0, "kl-target": 0,
            "activation": "relu", "max-gradient-norm": MAX_GRADIENT_NORM}


def flags(what, task, width, batch, threads, seed):
    """The arguments of `upswing train` with these settings, without steps and folder."""
    settings = sac_settings() if what == "sac" else ppo_settings(task)
    settings |= {"task": task, "hidden": f"{width},{width}", "batch": batch, "threads": threads,
                 "seed": seed, "reward-scale": 1, "learning-rate": LEARNING_RATE,
                 "learning-rate-end": LEARNING_RATE, "log-every": unclocked_steps(what)}
    switches = ["--no-mirror", "--no-layer-norm", "--no-stop-when-solved"]
    switches += ["--no-normalize"] if what == "ppo" else ["--twin", "--no-prioritized"]
    settings |= OUR_TASK[task]
    return switches + [f"--{name}={value}" for name, value in settings.items()]


def train(given, steps):
    """Trains for `steps` steps, with one evaluation and one checkpoint at the end. Returns the CPU
    time of the whole process, the log's rows and the evaluation's mean return."""
    with tempfile.TemporaryDirectory(prefix="upswing-peers-") as folder:
        out = Path(folder, "run")
        cpu = ours.children_cpu_seconds()
        ours.run([ours.PROGRAM, "train", *given, f"--out={out}", f"--steps={steps}",
                  f"--eval-every={steps + 1}", f"--eval-episodes={ours.EPISODES}",
                  f"--checkpoint-every={steps + 1}"])
        cpu = ours.children_cpu_seconds() - cpu
        mean_return = ours.read_rows(out / "evals.csv")[-1]["mean_return"]
        return cpu, ours.read_rows(out / "metrics.csv"), mean_return


def measure(what, task, width, batch, threads, steps, seed):
    """Measures a training to its last step, and the mean return of its last policy. The rate comes
    from the log's rows after the first. A second training, which ends at the first row, has the
    same start, evaluation and checkpoint; its CPU time is subtracted."""
    given = flags(what, task, width, batch, threads, seed)
    short, steps = unclocked_steps(what), all_steps(what, steps)
    cpu_short, _, _ = train(given, short)
    cpu, rows, mean_return = train(given, steps)
    first, last = rows[0], rows[-1]
    counted = last["step"] - first["step"]
    return {"steps_per_second": counted / (last["seconds"] - first["seconds"]),
            "cpu_seconds_per_step": (cpu - cpu_short) / (steps - short),
            "mean_return": mean_return, "seconds": last["seconds"]}


def sac(**arguments):
    """Measures a training with SAC, with one round per step."""
    return measure("sac", **arguments)


def ppo(**arguments):
    """Measures a training with PPO."""
    return measure("ppo", **arguments)
