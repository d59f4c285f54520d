#!/usr/bin/env python3
"""PPO in one file, in the style of CleanRL, on Upswing's vector environment.

    ./upswing python examples/python/ppo.py --steps 2000000

An environment resets in the step after the end of an episode (Gymnasium's NEXT_STEP, the default).
That step is not a transition, and the loss leaves it out.
"""

import argparse
import time

import gymnasium as gym
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

import upswing

GAMMA, LAMBDA, CLIP, EPOCHS, MINIBATCH = 0.98, 0.95, 0.2, 4, 1024
HORIZON, ENTROPY, LEARNING_RATE = 32, 0.05, 3e-3
REWARD_SCALE = 0.1


class Agent(nn.Module):
    """Actor and critic with two layers each; actions are in units of the torque limit."""

    def __init__(self, obs_size, action_size):
        super().__init__()

        def network(outputs, scale):
            last = nn.Linear(64, outputs)
            nn.init.orthogonal_(last.weight, scale)
            nn.init.zeros_(last.bias)
            return nn.Sequential(nn.Linear(obs_size, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(),
                                 last)

        self.critic = network(1, 1.0)
        self.mean = network(action_size, 0.01)
        self.log_std = nn.Parameter(torch.zeros(action_size))

    def policy(self, obs):
        return Normal(self.mean(obs), self.log_std.exp().clamp(0.05, 1))

    def value(self, obs):
        return self.critic(obs)[:, 0]


def advantages_of(rewards, values, last_value, ends, resets):
    """Generalised advantage estimates (T × N). Episodes end by time limit, so the value of the last
    state counts. A step that only resets (`resets`) is not a transition."""
    advantages = torch.zeros_like(rewards)
    running = torch.zeros_like(last_value)
    for t in reversed(range(len(rewards))):
        following = last_value if t + 1 == len(rewards) else values[t + 1]
        delta = rewards[t] + GAMMA * following - values[t]
        running = delta + GAMMA * LAMBDA * running * (1 - ends[t])
        running = running * (1 - resets[t])
        advantages[t] = running
    return advantages


def learn(agent, optimizer, batch):
    """Runs some epochs on the clipped objective."""
    obs, actions, log_probs, advantages, returns = batch
    for _ in range(EPOCHS):
        for rows in torch.randperm(len(obs)).split(MINIBATCH):
            policy = agent.policy(obs[rows])
            ratio = (policy.log_prob(actions[rows]).sum(1) - log_probs[rows]).exp()
            gain = advantages[rows]
            gain = (gain - gain.mean()) / (gain.std() + 1e-8)
            loss = -torch.min(ratio * gain, ratio.clamp(1 - CLIP, 1 + CLIP) * gain).mean()
            loss += 0.5 * (agent.value(obs[rows]) - returns[rows]).square().mean()
            loss -= ENTROPY * policy.entropy().sum(1).mean()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1, help="seed of the training (default 1)")
    parser.add_argument("--envs", type=int, default=256, help="number of environments (default 256)")
    parser.add_argument("--steps", type=int, default=3_000_000,
                        help="steps of the training (default 3,000,000)")
    parser.add_argument("--threads", type=int, default=1,
                        help="number of threads of PyTorch and the environments (default 1)")
    a = parser.parse_args()
    torch.manual_seed(a.seed)
    torch.set_num_threads(a.threads)
    envs = gym.make_vec("upswing/DoublePendulum-v0", num_envs=a.envs, agent="ppo",
                        threads=a.threads)
    limit = float(envs.single_action_space.high[0])
    agent = Agent(envs.single_observation_space.shape[0], 1)
    optimizer = torch.optim.Adam(agent.parameters(), lr=LEARNING_RATE, eps=1e-5)

    def act(observations):
        """The mean action, N·m, for evaluations."""
        with torch.no_grad():
            return agent.mean(torch.from_numpy(observations)).clamp(-1, 1).numpy() * limit

    obs, _ = envs.reset(seed=a.seed)
    ended = np.zeros(a.envs, bool)
    begin, rounds = time.perf_counter(), a.steps // (a.envs * HORIZON)
    for k in range(rounds):
        optimizer.param_groups[0]["lr"] = LEARNING_RATE * (1 - k / rounds)
        rows = []
        for _ in range(HORIZON):
            x = torch.from_numpy(obs)
            with torch.no_grad():
                policy = agent.policy(x)
                action = policy.sample()
                value, log_prob = agent.value(x), policy.log_prob(action).sum(1)
            obs, rewards, terminated, truncated, _ = envs.step(action.numpy() * limit)
            resets, ended = ended, terminated | truncated
            rows.append((x, action, log_prob, value, torch.from_numpy(rewards).float(),
                         torch.from_numpy(ended).float(), torch.from_numpy(resets).float()))
        x, action, log_prob, value, reward, ends, resets = map(torch.stack, zip(*rows))
        with torch.no_grad():
            last = agent.value(torch.from_numpy(obs))
        gain = advantages_of(REWARD_SCALE * reward, value, last, ends, resets)
        kept = resets.reshape(-1) == 0
        learn(agent, optimizer, [part.reshape(-1, *part.shape[2:])[kept]
                                 for part in (x, action, log_prob, gain, gain + value)])
        if (k + 1) % max(1, rounds // 10) == 0:
            result = upswing.evaluate(act, physics="closed-form")
            print(f"{(k + 1) * a.envs * HORIZON:10,} steps  {time.perf_counter() - begin:6.1f} s  "
                  f"return {result['return']['mean']:6.0f}  success {result['successes']}/100",
                  flush=True)


if __name__ == "__main__":
    main()
