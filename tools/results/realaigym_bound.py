#!/usr/bin/env python3
"""Searches the best performance score of RealAIGym by direct optimisation.

The unknowns are the motion and torques of a swing-up that ends upright at rest within --seconds. The
cost is the sum of the score's penalties. The constraints are the equations of motion in Runge-Kutta
steps of 4 ms. Each start from random torques finds a local optimum. Needs `pip install casadi`.

    python3 tools/results/realaigym_bound.py pendubot --starts 40
"""

import argparse

import casadi as ca
import numpy as np

H = 0.004  # step, s; the boards' step is 0.002 s
RULE_STEPS = 4999  # of the boards' simulation, for the variance of the torque's change
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
    x, u = ca.SX.sym("x", 4), ca.SX.sym("u")
    k1 = derivative(x, u, joint)
    k2 = derivative(x + H / 2 * k1, u, joint)
    k3 = derivative(x + H / 2 * k2, u, joint)
    k4 = derivative(x + H * k3, u, joint)
    return ca.Function("step", [x, u], [x + H / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])


class Problem:
    def __init__(self, joint, seconds):
        self.steps = n = round(seconds / H)
        step = runge_kutta(joint)
        self.follow = step.mapaccum(n)
        x, u = ca.MX.sym("x", 4, n + 1), ca.MX.sym("u", 1, n)
        costs = ca.MX.sym("costs", 4)  # energy, torque cost, smoothness, velocity cost
        goal = ca.MX.sym("goal", 2)
        angle = x[joint - 1, :]
        energy = ca.sum2(ca.sqrt(((angle[1:] - angle[:-1]) * u) ** 2 + 1e-11))
        change = ca.horzcat(u[1:] - u[:-1], -u[n - 1])
        # A change in 4 ms counts as two changes of half its size in 2 ms.
        variance = ca.sum2(change**2) / 2 / RULE_STEPS - (u[0] / RULE_STEPS) ** 2
        sums = [energy, H * ca.sum2(u**2), variance * 1e4, H * ca.sum2(x[2, :] ** 2 + x[3, :] ** 2)]
        own = [costs[0], costs[1], costs[2] ** 2 * 1e4, costs[3]]
        tip = -L1 * ca.cos(x[0, :]) - L2 * ca.cos(x[0, :] + x[1, :])
        constraints = ca.horzcat(
            ca.reshape(x[:, 1:] - step.map(n)(x[:, :n], u), 1, 4 * n), x[:, 0].T,
            (x[:2, n] - goal).T, x[2:, n].T, *[a - b for a, b in zip(sums, own)], tip)
        unknowns = ca.vertcat(ca.vec(x), ca.vec(u), costs)
        scale = np.array([60, 20, 0.1, 400])
        penalties = ca.tanh(ca.pi * costs / scale)
        self.penalties = ca.Function("penalties", [unknowns], [penalties])
        self.count = constraints.shape[1]
        self.low = np.r_[np.full(4 * (n + 1), -60), np.full(n, -6), np.full(4, 1e-5)]
        self.high = np.r_[np.full(4 * (n + 1), 60), np.full(n, 6), np.full(4, 1e4)]
        self.solver = ca.nlpsol(
            "solver", "ipopt",
            {"x": unknowns, "f": ca.sum1(penalties), "g": constraints.T, "p": goal},
            {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.max_iter": 400,
             "ipopt.tol": 1e-4, "ipopt.max_cpu_time": 25.0, "ipopt.mu_strategy": "adaptive"})

    def first_guess(self, rng, line):
        """A first guess: a sine of torque until step `line`, and the motion under it, bent to a
        goal."""
        t = np.arange(self.steps) * H
        u = rng.uniform(0.5, 4) * np.sin(2 * np.pi * (rng.uniform(0.4, 1.6) * t + rng.uniform()))
        u *= np.arange(self.steps) < line
        x = np.c_[np.zeros(4), np.array(self.follow(np.zeros(4), u[None, :]))]
        goal = np.array([np.pi * rng.choice([-1, 1]), 2 * np.pi * rng.choice([-1, 0, 0, 1])])
        share = np.clip(np.arange(self.steps + 1) / line, 0, 1) ** 2
        x[:2] = (1 - share) * x[:2] + share * goal[:, None]
        x[2:] *= 1 - share
        return np.r_[x.T.ravel(), u, 8, 4, 0.02, 80], goal

    def improve(self, rng):
        """The best result over a few times from which the tip is above the line; None if nothing is
        found."""
        line = round(rng.uniform(0.5, min(2.6, self.steps * H - 0.4)) / H)
        z, goal = self.first_guess(rng, line)
        best = None
        for attempt in range(6):
            low, high = np.zeros(self.count), np.zeros(self.count)
            low[-(self.steps + 1):], high[-(self.steps + 1):] = -1, 1
            low[-(self.steps + 1) + line:] = LINE + 1e-4
            z = np.array(self.solver(x0=z, p=goal, lbg=low, ubg=high, lbx=self.low,
                                     ubx=self.high)["x"]).ravel()
            if not self.solver.stats()["success"]:
                break
            q = z[:4 * (self.steps + 1)].reshape(-1, 4)[:, :2]
            above = -L1 * np.cos(q[:, 0]) - L2 * np.cos(q.sum(axis=1)) > LINE
            line = int(np.flatnonzero(~above)[-1]) + 1
            penalties = np.r_[np.tanh(np.pi * line * H / 20), np.array(self.penalties(z)).ravel()]
            score = 1 - penalties.sum() / 5
            if best is not None and score < best[0] + 1e-4:
                break
            best = score, line * H, penalties
            if attempt:
                line += int(rng.integers(-20, 21))
        return best


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robot", choices=["pendubot", "acrobot"], help="robot of the benchmark")
    parser.add_argument("--starts", type=int, default=40,
                        help="number of random starts (default 40)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the starts (default 1)")
    parser.add_argument("--seconds", type=float, default=2.4,
                        help="time of the swing-up [s] (default 2.4)")
    a = parser.parse_args()
    problem = Problem(1 if a.robot == "pendubot" else 2, a.seconds)
    rng = np.random.default_rng(a.seed)
    print("start  S      time s   penalties: time, energy, torque cost, smoothness, velocity cost")
    best = 0
    for start in range(a.starts):
        found = problem.improve(rng)
        if found is None:
            continue
        best = max(best, found[0])
        print(f"{start:5}  {found[0]:.4f} {found[1]:6.2f}     "
              + "  ".join(f"{p:.3f}" for p in found[2]), flush=True)
    print(f"best   {best:.4f}")


if __name__ == "__main__":
    main()
