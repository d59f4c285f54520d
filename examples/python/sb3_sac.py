#!/usr/bin/env python3
"""Trains Stable-Baselines3's SAC to swing up and balance on Upswing's vector environment.

    ./upswing python examples/python/sb3_sac.py --threads 1

The script uses the settings of Upswing's agent sac-fast that Stable-Baselines3's SAC supports:
one critic, three-step targets, layer normalisation, a decaying learning rate.

Every --eval-every steps, Upswing's `evaluate` evaluates the mean action as for its own agents: 100
episodes of 20 s, first in closed form, then in MuJoCo if all succeed. Two successive passed
evaluations solve the task.
"""

import argparse
import time

import torch
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import BaseCallback

import upswing
from sb3_env import UpswingVecEnv


class NormedReLU(torch.nn.Module):
    """A layer's outputs scaled to mean 0 and variance 1 over its units, then ReLU."""

    def forward(self, x):
        return torch.relu(torch.nn.functional.layer_norm(x, x.shape[-1:]))


class Judge(BaseCallback):
    """Evaluates at intervals, and ends the training once the task is solved."""

    def __init__(self, every):
        super().__init__()
        self.every, self.due = every, every
        self.streak = 0
        self.began, self.judging = time.perf_counter(), 0.0
        self.cpu_began, self.cpu_judging = time.process_time(), 0.0

    def _on_step(self):
        if self.num_timesteps < self.due:
            return True
        self.due += self.every
        begin, cpu_begin = time.perf_counter(), time.process_time()
        seconds = begin - self.began - self.judging
        cpu = cpu_begin - self.cpu_began - self.cpu_judging

        def act(obs):
            return self.model.predict(obs, deterministic=True)[0]

        result = upswing.evaluate(act, physics="closed-form", seed=self.num_timesteps)
        if result["success_rate"] == 1:
            result = upswing.evaluate(act, seed=self.num_timesteps)
        self.streak = self.streak + 1 if result["success_rate"] == 1 else 0
        print(f"{self.num_timesteps:9,} steps  {seconds:7.1f} s  {cpu:7.1f} s of CPU  "
              f"return {result['return']['mean']:6.0f}  success {result['successes']}/100  "
              f"({result['physics']})", flush=True)
        self.judging += time.perf_counter() - begin
        self.cpu_judging += time.process_time() - cpu_begin
        return self.streak < 2


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1, help="seed of the training (default 1)")
    parser.add_argument("--threads", type=int, default=1,
                        help="number of threads of PyTorch and the environments (default 1)")
    parser.add_argument("--envs", type=int, default=32, help="number of environments (default 32)")
    parser.add_argument("--updates", type=int, default=4, help="updates per step of all environments (default 4)")
    parser.add_argument("--steps", type=int, default=250_000, help="training budget; the learning rate decays until its end (default 250,000)")
    parser.add_argument("--eval-every", type=int, default=10_000, help="interval between evaluations [steps] (default 10,000)")
    parser.add_argument("--save", help="file to write, the model of Stable-Baselines3")
    a = parser.parse_args()
    torch.set_num_threads(a.threads)
    envs = UpswingVecEnv(a.envs, reward_scale=0.1, agent="sac-fast", threads=a.threads)
    model = SAC("MlpPolicy", envs, seed=a.seed, device="cpu", gamma=0.98, tau=0.01,
                learning_rate=lambda left: 2e-5 * 150 ** left,  # 3e-3 at first
                batch_size=128, buffer_size=100_000, learning_starts=2_000, train_freq=1,
                gradient_steps=a.updates, n_steps=3,
                policy_kwargs={"net_arch": [64, 64], "n_critics": 1,
                               "activation_fn": NormedReLU})
    judge = Judge(a.eval_every)
    model.learn(a.steps, callback=judge)
    print("solved" if judge.streak == 2 else "not solved")
    if a.save:
        model.save(a.save)


if __name__ == "__main__":
    main()
