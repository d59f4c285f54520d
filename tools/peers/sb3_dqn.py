#!/usr/bin/env python3
"""Measures Stable-Baselines3's DQN once and prints the result as one JSON line.

  build/peers-venv/bin/python tools/peers/sb3_dqn.py gradient --threads 2
  build/peers-venv/bin/python tools/peers/sb3_dqn.py training --width 64 --seconds 5

gradient: model.train on a full replay memory. training: model.learn with one update per step, after
the warm-up. Both use the double pendulum.
"""

import argparse
import json
import time

import stable_baselines3
import torch
from stable_baselines3.common.callbacks import BaseCallback

import ours
from pendulum import DoublePendulum

FILL = 5000  # transitions in the replay memory for `gradient`
WARM_UP = 200  # updates before the clock starts


class Clock:
    """Wall-clock and CPU time of this process since the object was created."""

    def __init__(self):
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def result(self, steps):
        """The rates of `steps` steps."""
        wall, cpu = time.perf_counter() - self.wall, time.process_time() - self.cpu
        return {"steps_per_second": steps / wall, "cpu_seconds_per_step": cpu / steps}


class Timed(BaseCallback):
    """Starts the clock after the warm-up of learning, and stops the training when the time is
    over."""

    def __init__(self, seconds):
        super().__init__()
        self.seconds = seconds
        self.first_step = ours.LEARNING_STARTS + WARM_UP
        self.clock = self.result = None

    def _on_step(self):
        if self.num_timesteps == self.first_step:
            self.clock = Clock()
        if self.clock is None or time.perf_counter() - self.clock.wall < self.seconds:
            return True
        self.result = self.clock.result(self.num_timesteps - self.first_step)
        return False


def make(width, batch, learning_starts):
    """The agent: smooth L1 loss (Huber with threshold 1), Adam, and ReLU after its layers."""
    return stable_baselines3.DQN(
        "MlpPolicy", DoublePendulum(), policy_kwargs={"net_arch": [width, width]}, batch_size=batch,
        learning_rate=ours.LEARNING_RATE, gamma=ours.GAMMA, tau=ours.TAU, target_update_interval=1,
        train_freq=1, gradient_steps=1, max_grad_norm=ours.MAX_GRADIENT_NORM,
        buffer_size=ours.REPLAY, learning_starts=learning_starts,
        exploration_initial_eps=ours.EPSILON, exploration_final_eps=ours.EPSILON,
        seed=1, device="cpu")


def gradient(width, batch, seconds):
    """Fills the replay memory, then times one call of model.train."""
    model = make(width, batch, learning_starts=FILL + 1)
    model.learn(FILL)
    model.train(gradient_steps=WARM_UP, batch_size=batch)
    clock = Clock()
    model.train(gradient_steps=WARM_UP, batch_size=batch)
    steps = max(1, round(seconds * clock.result(WARM_UP)["steps_per_second"]))
    clock = Clock()
    model.train(gradient_steps=steps, batch_size=batch)
    return clock.result(steps)


def training(width, batch, seconds):
    """Times model.learn."""
    timed = Timed(seconds)
    make(width, batch, ours.LEARNING_STARTS).learn(10**9, callback=timed)
    return timed.result


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("measure", choices=["gradient", "training"], help="what to measure")
    parser.add_argument("--width", type=int, default=256,
                        help="width of both hidden layers (default 256)")
    parser.add_argument("--batch", type=int, default=128,
                        help="transitions per minibatch (default 128)")
    parser.add_argument("--threads", type=int, default=1,
                        help="number of threads of PyTorch (default 1)")
    parser.add_argument("--seconds", type=float, default=3.0,
                        help="length of the measurement [s] (default 3)")
    a = parser.parse_args()
    torch.set_num_threads(a.threads)
    measure = {"gradient": gradient, "training": training}[a.measure]
    result = measure(a.width, a.batch, a.seconds)
    version = f"stable-baselines3 {stable_baselines3.__version__}, torch {torch.__version__}"
    print(json.dumps(result | {"version": version}))


if __name__ == "__main__":
    main()
