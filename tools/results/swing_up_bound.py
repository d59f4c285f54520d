#!/usr/bin/env python3
"""Finds the best known return from the start states of the evaluation, as a reference for agents.

Each episode is optimised directly: the torques of the first 5 s, until rest at upright, which is
held for the rest of the 10 s. The motions of shipped agents and controllers are the initial guesses.
The step from which both links are within 30° of upright is fixed in a solution, and then moved
forward while the return grows. The optima are local: a larger return may exist, so the number is no
upper bound. The best motion is then followed with feedback, and its return counted by the formulas
of docs/reference/task.md in the equations of motion, which have to reproduce the guesses of
`upswing simulate` in MuJoCo. Needs `pip install casadi` and a C compiler.

    python3 tools/results/swing_up_bound.py --episodes 20 --json bound.json
"""

import argparse
import csv
import io
import json
import math
import os
import subprocess
import time
from pathlib import Path

try:
    import casadi as ca
    import numpy as np
except ModuleNotFoundError:
    ca = None  # --help works without

ROOT = Path(__file__).resolve().parents[2]
UPSWING = os.environ.get("UPSWING", str(ROOT / "build/release/bin/upswing"))
GUESSES = ("sac", "d3qn-adaptive", "dueling-dqn", "d3qn", "ppo", "fast", "mpc", "tvlqr")

STEPS, PLANNED = 500, 250  # steps of 0.02 s: of the return, and until rest
AT_REST = 7.0  # reward of a step at rest upright
COSINE = math.cos(math.radians(30)) + 1e-6  # inverted, with room for rounding
LIMIT = 5.0  # N·m
TIMESTEP, SUBSTEPS = 0.005, 4

M, L, DAMPING, G, RADIUS, ARMATURE = 1.0, 0.5, 0.2, 9.81, 0.04, 0.01
# A solid capsule about its centre: a cylinder and two half spheres.
SPHERES = M * (4 / 3 * RADIUS) / (4 / 3 * RADIUS + L)
INERTIA = ((M - SPHERES) * (L**2 / 12 + RADIUS**2 / 4)
           + SPHERES * (0.4 * RADIUS**2 + L**2 / 4 + 3 / 8 * L * RADIUS))
J1 = INERTIA + M * (L / 2)**2 + M * L**2 + ARMATURE
J2 = INERTIA + M * (L / 2)**2
B = M * L * L / 2
G1, G2 = (M * L / 2 + M * L) * G, M * L / 2 * G


def derivative(x, u):
    """The derivative of the state (q1, q2, w1, w2) under a torque of the first joint."""
    q1, q2, w1, w2 = x[0], x[1], x[2], x[3]
    m11, m12, m22 = J1 + J2 + 2 * B * ca.cos(q2), J2 + B * ca.cos(q2), J2 + ARMATURE
    g2 = G2 * ca.sin(q1 + q2)
    f1 = u + B * ca.sin(q2) * (2 * w1 + w2) * w2 - G1 * ca.sin(q1) - g2 - DAMPING * w1
    f2 = -B * ca.sin(q2) * w1**2 - g2 - DAMPING * w2
    det = m11 * m22 - m12**2
    return ca.vertcat(w1, w2, (m22 * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det)


def control_step():
    """The state after a control period, in Runge-Kutta steps as MuJoCo's."""
    x, u, h = ca.SX.sym("x", 4), ca.SX.sym("u"), TIMESTEP
    y = x
    for _ in range(SUBSTEPS):
        k1 = derivative(y, u)
        k2 = derivative(y + h / 2 * k1, u)
        k3 = derivative(y + h / 2 * k2, u)
        k4 = derivative(y + h * k3, u)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return ca.Function("step", [x, u], [y])


def reward_function():
    """The reward of a step to x under u, where `inverted` is 1 or 0."""
    x, u, inverted = ca.SX.sym("x", 4), ca.SX.sym("u"), ca.SX.sym("inverted")
    q1, q2, w1, w2 = x[0], x[1], x[2], x[3]
    potential = -M * G * L / 2 * ca.cos(q1) - M * G * (L * ca.cos(q1) + L / 2 * ca.cos(q1 + q2))
    rod = M * L**2 / 12
    kinetic = (rod * w1**2 / 2 + rod * (w1 + w2)**2 / 2 + M * (L / 2 * w1)**2 / 2
               + M / 2 * (L**2 * w1**2 + (L / 2)**2 * (w1 + w2)**2
                          + L * L * ca.cos(q2) * w1 * (w1 + w2)))
    target = M * G * L / 2 + M * G * (L + L / 2)
    energy = ca.fmin((kinetic + potential + target) / (2 * target), 1.5)
    height = -(ca.cos(q1) + ca.cos(q1 + q2)) / 2
    return ca.Function("reward", [x, u, inverted], [
        energy + (height + 1) / 2 - 0.01 * u**2
        + inverted * (5 - 0.01 * (w1**2 + w2**2) - 0.04 * u**2)])


def is_inverted(x):
    """Whether both links are within 30° of upright; x (… × 4)."""
    return np.maximum(np.cos(x[..., 0]), np.cos(x[..., 0] + x[..., 1])) <= -math.cos(math.pi / 6)


class Problem:
    """The largest return with inverted states from a given step on. Unknowns: states, torques."""

    def __init__(self):
        self.step, self.reward = control_step(), reward_function()
        n = PLANNED
        x, u = ca.MX.sym("x", 4, n + 1), ca.MX.sym("u", 1, n)
        start, goal, inverted = ca.MX.sym("start", 4), ca.MX.sym("goal", 4), ca.MX.sym("i", 1, n)
        after = x[:, 1:]
        rewards = self.reward.map(n)(after, u, inverted)
        free = 3 * (1 - inverted)  # the limits of a state that may be anywhere
        constraints = ca.vertcat(
            ca.vec(after - self.step.map(n)(x[:, :n], u)), x[:, 0] - start, x[:, n] - goal,
            (ca.cos(after[0, :]) - free).T, (ca.cos(after[0, :] + after[1, :]) - free).T)
        exact = np.zeros(4 * n + 8)
        self.limits = {
            "lbg": np.r_[exact, np.full(2 * n, -np.inf)], "ubg": np.r_[exact, np.full(2 * n, -COSINE)],
            "lbx": np.r_[np.full(4 * (n + 1), -80), np.full(n, -LIMIT)],
            "ubx": np.r_[np.full(4 * (n + 1), 80), np.full(n, LIMIT)]}
        self.solver = ca.nlpsol(
            "solver", "ipopt", {"x": ca.vertcat(ca.vec(x), ca.vec(u)), "f": -ca.sum2(rewards),
                                "g": constraints, "p": ca.vertcat(start, goal, inverted.T)},
            {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.max_iter": 80,
             "ipopt.tol": 1e-6, "ipopt.mu_strategy": "adaptive", "jit": True,
             "compiler": "shell", "jit_options": {"flags": ["-O1"], "verbose": False}})
        state, torque = ca.MX.sym("x", 4), ca.MX.sym("u")
        following = self.step(state, torque)
        self.slopes = ca.Function("slopes", [state, torque], [ca.jacobian(following, state),
                                                              ca.jacobian(following, torque)])
        self.solved = 0

    def solve(self, states, torques, goal, first):
        """The best states and torques that are inverted from step `first` on; None: none found."""
        inverted = (np.arange(1, PLANNED + 1) >= first).astype(float)
        found = self.solver(x0=np.r_[states.ravel(), torques], p=np.r_[states[0], goal, inverted],
                            **self.limits)
        self.solved += 1
        if not self.solver.stats()["success"]:
            return None
        z = np.array(found["x"]).ravel()
        return z[:4 * PLANNED + 4].reshape(-1, 4), z[4 * PLANNED + 4:]

    def improve(self, states, torques):
        """The best return found from a motion, and its torques."""
        turn = 2 * math.pi
        first = PLANNED + 1 - int(np.argmin(is_inverted(states[1:])[::-1]))
        goal = np.array([np.round((states[-1, 0] - math.pi) / turn) * turn + math.pi,
                         np.round(states[-1, 1] / turn) * turn, 0, 0])
        best, stride, found = (-math.inf, None), 4, self.solve(states, torques, goal, first)
        while found is not None or stride > 0:
            value = (-math.inf,) if found is None else self.follow(*found)
            if value[0] > best[0]:
                best = value
                states, torques = found
            elif best[1] is None:
                return best
            else:  # the last move went too far
                first += stride
                stride //= 2
                if stride == 0:
                    break
            first -= stride
            found = self.solve(states, torques, goal, first)
        return best

    def gains(self, states, torques):
        """Feedback (T × 4) about a motion: the regulator of the linearised steps."""
        P, K = 100 * np.eye(4), np.zeros((len(torques), 4))
        for t in reversed(range(len(torques))):
            a, b = (np.array(part) for part in self.slopes(states[t], torques[t]))
            K[t] = np.linalg.solve(1 + b.T @ P @ b, b.T @ P @ a)
            P = np.eye(4) + a.T @ P @ (a - b @ K[t:t + 1])
        return K

    def follow(self, states, torques):
        """The return of 10 s along a motion with feedback, and the torques. At rest, it goes on."""
        states = np.vstack([states, np.repeat(states[-1:], STEPS - PLANNED, axis=0)])
        planned = np.r_[torques, np.zeros(STEPS - PLANNED)]
        K, x, applied, total = self.gains(states, planned), states[0], np.zeros(STEPS), 0.0
        for t in range(STEPS):
            applied[t] = np.clip(planned[t] - K[t] @ (x - states[t]), -LIMIT, LIMIT)
            x = np.array(self.step(x, applied[t])).ravel()
            total += float(self.reward(x, applied[t], float(is_inverted(x))))
        # A motion that does not end upright does not count.
        return (total, applied) if is_inverted(x) else (-math.inf, None)

    def check(self, states, torques, rewards):
        """The largest difference between a simulation in MuJoCo and these equations."""
        after = np.array(self.step.map(STEPS)(states[:-1].T, torques[None])).T
        counted = np.array(self.reward.map(STEPS)(
            states[1:].T, torques[None], is_inverted(states[1:])[None].astype(float))).ravel()
        return max(np.abs(after - states[1:]).max(), np.abs(counted - rewards).max())


def motion(policy, episode):
    """States (501 × 4), torques and rewards (500) of the first 10 s of an episode of `eval`."""
    table = subprocess.run([UPSWING, "simulate", policy, "--episode", str(episode), "--seconds", "10"],
                           check=True, capture_output=True, text=True, cwd=ROOT).stdout
    rows = list(csv.DictReader(io.StringIO(table)))
    columns = [[float(row[name]) for row in rows]
               for name in ("q1", "q2", "w1", "w2", "torque", "reward")]
    return np.array(columns[:4]).T, np.array(columns[4][:-1]), np.array(columns[5][:-1])


def best_of_episode(problem, episode, guesses):
    """The returns of the guesses and the best return found from each."""
    known, found = {}, {}
    motions = {policy: motion(policy, episode) for policy in guesses}
    for policy, (states, torques, rewards) in motions.items():
        error = problem.check(states, torques, rewards)
        if error > 1e-6:
            raise SystemExit(f"{policy}, episode {episode}: differs from MuJoCo by {error:g}")
        known[policy] = float(rewards.sum())
        if is_inverted(states[PLANNED]):
            found[policy] = problem.improve(states[:PLANNED + 1], torques[:PLANNED])[0]
    return known, found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0, help="first episode")
    parser.add_argument("--episodes", type=int, default=20, help="number of episodes")
    parser.add_argument("--guesses", nargs="+", default=GUESSES, metavar="POLICY",
                        help="policies whose motions are the initial guesses")
    parser.add_argument("--json", metavar="FILE", help="file for the returns of each episode")
    a = parser.parse_args()
    if ca is None:
        parser.error("expected the package casadi, found none: pip install casadi")
    if a.episodes < 1:
        parser.error(f"--episodes: expected 1 or more, got {a.episodes}")
    problem, begin, rows = Problem(), time.process_time(), []
    for episode in range(a.first, a.first + a.episodes):
        known, found = best_of_episode(problem, episode, a.guesses)
        rows.append({"episode": episode, "known": known, "found": found})
        if not found:
            parser.error(f"episode {episode}: expected a guess that is upright after 5 s, got none")
        best = max(found, key=found.get)
        print(f"episode {episode}: {found[best]:.1f} from {best}, "
              f"best guess {max(known.values()):.1f}; all: "
              + ", ".join(f"{value:.0f}" for value in found.values()), flush=True)
        if a.json:
            Path(a.json).write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    best = [max([*row["found"].values(), *row["known"].values()]) for row in rows]
    print(f"best known return of {len(best)} episodes: mean {np.mean(best):.1f}, standard deviation "
          f"{np.std(best, ddof=1) if len(best) > 1 else 0:.1f}; {problem.solved} solutions, "
          f"{time.process_time() - begin:.0f} s of processor time")


if __name__ == "__main__":
    main()
