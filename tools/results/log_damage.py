"""Kinds of damage to logs, with the words by which `machine check` names each.

A kind changes the machine before it is simulated (`motors`) or the readings after it (`readings`). Readings are
exact values; logs.py writes them as an encoder and a logger would.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from log_machines import SIGNALS


@dataclass
class Kind:
    """A kind of damage. `names`: patterns of which a finding's aspect, joint and text hold one; {j} is the joint that
    `readings` sets in the log."""
    title: str
    names: tuple
    drives: tuple = ("both", "joint 1", "joint 2", "free")
    motors: object = None
    readings: object = None
    columns: str = ""  # torque columns that it needs: commanded, measured or both; empty: any
    warns: bool = False  # whether a warning is enough
    signals: tuple = SIGNALS
    logger: dict = field(default_factory=dict)  # habits that it needs


UNEVEN = ("sines", "steps")  # torques of one size only hide limits
REACHES_LIMIT = ("sines", "pump")  # random steps end below it
DRIVEN = ("both", "joint 1", "joint 2")


def scaled(joints, factors):
    """Angles that are read as a multiple of the true ones."""
    def readings(log, m, rng):
        factor = rng.choice(factors)
        for joint in joints:
            log["q"][:, joint] *= factor
            log["w"][:, joint] *= factor
    return readings


def scaled_columns(joints, factors):
    """Columns of a file with absolute angles that have a multiple of the true ones."""
    def readings(log, m, rng):
        factor = rng.choice(factors)
        for key in ("q", "w"):
            column = log[key].copy()
            column[:, 1] += column[:, 0]
            column[:, joints] *= factor
            column[:, 1] -= column[:, 0]
            log[key] = column
    return readings


def driven_joint(m, rng):
    return rng.choice(np.flatnonzero(m["limit"] > 0))


def offset(log, m, rng):
    joint = driven_joint(m, rng)
    log["j"] = joint + 1
    shift = rng.choice([-1, 1]) * rng.uniform(0.05, 0.2) * m["gravity"][joint]
    log["u"][:, joint] += shift
    log["tau"][:, joint] += shift


def delayed(values, rows):
    return np.concatenate([np.repeat(values[:1], rows, axis=0), values[:len(values) - rows]])


def late_torques(log, m, rng):
    rows = math.ceil(rng.uniform(0.2, 0.5) * m["T"] / m["cycle"]) + 3
    for key in ("u", "tau"):
        log[key] = delayed(log[key], rows)


def hermite(t, y, slope, now):
    """Cubics through values and slopes at times t, at the times `now`."""
    now = np.clip(now, t[0], t[-1])
    i = np.clip(np.searchsorted(t, now) - 1, 0, len(t) - 2)
    h = t[i + 1] - t[i]
    x = (now - t[i]) / h
    return ((1 + 2 * x) * (1 - x) ** 2 * y[i] + x * (1 - x) ** 2 * h * slope[i]
            + x * x * (3 - 2 * x) * y[i + 1] + x * x * (x - 1) * h * slope[i + 1])


def late_angle(log, m, rng):
    now = log["time"] - rng.uniform(0.08, 0.15) * m["T"]
    log["q"][:, 1] = hermite(log["time"], log["q"][:, 1], log["w"][:, 1], now)
    log["w"][:, 1] = np.interp(now, log["time"], log["w"][:, 1])


def fast_clock(log, m, rng):
    log["time"] = log["time"] / 1.05


def nominal_clock(log, m, rng):
    kept = rng.uniform(size=len(log["time"])) >= 0.1
    for key in ("q", "w", "u", "tau"):
        log[key] = log[key][kept]
    log["time"] = m["cycle"] * np.arange(kept.sum())


def changing_clock(log, m, rng):
    middle = log["time"][int(rng.uniform(0.3, 0.7) * len(log["time"]))]
    log["time"] = log["time"] + rng.uniform(0.05, 0.2) * np.maximum(0, log["time"] - middle)


def rows_twice(log, m, rng):
    times = 1 + (rng.uniform(size=len(log["time"])) < 0.1)
    for key in ("q", "w", "u", "tau"):
        log[key] = np.repeat(log[key], times, axis=0)
    log["time"] = m["cycle"] * np.arange(times.sum())


def within_one(log, m, rng):
    """Commands as shares of the limit. Only commands that reach 1 tell: a motor may give .97 N·m at most."""
    log["u"] = log["u"] / np.where(m["limit"] > 0, m["limit"], 1)


def gain(m, rng):
    m["gain"] = np.full(2, 0.8)


def saturates(m, rng):
    m["largest"] = rng.uniform(0.3, 0.6) * np.where(m["limit"] > 0, m["limit"], 1)


def dead_band(m, rng):
    """A dead band that shortens all torques, or swallows small ones.

    Of commands that are as often small as large, one of a share d swallows d³ of the squares. Below a third of 1%
    that is less than the commands of lost rows and the rounding of encoders hide.
    """
    m["dead_steps"] = bool(rng.integers(2))
    m["dead"] = rng.uniform(0.15 if m["dead_steps"] else 0.1, 0.25) * m["limit"]


def dead_motor(m, rng):
    m["gain"] = np.ones(2)
    m["dead_joint"] = rng.integers(2)
    m["gain"][m["dead_joint"]] = 0


def name_dead_motor(log, m, rng):
    log["j"] = m["dead_joint"] + 1


def flip(log, m, rng):
    after = int(rng.uniform(0.3, 0.7) * len(log["time"]))
    for key in ("u", "tau"):
        log[key][after:] *= -1


def slip(log, m, rng):
    joint = rng.integers(2)
    log["j"] = joint + 1
    after = int(rng.uniform(0.25, 0.75) * len(log["time"]))
    log["q"][after:, joint] += rng.choice([-1, 1]) * rng.uniform(0.1, 0.2)


def gradual_slip(log, m, rng):
    joint, n = rng.integers(2), len(log["time"])
    log["j"] = joint + 1
    share = np.clip((np.arange(n) / n - rng.uniform(0.25, 0.45)) / rng.uniform(0.1, 0.3), 0, 1)
    log["q"][:, joint] += rng.choice([-1, 1]) * rng.uniform(0.15, 0.4) * share


def drift(log, m, rng):
    joint = rng.integers(2)
    log["j"] = joint + 1
    log["q"][:, joint] += (rng.choice([-1, 1]) * rng.uniform(0.3, 0.8) * log["time"] / log["time"][-1])


def spike(log, m, rng):
    joint = rng.integers(2)
    log["j"] = joint + 1
    log["q"][rng.integers(50, len(log["time"]) - 50), joint] += 0.08 * rng.choice([-1, 1])


def swapped(log, m, rng):
    for key in ("q", "w"):
        log[key] = log[key][:, ::-1].copy()


def absolute(log, m, rng):
    for key in ("q", "w"):
        log[key][:, 1] += log[key][:, 0]


def degrees(log, m, rng):
    for key in ("q", "w"):
        log[key] = np.degrees(log[key])


def turned(log, m, rng):
    joint = rng.integers(2)
    log["j"] = joint + 1
    for key in ("q", "w"):
        log[key][:, joint] *= -1


def turned_torque(log, m, rng):
    joint = driven_joint(m, rng)
    log["j"] = joint + 1
    for key in ("u", "tau"):
        log[key][:, joint] *= -1


def zero(log, m, rng):
    joint = rng.integers(2)
    log["j"] = joint + 1
    log["q"][:, joint] += rng.choice([-1, 1]) * rng.uniform(0.6, 2.8)


TIMES = "times the true one"
ABSOLUTE = {"convention": True, "absolute": True}
KINDS = [
    Kind("angle 1 doubled", (f"angle 1: .*{TIMES}",), readings=scaled([0], [2])),
    Kind("angle 2 doubled", (f"angle 2: .*{TIMES}",), readings=scaled([1], [2])),
    Kind("both angles doubled", (f"angle [12]: .*{TIMES}",), readings=scaled([0, 1], [2])),
    Kind("both angles halved", (f"angle [12]: .*{TIMES}",), readings=scaled([0, 1], [0.5])),
    Kind("angle 2 halved", (f"angle 2: .*{TIMES}",), readings=scaled([1], [0.5])),
    Kind("belt 3:1 at joint 2", (f"angle 2: .*{TIMES}",), readings=scaled([1], [3, 1 / 3])),
    Kind("angle 2 times .9", (f"angle 2: .*{TIMES}",), readings=scaled([1], [0.9])),
    Kind("angle 2 times 4096/4000", (f"angle 2: .*{TIMES}",), readings=scaled([1], [1.024])),
    Kind("absolute angle 1 doubled", (f"angle 1: .*{TIMES}",), readings=scaled_columns([0], [2]), logger=ABSOLUTE),
    Kind("absolute angle 1 halved", (f"angle 1: .*{TIMES}",), readings=scaled_columns([0], [0.5]), logger=ABSOLUTE),
    Kind("absolute angle 2 doubled", (f"angle 2: .*{TIMES}",), readings=scaled_columns([1], [2]), logger=ABSOLUTE),
    Kind("absolute angle 2 halved", (f"angle 2: .*{TIMES}",), readings=scaled_columns([1], [0.5]), logger=ABSOLUTE),
    Kind("absolute angles doubled or halved", (f"angle [12]: .*{TIMES}",),
         readings=scaled_columns([0, 1], [2, 0.5]), logger=ABSOLUTE),
    Kind("offset of a torque", ("torque {j}: .*offset",), DRIVEN, readings=offset),
    Kind("torques late", ("torques that are .* later", "measured .* after"), DRIVEN, readings=late_torques),
    Kind("angle 2 late", ("angle 2: .* later",), readings=late_angle),
    Kind("clock 5% fast", ("clock",), readings=fast_clock),
    Kind("a tenth of the rows lost", ("rows are lost",), readings=nominal_clock,
         logger={"lost": 0}),
    Kind("commands in -1 to 1", ("between -1 and 1",), DRIVEN, readings=within_one, columns="commanded",
         warns=True, logger={"convention": False}, signals=REACHES_LIMIT),
    Kind("gain .8, measured torque", ("another torque than commanded",), DRIVEN, motors=gain, columns="both",
         warns=True),
    Kind("saturation", ("saturate",), DRIVEN, motors=saturates, columns="commanded",
         signals=UNEVEN),
    Kind("dead band", ("dead band",), DRIVEN, motors=dead_band, columns="commanded",
         signals=UNEVEN),
    Kind("sign flips half way", ("sign that turns",), DRIVEN, readings=flip),
    Kind("slip of .1 to .2 rad", ("angle {j}: .*slips",), readings=slip),
    Kind("gradual slip", ("angle {j}: .*(slips|drifts)",), readings=gradual_slip),
    Kind("drift", ("angle {j}: .*(slips|drifts)",), readings=drift),
    Kind("torque does not arrive", ("(torque {j}|torque): .*(no effect|does not arrive|off)",), ("both",),
         motors=dead_motor, readings=name_dead_motor, columns="commanded"),
    Kind("spike of .08 rad", ("angle {j}: .*wrong sample",), readings=spike),
    Kind("swapped angles", ("swapped",), readings=swapped),
    Kind("angle 2 absolute", ("against the vertical",), readings=absolute),
    Kind("degrees", ("degrees", "turns"), readings=degrees),
    Kind("sign of an angle", ("opposite sign",), readings=turned),
    Kind("sign of a torque", ("torque {j}: .*opposite sign",), DRIVEN, readings=turned_torque),
    Kind("zero of an angle", ("another zero",), readings=zero),
    Kind("a tenth of the rows duplicated", ("rows are duplicates",), readings=rows_twice, logger={"lost": 0}),
    Kind("clock 5 to 20% faster from a moment on", ("a clock that runs",), readings=changing_clock),
]
