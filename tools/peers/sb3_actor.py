#!/usr/bin/env python3
"""Trains Stable-Baselines3's SAC or PPO once and prints the result as one JSON line.

  build/peers-venv/bin/python tools/peers/sb3_actor.py sac --width 256 --batch 256
  build/peers-venv/bin/python tools/peers/sb3_actor.py ppo --task double-pendulum --seed 3

Learns to the last step and then evaluates the mean action over 100 episodes. The clock leaves out
the first steps (`unclocked_steps` in actors.py).
"""

import argparse
import json
from math import log

import stable_baselines3
import torch
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import actors
import ours
from pendulum import TorquePendulum
from sb3_dqn import Clock

ENVIRONMENTS = {"pendulum-v1": "Pendulum-v1", "double-pendulum": TorquePendulum}


def make_sac(task, width, batch, seed):
    """SAC with ReLU after its layers, and Adam optimisers."""
    return stable_baselines3.SAC(
        "MlpPolicy", make_vec_env(ENVIRONMENTS[task], 1, seed=seed),
        policy_kwargs={"net_arch": [width, width]}, batch_size=batch,
        learning_rate=actors.LEARNING_RATE, gamma=actors.SAC_GAMMA, tau=actors.TAU,
        ent_coef=f"auto_{actors.ALPHA}", target_entropy=-1.0, buffer_size=actors.REPLAY,
        learning_starts=actors.LEARNING_STARTS, train_freq=1, gradient_steps=1, seed=seed,
        device="cpu")


def make_ppo(task, width, batch, seed, envs):
    """PPO. Actions are torques, so the initial spread is multiplied by the limit."""
    std = actors.INITIAL_STD * actors.TASKS[task]["limit"]
    return stable_baselines3.PPO(
        "MlpPolicy", make_vec_env(ENVIRONMENTS[task], envs, seed=seed),
        policy_kwargs={"net_arch": [width, width], "activation_fn": torch.nn.ReLU,
                       "log_std_init": log(std)},
        n_steps=actors.ROLLOUT // envs, batch_size=batch, n_epochs=actors.EPOCHS,
        learning_rate=actors.LEARNING_RATE, gamma=actors.TASKS[task]["ppo_gamma"],
        gae_lambda=actors.LAMBDA, clip_range=actors.CLIP, ent_coef=0.0,
        max_grad_norm=actors.MAX_GRADIENT_NORM, seed=seed, device="cpu")


def measure(a):
    """Trains and evaluates."""
    if a.measure == "sac":
        model = make_sac(a.task, a.width, a.batch, a.seed)
    else:
        model = make_ppo(a.task, a.width, a.batch, a.seed, a.envs)
    steps, unclocked = actors.all_steps(a.measure, a.steps), actors.unclocked_steps(a.measure)
    model.learn(unclocked)
    clock = Clock()
    model.learn(steps - unclocked, reset_num_timesteps=False)
    result = clock.result(steps - unclocked)
    result["seconds"] = steps / result["steps_per_second"]
    result["mean_return"], _ = evaluate_policy(
        model, make_vec_env(ENVIRONMENTS[a.task], 10, seed=1000 + a.seed), ours.EPISODES,
        deterministic=True)
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("measure", choices=["sac", "ppo"], help="algorithm")
    parser.add_argument("--task", choices=list(actors.TASKS), default="pendulum-v1",
                        help="task to learn (default pendulum-v1)")
    parser.add_argument("--width", type=int, help="width of both hidden layers (default 64)")
    parser.add_argument("--batch", type=int, help="transitions per minibatch (default sac 100, ppo 256)")
    parser.add_argument("--threads", type=int, default=1, help="number of threads of PyTorch (default 1)")
    parser.add_argument("--steps", type=int,
                        help="steps of the training (default sac 20000, ppo 300000)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the training (default 1)")
    parser.add_argument("--envs", type=int, default=actors.ENVS,
                        help=f"environments of PPO, for rollouts of {actors.ROLLOUT} steps in all (default "
                             f"{actors.ENVS})")
    a = parser.parse_args()
    for name, value in actors.DEFAULTS[a.measure].items():
        if getattr(a, name) is None:
            setattr(a, name, value)
    torch.set_num_threads(a.threads)
    version = f"stable-baselines3 {stable_baselines3.__version__}, torch {torch.__version__}"
    print(json.dumps(measure(a) | {"version": version}))


if __name__ == "__main__":
    main()
