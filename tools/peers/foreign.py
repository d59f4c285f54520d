#!/usr/bin/env python3
"""Trains Upswing and Stable-Baselines3 on Gymnasium environments with the same settings.

  PYTHONPATH=build/release/python build/peers-venv/bin/python tools/peers/foreign.py --json foreign.json
  ... tools/peers/foreign.py --cases cartpole-dqn,hopper-ppo --seeds 5 --json foreign.json
  ... tools/peers/foreign.py --table foreign.json

The Python that runs it needs both libraries (tools/peers/requirements.txt).
Each training is a process with one thread; the sides alternate. The file of --json keeps the results
after each training, and a later call adds the missing ones. A return is the mean of EPISODES episodes
of the last policy without exploration, with start states that no training saw. Seconds are those of
the training with its environment steps, without imports and without this evaluation.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

EPISODES = 20

# Settings of both sides. DQN and SAC make `updates` gradient steps after every `every` steps.
CASES = {
    "cartpole-dqn": {
        "env": "CartPole-v1", "algorithm": "dqn", "steps": 50_000, "hidden": [64, 64], "rate": 1e-3,
        "batch": 64, "replay": 50_000, "starts": 1000, "every": 4, "gamma": 0.99,
        "target_every": 500, "epsilon_end": 0.05},
    "cartpole-ppo": {
        "env": "CartPole-v1", "algorithm": "ppo", "steps": 50_000, "hidden": [64, 64], "rate": 3e-4,
        "envs": 8, "horizon": 128, "batch": 256, "epochs": 10, "gamma": 0.99, "lambda": 0.95},
    "lander-ppo": {
        "env": "LunarLander-v3", "continuous": True, "algorithm": "ppo", "steps": 100_000,
        "hidden": [64, 64], "rate": 3e-4, "envs": 8, "horizon": 256, "batch": 64, "epochs": 10,
        "gamma": 0.99, "lambda": 0.95},
    "mountain-car-sac": {
        "env": "MountainCarContinuous-v0", "algorithm": "sac", "steps": 10_000, "hidden": [64, 64],
        "rate": 1e-3, "batch": 256, "replay": 50_000, "starts": 1000, "every": 1, "gamma": 0.99,
        "tau": 0.005},
    "lander-sac": {
        "env": "LunarLander-v3", "continuous": True, "algorithm": "sac", "steps": 20_000,
        "hidden": [64, 64], "rate": 1e-3, "batch": 256, "replay": 50_000, "starts": 1000, "every": 1,
        "gamma": 0.99, "tau": 0.005},
    "cheetah-sac": {
        "env": "HalfCheetah-v5", "algorithm": "sac", "steps": 5_000, "hidden": [256, 256],
        "rate": 3e-4, "batch": 256, "replay": 50_000, "starts": 1000, "every": 1, "gamma": 0.99,
        "tau": 0.005},
    "hopper-ppo": {
        "env": "Hopper-v5", "algorithm": "ppo", "steps": 51_200, "hidden": [64, 64], "rate": 3e-4,
        "envs": 1, "horizon": 2048, "batch": 64, "epochs": 10, "gamma": 0.99, "lambda": 0.95},
}
SIDES = ["upswing", "stable-baselines3"]


def make(case):
    """One environment of the case."""
    import gymnasium  # pylint: disable=import-outside-toplevel
    more = {"continuous": True} if case.get("continuous") else {}
    return gymnasium.make(case["env"], **more)


def mean_return(case, act):
    """Mean return of a policy, a function from observations (1, D) to actions."""
    import numpy as np  # pylint: disable=import-outside-toplevel
    env, returns = make(case), []
    for episode in range(EPISODES):
        obs, _ = env.reset(seed=10**6 + episode)
        total, ended = 0.0, False
        while not ended:
            obs, reward, terminated, truncated, _ = env.step(act(np.asarray(obs)[None]))
            total, ended = total + float(reward), terminated or truncated
        returns.append(total)
    return statistics.fmean(returns)


def upswing_settings(case):
    """The case in the words of upswing.train."""
    common = {"hidden": case["hidden"], "batch": case["batch"], "gamma": case["gamma"],
              "learning_rate": case["rate"], "learning_rate_end": case["rate"], "layer_norm": False,
              "steps": case["steps"], "num_envs": case.get("envs", 1), "threads": 1,
              "eval_every": 10**9, "eval_episodes": 1}
    if case["algorithm"] == "ppo":
        return common | {"horizon": case["horizon"], "epochs": case["epochs"],
                         "lambda": case["lambda"], "activation": "tanh"}
    common |= {"replay": case["replay"], "learning_starts": case["starts"], "n_step": 1,
               "prioritized": False, "updates_per_step": 1 / case["every"], "policy_tau": 1}
    if case["algorithm"] == "dqn":
        return common | {"double": False, "dueling": False, "tau": 0,
                         "target_period": case["target_every"] // case["every"],
                         "epsilon_end": case["epsilon_end"], "epsilon_decay": 0.98}
    return common | {"tau": case["tau"], "alpha": 1.0, "alpha_rate": case["rate"],
                     "max_gradient_norm": 1e9}


def train_upswing(case, seed):
    """Trains with Upswing. Returns the policy as a function."""
    import upswing  # pylint: disable=import-outside-toplevel
    training = upswing.train(case["algorithm"], env=lambda: make(case), seed=seed, progress=False,
                             **upswing_settings(case))
    discrete = case["env"].startswith("CartPole")
    return lambda obs: (int if discrete else lambda x: x.astype("float32"))(
        training.last.act(obs)[0] if not discrete else training.last.act(obs)[0, 0])


def train_sb3(case, seed):
    """Trains with Stable-Baselines3. Returns the policy as a function."""
    import stable_baselines3 as sb3  # pylint: disable=import-outside-toplevel
    import torch  # pylint: disable=import-outside-toplevel
    from stable_baselines3.common.env_util import make_vec_env  # pylint: disable=import-outside-toplevel
    torch.set_num_threads(1)
    env = make_vec_env(lambda: make(case), case.get("envs", 1), seed=seed)
    activation = torch.nn.Tanh if case["algorithm"] == "ppo" else torch.nn.ReLU
    common = {"policy": "MlpPolicy", "env": env, "seed": seed, "device": "cpu",
              "learning_rate": case["rate"], "batch_size": case["batch"], "gamma": case["gamma"],
              "policy_kwargs": {"net_arch": case["hidden"], "activation_fn": activation}}
    if case["algorithm"] == "ppo":
        model = sb3.PPO(n_steps=case["horizon"], n_epochs=case["epochs"],
                        gae_lambda=case["lambda"], **common)
    else:
        common |= {"buffer_size": case["replay"], "learning_starts": case["starts"],
                   "train_freq": case["every"], "gradient_steps": 1}
        if case["algorithm"] == "dqn":
            model = sb3.DQN(target_update_interval=case["target_every"], tau=1.0,
                            exploration_final_eps=case["epsilon_end"], exploration_fraction=0.1,
                            **common)
        else:
            model = sb3.SAC(tau=case["tau"], ent_coef="auto", **common)
    model.learn(case["steps"])
    return lambda obs: model.predict(obs, deterministic=True)[0][0]


def one(side, name, seed):
    """Trains once and prints the result as a JSON line."""
    case = CASES[name]
    if side == "upswing":
        import upswing  # noqa: F401  pylint: disable=import-outside-toplevel,unused-import
        train = train_upswing
    else:
        import stable_baselines3  # noqa: F401  pylint: disable=import-outside-toplevel,unused-import
        train = train_sb3
    make(case).reset()  # imports of the environment
    wall, cpu = time.perf_counter(), time.process_time()
    policy = train(case, seed)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    print(json.dumps({"side": side, "case": name, "seed": seed, "cpu_seconds": cpu,
                      "seconds": wall, "return": mean_return(case, policy)}))


def measure(cases, sides, seeds, path):
    """Runs the missing trainings, each in a process. Returns all results."""
    results = json.loads(path.read_text()) if path.exists() else []
    for seed in range(1, seeds + 1):
        for name in cases:
            for side in sides if seed % 2 else sides[::-1]:
                if any((r["side"], r["case"], r["seed"]) == (side, name, seed) for r in results):
                    continue
                command = [sys.executable, __file__, "--one", side, name, str(seed)]
                done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False,
                                      env=os.environ | {"OMP_NUM_THREADS": "1"})
                if done.returncode != 0:
                    sys.exit(f"{side} {name}: {done.stderr.strip().splitlines()[-1]}")
                results.append(json.loads(done.stdout.splitlines()[-1])
                               | {"load": os.getloadavg()[0]})
                path.write_text(json.dumps(results, indent=1) + "\n")
                print(results[-1], file=sys.stderr, flush=True)
    return results


def table(results):
    """The results as a Markdown table."""
    print("| environment | agent | steps | seeds | return, Upswing | return, SB3 | CPU s, Upswing "
          "| CPU s, SB3 | ratio |\n|---|---|---|---|---|---|---|---|---|")
    for name, case in CASES.items():
        rows = {side: [r for r in results if (r["side"], r["case"]) == (side, name)]
                for side in SIDES}
        seeds = set.intersection(*({r["seed"] for r in own} for own in rows.values()))
        rows = {side: [r for r in own if r["seed"] in seeds] for side, own in rows.items()}
        count = len(seeds)
        if count == 0:
            continue
        returns, seconds = {}, {}
        for side, own in rows.items():
            values = [r["return"] for r in own]
            spread = statistics.stdev(values) if len(values) > 1 else 0
            returns[side] = f"{round(statistics.fmean(values))} ± {spread:.0f}"
            seconds[side] = statistics.fmean(r["cpu_seconds"] for r in own)
        print(f"| {case['env']}{' (continuous)' if case.get('continuous') else ''} "
              f"| {case['algorithm'].upper()} | {case['steps']:,} | {count} "
              f"| {' | '.join(returns[s] for s in SIDES)} "
              f"| {' | '.join(f'{seconds[s]:.1f}' for s in SIDES)} "
              f"| {seconds[SIDES[1]] / seconds[SIDES[0]]:.1f} |")


def main():
    """Reads the arguments."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", default=",".join(CASES), help="cases to run (default all)")
    parser.add_argument("--sides", default=",".join(SIDES), help="sides to run (default both)")
    parser.add_argument("--seeds", type=int, default=5, help="number of seeds (default 5)")
    parser.add_argument("--json", type=Path, help="file of the results, to write or to add to")
    parser.add_argument("--table", type=Path, nargs="+",
                        help="files of results to print, without trainings")
    parser.add_argument("--one", nargs=3, metavar=("SIDE", "CASE", "SEED"),
                        help="train once and print a JSON line")
    a = parser.parse_args()
    if a.one:
        one(a.one[0], a.one[1], int(a.one[2]))
    elif a.table:
        table([result for path in a.table for result in json.loads(path.read_text())])
    elif a.json:
        table(measure(a.cases.split(","), a.sides.split(","), a.seeds, a.json))
    else:
        parser.error("expected --json FILE or --table FILE")


if __name__ == "__main__":
    main()
