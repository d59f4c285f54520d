#!/usr/bin/env python3
"""Writes trajectories of Gymnasium's Pendulum-v1 and Acrobot-v1 next to this file, as CSV.

    pip install gymnasium==1.4.0
    src/pendulum/testdata/make_gymnasium.py

A row is one step: `run`, the state before it, the torque, Gymnasium's results, the state after.
States and rewards have all digits of a double, observations all digits of a float. The starts and
torques make angles wrap, velocities reach their bounds and Acrobot reach its goal.
"""

import csv
import math
from pathlib import Path

import gymnasium
import numpy as np

HERE = Path(__file__).resolve().parent
PI = math.pi


def random_torque(rng, limit):
    """A random torque within the limit, drawn at each step."""
    return lambda state, step: rng.uniform(-limit, limit)


def extreme_torque(rng, limit):
    """The lower or the upper limit at random, held for five steps."""
    ends = rng.choice([-limit, limit], size=1000)
    return lambda state, step: ends[step // 5]


def pumping_torque(limit, velocity):
    """Full torque along the velocity with this index in the state, so that the energy grows."""
    return lambda state, step: math.copysign(limit, state[velocity])


def pendulum_step(env, state, torque):
    """One step of Pendulum-v1. The torque is a double, so that the reward is a double, too."""
    env.state = np.array(state)
    return env.step(np.array([torque]))


def acrobot_step(env, state, torque):
    """One step of Acrobot-v1 with any torque: it replaces the table of torques by one entry."""
    env.state = np.array(state)
    env.AVAIL_TORQUE = [torque]
    return env.step(0)


def rollout(env, step, start, torque_of, steps):
    """Rows of one run, which continues past the goal."""
    state = [float(x) for x in start]
    for number in range(steps):
        torque = float(torque_of(state, number))
        obs, reward, terminated, _, _ = step(env, state, torque)
        after = [float(x) for x in env.state]
        yield [*state, torque, float(reward), int(terminated), *after, *map(str, obs)]
        state = after


def write(name, step, variables, obs_size, runs):
    """Writes one file: `runs` are pairs of a start and a torque, `steps` rows each."""
    env = gymnasium.make(name).unwrapped
    header = ["run", *variables, "torque", "reward", "terminated",
              *[f"next_{variable}" for variable in variables],
              *[f"obs{i}" for i in range(obs_size)]]
    path = HERE / f"gymnasium_{name.lower().replace('-', '_')}.csv"
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# {name} of Gymnasium {gymnasium.__version__} (NumPy {np.__version__}), "
                   "https://gymnasium.farama.org; made by make_gymnasium.py\n")
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(header)
        for number, (start, torque_of, steps) in enumerate(runs):
            for row in rollout(env, step, start, torque_of, steps):
                rows.writerow([number, *row])


def main():
    rng = np.random.default_rng(1)
    write("Pendulum-v1", pendulum_step, ["theta", "omega"], 3, [
        ([PI, 0.01], pumping_torque(2, 1), 200),
        (rng.uniform([-PI, -1], [PI, 1]), random_torque(rng, 2), 200),
        (rng.uniform([-PI, -1], [PI, 1]), extreme_torque(rng, 2), 200)])
    write("Acrobot-v1", acrobot_step, ["theta1", "theta2", "omega1", "omega2"], 6, [
        (rng.uniform(-0.1, 0.1, 4), pumping_torque(1, 3), 300),
        (rng.uniform(-0.1, 0.1, 4), random_torque(rng, 1), 300),
        ([1.0, 2.0, 10.0, 20.0], extreme_torque(rng, 1), 100),
        ([0.5, 2.0, 12.0, 28.0], pumping_torque(1, 3), 100)])


if __name__ == "__main__":
    main()
