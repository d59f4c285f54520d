"""Double pendulums of many sizes, simulated together: the truth behind the logs of logs.py.

The equations are those of src/pendulum/equations.h with constants J1, J2, b, a, G1, G2, d1, d2, f1, f2. All
machines of a batch take their steps at once. Times of a machine count in its natural time T, the root of
inertia over gravity.
"""

import math

import numpy as np

G = 9.81
DRIVES = ("both", "joint 1", "joint 2", "free")
SIGNALS = ("sines", "steps", "pump")
LEVELS = 400  # random steps of a torque
MOST_ROWS = 12000  # of a log
FAST = 8  # rad in a natural time, above which the motors brake


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def draw_plant(rng):
    """Links of 5 cm to 2 m with drawn shapes, in SI units: constants of the motion, natural time, and the links'
    values in a plant file."""
    l1 = log_uniform(rng, 0.05, 2)
    l2 = l1 * rng.uniform(0.5, 1.5)
    m1, m2 = 2 * (l1 / 0.2) ** 2 * rng.uniform(0.15, 0.5, 2)
    c1, c2 = l1 * rng.uniform(0.4, 1), l2 * rng.uniform(0.4, 1)
    i1, i2 = m1 * l1**2 * rng.uniform(0.02, 0.1), m2 * l2**2 * rng.uniform(0.02, 0.1)
    p = {"J1": i1 + m1 * c1**2 + m2 * l1**2, "J2": i2 + m2 * c2**2, "b": m2 * l1 * c2,
         "G1": G * (m1 * c1 + m2 * l1), "G2": G * m2 * c2}
    p["a"] = rng.uniform(0, 0.3) * p["J2"]
    p["J1"] += p["a"]  # both joints have the same rotor, as in a plant file
    inertia = p["J1"] + p["J2"] + 2 * p["b"]
    time = math.sqrt(inertia / (p["G1"] + p["G2"]))
    p |= {"d1": rng.uniform(0.002, 0.05) * inertia / time, "d2": rng.uniform(0.002, 0.05) * p["J2"] / time,
          "f1": rng.uniform(0, 0.04) * (p["G1"] + p["G2"]), "f2": rng.uniform(0, 0.04) * p["G2"]}
    links = {"mass1": m1, "mass2": m2, "length1": l1, "length2": l2, "center1": c1, "center2": c2,
             "inertia1": i1, "inertia2": i2}
    return p, time, links


def draw_machine(seed, number, drive):
    """A machine with its motion: plant, natural time T [s], rate, drive, signal and start. `seed`: list of numbers."""
    rng = np.random.default_rng([*seed, number])
    plant, time, links = draw_plant(rng)
    if drive == "free":
        plant["f1"] /= 3
        plant["f2"] /= 3
    gravity = np.array([plant["G1"] + plant["G2"], plant["G2"]])
    on = np.array([drive in ("both", "joint 1"), drive in ("both", "joint 2")])
    limit = gravity * rng.uniform(0.3, 1, 2) * on
    start = rng.uniform(0.8, 2.8, 2) * rng.choice([-1, 1], 2) if drive == "free" else np.zeros(2)
    seconds = time * (rng.uniform(30, 100) if drive == "free" else rng.uniform(60, 200))
    # At least four rows in a natural time, which are 25 in a swing, and no more than MOST_ROWS.
    slowest, fastest = max(50, 4 / time), min(2000, MOST_ROWS / seconds)
    cycle = 1 / log_uniform(rng, slowest, max(slowest, fastest))
    rows = int(seconds / cycle)
    machine = {
        "number": number, "plant": plant, "links": links, "T": time, "cycle": cycle, "rows": rows, "drive": drive,
        "substeps": max(1, math.ceil(cycle / (0.02 * time))), "limit": limit, "start": start,
        "gravity": gravity, "signal": SIGNALS[rng.integers(3)],
        "sines": (rng.uniform(0.3, 1.6, (2, 3)) / time, rng.uniform(0, 2 * math.pi, (2, 3))),
        "levels": rng.uniform(-1, 1, (LEVELS, 2)), "hold": rng.uniform(0.5, 3) * time,
        "turn": rng.uniform(8, 20) * time,
        "delay": rng.uniform(0, min(1, 0.05 * time / cycle)),  # cycles
        "lag": rng.uniform(0, 0.03) * time,
        "jitter": rng.choice([0, 0, 0.05, 0.2]) * rng.uniform(0, 1),  # of a cycle
        # Faults of the motors: the torque that arrives is not the commanded one.
        "gain": np.ones(2), "largest": np.full(2, np.inf), "dead": np.zeros(2), "dead_steps": False,
    }
    machine["cycles"] = cycle * (1 + machine["jitter"] * rng.uniform(-1, 1, rows + 1))
    return machine


def arriving(m, u):
    """The torque of motors with faults for a command; arrays of joints, or of machines × joints."""
    size = np.abs(u)
    beyond = np.where(m["dead_steps"], np.where(size > m["dead"], size, 0), np.maximum(0, size - m["dead"]))
    return np.sign(u) * np.minimum(beyond, m["largest"]) * m["gain"]


def accelerations(p, q, w, tau, stick):
    """q̈ of machines: q, w and tau are (machines × 2)."""
    s2, c2 = np.sin(q[:, 1]), np.cos(q[:, 1])
    both = p["G2"] * np.sin(q[:, 0] + q[:, 1])
    dry = np.tanh(stick[:, None] * w)
    f1 = (tau[:, 0] + p["b"] * s2 * w[:, 1] * (2 * w[:, 0] + w[:, 1]) - p["G1"] * np.sin(q[:, 0]) - both
          - p["d1"] * w[:, 0] - p["f1"] * dry[:, 0])
    f2 = tau[:, 1] - p["b"] * s2 * w[:, 0] ** 2 - both - p["d2"] * w[:, 1] - p["f2"] * dry[:, 1]
    m11 = p["J1"] + p["J2"] + 2 * p["b"] * c2
    m12 = p["J2"] + p["b"] * c2
    m22 = p["J2"] + p["a"]
    det = m11 * m22 - m12 * m12
    return np.stack([(m22 * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det], axis=1)


def runge_kutta(p, q, w, tau, stick, h):
    def slope(dq, dw, share):
        at = w + share * h * dw
        return at, accelerations(p, q + share * h * dq, at, tau, stick)
    q1, w1 = slope(0, 0, 0)
    q2, w2 = slope(q1, w1, 0.5)
    q3, w3 = slope(q2, w2, 0.5)
    q4, w4 = slope(q3, w3, 1)
    return q + h / 6 * (q1 + 2 * q2 + 2 * q3 + q4), w + h / 6 * (w1 + 2 * w2 + 2 * w3 + w4)


class Commands:
    """The commands of a batch: sines, random steps, or torques along the motion with turning signs."""

    def __init__(self, machines):
        def column(key):
            return np.array([m[key] for m in machines])
        self.kind = np.array([SIGNALS.index(m["signal"]) for m in machines])[:, None]
        self.limit, self.time = column("limit"), column("T")
        self.rate = np.array([m["sines"][0] for m in machines])
        self.phase = np.array([m["sines"][1] for m in machines])
        self.levels, self.hold, self.turn = column("levels"), column("hold"), column("turn")

    def at(self, t, w):
        sines = np.sin(self.rate * t[:, None, None] + self.phase).sum(axis=2) / 2
        steps = self.levels[np.arange(len(t)), (t / self.hold).astype(int) % LEVELS]
        way = np.where((t / self.turn).astype(int) % 3 == 2, -1, 1)[:, None]
        along = 4 * self.time[:, None] * w
        pump = way * np.tanh(along + 0.3 * np.sin(t / self.time)[:, None])
        share = np.clip(np.choose(self.kind, [sines, steps, pump]), -1, 1)
        # The motors brake fast links.
        return self.limit * np.where(np.abs(w) * self.time[:, None] > FAST, -np.sign(w), share)


def simulate(machines):
    """Returns for each machine time (rows), q, w, commanded and arriving torques (rows × 2)."""
    n = len(machines)
    def column(key):
        return np.array([m[key] for m in machines])
    p = {k: np.array([m["plant"][k] for m in machines]) for k in machines[0]["plant"]}
    rows, substeps = column("rows"), column("substeps")
    longest = rows.max() + 1
    cycles = np.zeros((longest, n))
    for i, m in enumerate(machines):
        cycles[:rows[i] + 1, i] = m["cycles"]
    motor = {k: column(k) for k in ("gain", "largest", "dead")} | {"dead_steps": column("dead_steps")[:, None]}
    commands, stick = Commands(machines), 30 * column("T")
    lag = np.maximum(column("lag"), 1e-9)
    late = np.round(column("delay") * substeps).astype(int)
    out = {k: np.zeros((longest, n, 2), dtype=np.float64) for k in ("q", "w", "u", "tau")}
    times = np.zeros((longest, n))
    q, w, t = column("start").astype(float), np.zeros((n, 2)), np.zeros(n)
    sent, before, torque = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 2))
    index = np.arange(n)
    for step in range(int((rows * substeps).max())):
        k, sub = step // substeps, step % substeps
        begins = (sub == 0) & (k < rows)
        if begins.any():
            at = index[begins]
            before[at] = sent[at]
            sent[at] = commands.at(t, w)[at]
            times[k[at], at] = t[at]
            for key, value in (("q", q), ("w", w), ("u", sent), ("tau", torque)):
                out[key][k[at], at] = value[at]
        h = cycles[np.minimum(k, rows), index] / substeps
        acting = arriving(motor, np.where((sub >= late)[:, None], sent, before))
        torque += (1 - np.exp(-h / lag))[:, None] * (acting - torque)
        q, w = runge_kutta(p, q, w, torque, stick, h[:, None])
        t = t + h
    return [{"time": times[:r, i], **{key: out[key][:r, i] for key in out}} for i, r in enumerate(rows)]
