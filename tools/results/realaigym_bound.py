#!/usr/bin/env python3
"""Finds what optimal swing-ups would score on RealAIGym, version 3, after the resets of given runs.

A run's log (`upswing realaigym score … --csv run.csv`) has the state in which each reset ends. From there,
direct optimisation minimises the time after which the tip stays above the line until rest at upright.
The start of each solution is a straight line to one of six goals (turns of both joints), or the run's
own motion. The optima are local, so the best possible score is at least the printed one. The time lost
within resets is that of the run. Needs `pip install casadi`.

    python3 tools/results/realaigym_bound.py pendubot run.csv
"""

import argparse
import itertools

import casadi as ca
import numpy as np

N1, N2 = 30, 14  # steps until the tip is above the line, and from there to rest
STEP = 0.002  # of a log, s
LINE = 0.45  # m

M1, M2, L1, L2 = 0.5234602302310271, 0.6255677234174437, 0.2, 0.3
R1, R2 = 0.2, 0.25569305436052964
I1, I2, G = 0.031887199591513114, 0.05086984812807257, 9.81


def derivative(x, u, joint):
    """The derivative of the state (q1, q2, w1, w2) under a torque about a joint."""
    q1, q2, w1, w2 = x[0], x[1], x[2], x[3]
    b = M2 * L1 * R2
    m11, m12, m22 = I1 + I2 + M2 * L1**2 + 2 * b * ca.cos(q2), I2 + b * ca.cos(q2), I2
    g2 = G * M2 * R2 * ca.sin(q1 + q2)
    f1 = b * ca.sin(q2) * (2 * w1 + w2) * w2 - G * (M1 * R1 + M2 * L1) * ca.sin(q1) - g2
    f2 = -b * ca.sin(q2) * w1**2 - g2
    f1, f2 = (f1 + u, f2) if joint == 1 else (f1, f2 + u)
    det = m11 * m22 - m12**2
    return ca.vertcat(w1, w2, (m22 * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det)


def runge_kutta(joint):
    """Two steps of Runge-Kutta over h seconds."""
    x, u, h = ca.SX.sym("x", 4), ca.SX.sym("u"), ca.SX.sym("h")
    y = x
    for _ in range(2):
        k1 = derivative(y, u, joint)
        k2 = derivative(y + h / 4 * k1, u, joint)
        k3 = derivative(y + h / 4 * k2, u, joint)
        k4 = derivative(y + h / 2 * k3, u, joint)
        y = y + h / 12 * (k1 + 2 * k2 + 2 * k3 + k4)
    return ca.Function("step", [x, u, h], [y])


def tip(q):
    return -L1 * np.cos(q[:, 0]) - L2 * np.cos(q[:, 0] + q[:, 1])


class Problem:
    """The fastest way above the line. Unknowns: states, torques, and the times before and after."""

    def __init__(self, joint):
        n = N1 + N2
        x, u = ca.MX.sym("x", 4, n + 1), ca.MX.sym("u", 1, n)
        times, given = ca.MX.sym("times", 2), ca.MX.sym("given", 6)  # start state, goal's angles
        h = ca.horzcat(ca.repmat(times[0] / N1, 1, N1), ca.repmat(times[1] / N2, 1, N2))
        after = x[:, N1:]
        height = -L1 * ca.cos(after[0, :]) - L2 * ca.cos(after[0, :] + after[1, :])
        constraints = ca.vertcat(
            ca.vec(x[:, 1:] - runge_kutta(joint).map(n)(x[:, :n], u, h)), x[:, 0] - given[:4],
            x[:2, n] - given[4:], x[2:, n], height.T)
        zeros = np.zeros(4 * n + 8)
        self.limits = {
            "lbg": np.r_[zeros, np.full(N2 + 1, LINE)], "ubg": np.r_[zeros, np.full(N2 + 1, 1)],
            "lbx": np.r_[np.full(4 * (n + 1), -80), np.full(n, -6), 0.004, 0.05],
            "ubx": np.r_[np.full(4 * (n + 1), 80), np.full(n, 6), 3, 0.8]}
        self.solver = ca.nlpsol(
            "solver", "ipopt", {"x": ca.vertcat(ca.vec(x), ca.vec(u), times), "f": times[0],
                                "g": constraints, "p": given},
            {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.max_iter": 250,
             "ipopt.tol": 1e-4, "ipopt.max_cpu_time": 4.0, "ipopt.mu_strategy": "adaptive"})

    def seconds(self, start, goal, states, torques, times):
        """The least time found until the tip stays above the line; infinite if nothing is found."""
        found = self.solver(x0=np.r_[states.ravel(), torques, times], p=np.r_[start, goal],
                            **self.limits)
        return float(found["x"][-2]) if self.solver.stats()["success"] else np.inf

    def best(self, start):
        """The least time over the nearest goals."""
        turn = 2 * np.pi
        first, second = np.floor(start[0] / turn - 0.5), np.round(start[1] / turn)
        share = np.r_[np.linspace(0, 1, N1 + 1), np.ones(N2)][:, None]
        times = []
        for i, j in itertools.product((0, 1), (-1, 0, 1)):
            goal = turn * np.array([first + i + 0.5, second + j])
            states = np.hstack([(1 - share) * start[:2] + share * goal, (1 - share) * start[2:]])
            times.append(self.seconds(start, goal, states, np.zeros(N1 + N2), (0.4, 0.3)))
        return min(times)

    def improved(self, start, rows, joint, last):
        """The least time from a run's own motion, which is above the line `last` seconds after the
        start."""
        place = np.r_[np.linspace(0, last, N1 + 1), last + np.linspace(0, 0.3, N2 + 1)[1:]] / STEP
        place = np.minimum(np.round(place).astype(int), len(rows) - 1)
        states = rows[place, 1:5]
        end = states[-1] / (2 * np.pi)
        goal = 2 * np.pi * np.array([np.round(end[0] - 0.5) + 0.5, np.round(end[1])])
        return self.seconds(start, goal, states, rows[place[:-1], 4 + joint], (last, 0.3))


def bound(problem, joint, path):
    """The score of a run, and the score with the best swing-ups found."""
    rows = np.genfromtxt(path, delimiter=",", skip_header=1)
    up = tip(rows[:, 1:3]) > LINE
    # Both motors act in resets.
    reset = np.r_[False, rows[:, 7 - joint] != 0, False]
    begins, ends = np.flatnonzero(reset[1:] & ~reset[:-1]), np.flatnonzero(~reset[1:] & reset[:-1])
    lost = own = sum((~up[i:j]).sum() for i, j in zip(begins, ends)) * STEP
    for i, j in zip([0, *ends], [*begins, len(rows)]):
        down = (~up[i:j]).sum() * STEP
        last = (np.flatnonzero(~up[i:j])[-1] + 1) * STEP if down else 0
        best = 0
        if down:
            start = rows[i, 1:5]
            best = min(down, problem.best(start))
            if last < (j - i) * STEP - 0.3:
                best = min(best, problem.improved(start, rows[i:j], joint, last))
        lost, own = lost + best, own + down
    return 1 - own / 60, 1 - lost / 60


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robot", choices=["pendubot", "acrobot"], help="robot of the benchmark")
    parser.add_argument("runs", nargs="+", metavar="RUN.csv", help="logs of runs, score version 3")
    a = parser.parse_args()
    joint = 1 if a.robot == "pendubot" else 2
    problem = Problem(joint)
    scores = []
    for path in a.runs:
        scores.append(bound(problem, joint, path))
        print(f"{path}: {scores[-1][0]:.3f}, with the best swing-ups {scores[-1][1]:.3f}", flush=True)
    print(f"mean of {len(scores)}: {np.mean(scores, 0)[0]:.3f}, {np.mean(scores, 0)[1]:.3f}")


if __name__ == "__main__":
    main()
