#!/usr/bin/env python3
"""Compares the decisions of `mpc` with those of Fatrop, a solver of optimal control problems.

`mpc` improves its previous plan in two iterations. Fatrop solves the same problem from the same states to its end:
the same cost over 2.5 s, the same torque limit, the equations of motion in the steps of MuJoCo. Both swing up and
balance the links in a loop from the start states of `eval`. The cost of a motion is that of 10 s. Needs
`pip install casadi` and a C compiler.

    python3 tools/peers/mpc.py                 five episodes
    python3 tools/peers/mpc.py --episodes 20
"""

import argparse
import math
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "results"))
from swing_up_bound import LIMIT, STEPS, ca, control_step, motion  # noqa: E402

try:
    import numpy as np
except ModuleNotFoundError:
    pass  # --help works without

HORIZON, SWING_UP = 125, 150  # control periods: of a plan, and of the swing-up with its end at rest
Q, R = (10, 10, 1, 1), 1  # weights of the deviation from upright and of the torque, as in LqrConfig
TURN = 2 * math.pi


def final_weights(step):
    """P (4 × 4) of the regulator's cost x' P x: the fixed point of the Riccati equation."""
    x, u = ca.MX.sym("x", 4), ca.MX.sym("u")
    slopes = ca.Function("slopes", [x, u], [ca.jacobian(step(x, u), x), ca.jacobian(step(x, u), u)])
    A, B = (np.array(part) for part in slopes([np.pi, 0, 0, 0], 0))
    P = np.diag(Q).astype(float)
    for _ in range(2000):
        K = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
        P = np.diag(Q) + A.T @ P @ (A - B @ K)
    return P


def nearest_upright(states):
    """The upright states (… × 4) that are nearest to the states, with their full turns."""
    goals = np.zeros_like(states)
    goals[..., 0] = np.round((states[..., 0] - np.pi) / TURN) * TURN + np.pi
    goals[..., 1] = np.round(states[..., 1] / TURN) * TURN
    return goals


class Problem:
    """The problem of one decision. Unknowns: x_0, u_0, x_1, u_1, …, x_T."""

    def __init__(self):
        self.step = control_step()
        self.P = final_weights(self.step)
        T, weights = HORIZON, ca.DM(np.diag(Q))
        start, goals = ca.MX.sym("start", 4), ca.MX.sym("goals", 4, T + 1)
        unknowns, constraints, cost, x = [], [], 0, ca.MX.sym("x", 4)
        for t in range(T):
            u, following = ca.MX.sym("u"), ca.MX.sym("x", 4)
            unknowns += [x, u]
            constraints.append(following - self.step(x, u))
            if t == 0:  # Fatrop finds stages by this order: the step, then what else holds at its begin
                constraints.append(x - start)
            d = x - goals[:, t]
            cost += d.T @ weights @ d + R * u**2
            x = following
        d = x - goals[:, T]
        cost += d.T @ ca.DM(self.P) @ d
        unknowns.append(x)
        g = ca.vertcat(*constraints)
        self.solver = ca.nlpsol("solver", "fatrop", {
            "x": ca.vertcat(*unknowns), "f": cost, "g": g, "p": ca.vertcat(start, ca.vec(goals))}, {
            "structure_detection": "auto", "equality": [True] * g.numel(), "print_time": False,
            "fatrop.print_level": 0, "fatrop.tol": 1e-6, "fatrop.max_iter": 200, "jit": True,
            "compiler": "shell", "jit_options": {"flags": ["-O3", "-march=native"], "verbose": False}})
        self.bounds = np.full(5 * T + 4, np.inf)
        self.bounds[4:5 * T:5] = LIMIT

    def solve(self, start, states, torques):
        """The best states (T + 1 × 4) and torques (T) from a guess, their cost, and whether the solver ended."""
        goals = nearest_upright(states)
        guess = np.r_[np.c_[states[:-1], torques].ravel(), states[-1]]
        found = self.solver(x0=guess, p=np.r_[start, goals.ravel()], lbx=-self.bounds, ubx=self.bounds,
                            lbg=0, ubg=0)
        z = np.array(found["x"]).ravel()
        rows = z[:-4].reshape(-1, 5)
        return np.vstack([rows[:, :4], z[-4:]]), rows[:, 4], float(found["f"]), self.solver.stats()["success"]

    def cost(self, states, torques, final=False):
        """The cost of a motion: states (n + 1 × 4) or (n × 4), torques (n). `final` adds that of its end."""
        d = states - nearest_upright(states)
        total = float(np.sum(d[:len(torques)]**2 @ np.array(Q)) + R * np.sum(np.square(torques)))
        return total + float(d[-1] @ self.P @ d[-1]) if final else total


def drive(problem, states, torques):
    """Lets the solver drive from the first state, with a motion of `mpc` as the guess of its first plan. The states
    (501 × 4), torques (500), and the seconds of each decision."""
    x, plan = states[0], (states[:HORIZON + 1], torques[:HORIZON])
    driven, applied, seconds = [x], [], []
    for _ in range(STEPS):
        begin = time.process_time()
        planned, u, _, ended = problem.solve(x, *plan)
        seconds.append(time.process_time() - begin)
        if not ended:
            raise SystemExit(f"step {len(applied)}: Fatrop found no solution")
        applied.append(float(np.clip(u[0], -LIMIT, LIMIT)))
        x = np.array(problem.step(x, applied[-1])).ravel()
        driven.append(x)
        plan = np.vstack([planned[1:], planned[-1:]]), np.r_[u[1:], u[-1]]
    return np.array(driven), np.array(applied), np.array(seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=5, help="number of episodes of eval (default 5)")
    a = parser.parse_args()
    if ca is None:
        parser.error("expected the package casadi, found none: pip install casadi")
    if a.episodes < 1:
        parser.error(f"--episodes: expected 1 or more, got {a.episodes}")
    problem = Problem()
    excess, differences, ratios, seconds = [], [], [], []
    for episode in range(a.episodes):
        states, torques, _ = motion("mpc", episode)
        # What `mpc` did over a horizon, next to the best motion from the same state that the solver finds.
        for t in range(0, SWING_UP, 5):
            here, done = states[t:t + HORIZON + 1], torques[t:t + HORIZON]
            _, best, cost, ended = problem.solve(here[0], here, done)
            if not ended:
                raise SystemExit(f"episode {episode}, step {t}: Fatrop found no solution")
            excess.append(problem.cost(here, done, final=True) / cost - 1)
            differences.append(done[0] - best[0])
        driven, applied, spent = drive(problem, states, torques)
        ratios.append(problem.cost(states, torques) / problem.cost(driven, applied))
        seconds.append(spent)
        print(f"episode {episode}: cost of 10 s {problem.cost(states, torques):.0f} with mpc, "
              f"{problem.cost(driven, applied):.0f} with Fatrop; upright at the end: "
              f"{bool(np.abs(driven[-1] - nearest_upright(driven[-1])).max() < 0.05)}", flush=True)
    excess, milliseconds = 100 * np.array(excess), 1e3 * np.concatenate(seconds)
    print(f"cost of mpc's motions above the solver's, first 3 s: median {np.median(excess):.3f}%, "
          f"largest {excess.max():.2f}%, {len(excess)} states")
    print(f"first torques differ by {np.sqrt(np.mean(np.square(differences))):.3f} N·m rms")
    print(f"cost of 10 s, mpc over Fatrop: median {np.median(ratios):.4f}, {min(ratios):.4f} to {max(ratios):.4f}")
    print(f"decision of Fatrop: median {np.median(milliseconds):.1f} ms, longest {milliseconds.max():.1f} ms")


if __name__ == "__main__":
    main()
