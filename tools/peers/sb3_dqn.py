#!/usr/bin/env python3
"""Measures Stable-Baselines3's DQN once and prints the result as one JSON line.

  build/peers-venv/bin/python tools/peers/sb3_dqn.py gradient --threads 2
  build/peers-venv/bin/python tools/peers/sb3_dqn.py training --width 64 --seconds 5
  build/peers-venv/bin/python tools/peers/sb3_dqn.py acrobot --seed 3

gradient: model.train on a full replay memory. training: model.learn with one update per step, after
the warm-up. Both use the double pendulum. acrobot: trains on Gymnasium's Acrobot-v1 with the
settings of our agent `acrobot`, then evaluates.
"""

import argparse
import json
import math
import time

import stable_baselines3
import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

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


def make_for_acrobot(settings, seed):
    """The agent with those of our settings that it supports. It lacks dueling heads, Double DQN,
    layer normalisation, prioritised replay, mirrored minibatches, scaled rewards and averaged
    policies."""
    train, network, agent = settings["train"], settings["network"], settings["agent"]
    envs = train["envs"]
    updates = max(1, round(envs * agent["updates_per_step"]))  # after a step of all environments
    # Our epsilon decays by a factor per episode of about 130 steps; theirs decays linearly.
    decay_episodes = math.log(agent["epsilon_end"]) / math.log(agent["epsilon_decay"])

    def learning_rate(remaining):
        """The learning rate, from the remaining share of the steps."""
        done = min(1.0, (1 - remaining) * train["steps"] / agent["learning_rate_steps"])
        return agent["learning_rate"] + done * (agent["learning_rate_end"] - agent["learning_rate"])

    return stable_baselines3.DQN(
        "MlpPolicy", make_vec_env("Acrobot-v1", envs, seed=seed),
        policy_kwargs={"net_arch": network["hidden"]}, batch_size=agent["batch"],
        learning_rate=learning_rate, gamma=agent["gamma"], n_steps=agent["n_step"],
        # Their target network moves once for all updates of a step.
        tau=1 - (1 - agent["tau"])**updates, target_update_interval=1,
        train_freq=1, gradient_steps=updates, max_grad_norm=agent["max_gradient_norm"],
        buffer_size=agent["replay"], learning_starts=agent["learning_starts"],
        exploration_fraction=min(1.0, 130 * decay_episodes / train["steps"]),
        exploration_initial_eps=agent["epsilon_start"],
        exploration_final_eps=agent["epsilon_end"], seed=seed, device="cpu")


def acrobot(seed):
    """Times model.learn on Acrobot-v1, then evaluates the greedy policy."""
    settings = ours.acrobot_settings()
    model = make_for_acrobot(settings, seed)
    clock = Clock()
    model.learn(settings["train"]["steps"])
    result = clock.result(settings["train"]["steps"])
    result["seconds"] = settings["train"]["steps"] / result["steps_per_second"]
    result["mean_return"], _ = evaluate_policy(
        model, make_vec_env("Acrobot-v1", 10, seed=1000 + seed), ours.EPISODES, deterministic=True)
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("measure", choices=["gradient", "training", "acrobot"],
                        help="what to measure")
    parser.add_argument("--width", type=int, default=256,
                        help="width of both hidden layers (default 256)")
    parser.add_argument("--batch", type=int, default=128,
                        help="transitions per minibatch (default 128)")
    parser.add_argument("--threads", type=int, default=1,
                        help="number of threads of PyTorch (default 1)")
    parser.add_argument("--seconds", type=float, default=3.0,
                        help="length of the measurement [s] (default 3)")
    parser.add_argument("--seed", type=int, default=1,
                        help="seed of the training on Acrobot-v1 (default 1)")
    a = parser.parse_args()
    torch.set_num_threads(a.threads)
    if a.measure == "acrobot":
        result = acrobot(a.seed)
    else:
        measure = {"gradient": gradient, "training": training}[a.measure]
        result = measure(a.width, a.batch, a.seconds)
    version = f"stable-baselines3 {stable_baselines3.__version__}, torch {torch.__version__}"
    print(json.dumps(result | {"version": version}))


if __name__ == "__main__":
    main()
