#!/usr/bin/env python3
"""Twins of two machines of CloudPendulum, and their predictions of runs that were left out.

Prints the table of docs/results/machine.md:
    git clone https://github.com/Sichen-L/cloudpendulum
    python3 tools/results/cloudpendulum.py cloudpendulum

Needs NumPy. The error is that of the repository's own identification: the root mean square of a
joint's angle over the whole run. The runs that are left out are its own, too. The first error of a
cell of the table is predicted from the first reading of angles and velocities. The second is
predicted from a start state that is fitted to the readings of the first 0.1 s. A first velocity
has noise of 0.2 rad/s (joint 1) and 0.6 rad/s (joint 2), and it is 2 to 4 ms late. A motor that
holds its link lets it go 8 ms after the first reading.
"""

import json
import math
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
# The files of each machine, and the runs to leave out.
CELLS = {
    "202": (("system_id_data_202_20260720-022553.npz", "system_id_data_202_20260720-022553_hi.npz"),
            ("free_q1=1.9", "oid_hi_long_09")),
    "203": (("system_id_data_203_20260720-001233.npz",), ("free_q1=1.9", "oid_valid"))}
COLUMNS = """time = "time"
angle1 = "q1"
angle2 = "q2"
velocity1 = "w1"
velocity2 = "w2"
commanded2 = "tau2"
"""
# First guesses of masses and lengths, as the makers of the machine published them.
PLANT = """[plant]
mass1 = 0.131
mass2 = 0.064
length1 = 0.05
length2 = 0.05
damping1 = 1e-4
damping2 = 1e-4
torque_limit = 0.15
actuated_joint = 2
armature = 1e-6
coulomb1 = 0.002
coulomb2 = 0.002
gravity = 9.81
"""
COGGING = "[cogging]\nslots = 12\npoles = 14\n"
HARMONICS = {"pole_pairs": 7, "slots": 12, "poles": 14, "2_slots": 24, "2_poles": 28, "3_slots": 36,
             "common": 84}
STEP = 2e-4  # of the integration, s
PAUSE = 0.02  # between rows: the loop has stopped, s
# A start state is fitted to the readings of START_SECONDS, at least START_ROWS. START_NOISE is the
# deviation (rad) of a reading that is up to 4 ms old. FIRST_READING: deviations in rad and rad/s.
START_SECONDS, START_ROWS, START_NOISE = 0.1, 8, 0.02
FIRST_READING = np.array([0.002, 0.002, 0.3, 0.6])
THEIRS = {"202": "identified_params_202_fit_20260721-231023.json"}


def runs_in(path: Path) -> list[dict[str, Any]]:
    """The runs of a file: time t, angles q, velocities w, torque u of joint 2, and a label."""
    with np.load(path, allow_pickle=False) as arrays:
        manifest = json.loads(str(arrays["manifest_json"].item()))
        return [{"label": entry["label"], "t": arrays[f"{entry['key']}_t"],
                 "q": arrays[f"{entry['key']}_q"], "w": arrays[f"{entry['key']}_dq"],
                 "u": arrays[f"{entry['key']}_u"]} for entry in manifest]


def write_log(run: dict[str, Any], path: Path) -> None:
    """Writes the log without rows that follow a pause. The loop may have stopped between a reading
    and its time stamp: on machine 203 a tenth of these readings is more than 30 ms old."""
    rows = np.column_stack([run["t"], run["q"], run["w"], run["u"]])
    rows = rows[np.diff(run["t"], prepend=run["t"][0]) <= PAUSE]
    np.savetxt(path, rows, "%.9g", delimiter=",", header="time,q1,q2,w1,w2,tau2", comments="")


def identify(logs: list[Path], folder: Path, cogging: bool) -> dict[str, Any]:
    """The twin of the logs, as its file has it."""
    (folder / "columns.toml").write_text(COLUMNS, encoding="utf-8")
    (folder / "plant.toml").write_text(PLANT + (COGGING if cogging else ""), encoding="utf-8")
    # Exit code 1: the logs have gaps.
    done = subprocess.run(
        [ROOT / "upswing", "machine", "identify", *logs, "--plant", folder / "plant.toml",
         "--columns", folder / "columns.toml", "--out", folder / "twin.toml", "--overwrite",
         "--folds", "0", "--one-body"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        encoding="utf-8", check=False)
    if done.returncode not in (0, 1):
        sys.exit(done.stderr)
    return tomllib.loads((folder / "twin.toml").read_text(encoding="utf-8"))


class Model:
    """A model that predicts runs, by measured angles."""

    delay = 0.0  # of the torque, s

    def rate(self, x: tuple[float, ...], u: float) -> tuple[float, ...]:
        raise NotImplementedError

    def step(self, x: tuple[float, ...], u: float, h: float) -> tuple[float, ...]:
        def moved(rate: tuple[float, ...], share: float) -> tuple[float, ...]:
            return tuple(a + share * h * b for a, b in zip(x, rate))
        k1 = self.rate(x, u)
        k2 = self.rate(moved(k1, 0.5), u)
        k3 = self.rate(moved(k2, 0.5), u)
        k4 = self.rate(moved(k3, 1), u)
        return tuple(a + h / 6 * (b + 2 * c + 2 * d + e)
                     for a, b, c, d, e in zip(x, k1, k2, k3, k4))

    def predict(self, run: dict[str, Any], start: np.ndarray, rows: int) -> np.ndarray:
        """The angles at the first rows of a run (rows, 2), rad."""
        t, u = run["t"], run["u"]
        acts = t[:len(u)] + self.delay  # when each torque begins to act
        x = tuple(start)
        angles = [x[:2]]
        for k in range(1, rows):
            steps = max(1, math.ceil((t[k] - t[k - 1]) / STEP))
            h = (t[k] - t[k - 1]) / steps
            for i in range(steps):
                now = int(np.searchsorted(acts, t[k - 1] + i * h, side="right")) - 1
                x = self.step(x, u[max(now, 0)], h)
            angles.append(x[:2])
        return np.array(angles)

    def error(self, run: dict[str, Any], start: np.ndarray) -> str:
        """Root mean square of both angles' errors over the run, degrees."""
        e = self.predict(run, start, len(run["t"])) - run["q"]
        return " and ".join(f"{x:.1f}" for x in np.degrees(np.sqrt(np.mean(e * e, axis=0))))

    def fitted_start(self, run: dict[str, Any]) -> np.ndarray:
        """The start state that fits the first readings best (Gauss and Newton)."""
        t, first = run["t"], first_reading(run)
        rows = max(int(np.searchsorted(t, t[0] + START_SECONDS)), START_ROWS)

        def residuals(x: np.ndarray) -> np.ndarray:
            errors = (self.predict(run, x, rows) - run["q"][:rows]) / START_NOISE
            return np.concatenate([errors.ravel(), (x - first) / FIRST_READING])
        x, small = first, 1e-5
        for _ in range(5):
            r = residuals(x)
            J = np.column_stack([(residuals(x + small * e) - r) / small for e in np.eye(4)])
            x = x - np.linalg.lstsq(J, r, rcond=None)[0]
        return x

    def errors(self, run: dict[str, Any]) -> str:
        """The errors from the first reading, and from the fitted start."""
        return (f"{self.error(run, first_reading(run))}; "
                f"{self.error(run, self.fitted_start(run))}")


def first_reading(run: dict[str, Any]) -> np.ndarray:
    return np.array([*run["q"][0], *run["w"][0]])


class Theirs(Model):
    """Their twin. It has three constants of inertia, and friction with a hyperbolic tangent."""

    def __init__(self, path: Path):
        self.p = json.loads(path.read_text(encoding="utf-8"))

    def rate(self, x: tuple[float, ...], u: float) -> tuple[float, ...]:
        q1, q2, w1, w2 = x
        p = self.p
        bc, bs = p["P2"] * math.cos(q2), p["P2"] * math.sin(q2)
        g2 = p["P5"] * math.sin(q1 + q2)

        def friction(joint: int, w: float) -> float:
            return (p[f"b{joint}"] * w + p[f"cf{joint}"] * math.tanh(w / p["eps"]) +
                    p[f"d{joint}"] * w * math.sqrt(w * w + 0.25))
        r1 = bs * (2 * w1 + w2) * w2 - p["P4"] * math.sin(q1) - g2 - friction(1, w1)
        r2 = u - bs * w1 * w1 - g2 - friction(2, w2)
        M11, M12, M22 = p["P1"] + 2 * bc, p["P3"] + bc, p["P6"]
        det = M11 * M22 - M12 * M12
        return w1, w2, (M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det


class Ours(Model):
    """The equations of motion of a twin in a session."""

    def __init__(self, twin: dict[str, Any], session: str):
        values = {**twin["plant"], **twin["actuator"], **twin["sensors"]}
        values |= twin["sessions"][session]
        self.p = values
        p = values
        self.J2 = p["mass2"] * p["center2"] ** 2 + p["inertia2"]
        self.J1 = (p["mass1"] * p["center1"] ** 2 + p["inertia1"] +
                   p["mass2"] * p["length1"] ** 2 + p["armature"])
        self.b = p["mass2"] * p["length1"] * p["center2"]
        self.G1 = p["gravity"] * (p["mass1"] * p["center1"] + p["mass2"] * p["length1"])
        self.G2 = p["gravity"] * p["mass2"] * p["center2"]
        self.delay = p["delay"] + p["lag"]
        cogging = twin.get("cogging", {})
        self.cogging = [[(n, cogging.get(f"sine{j}_{name}", 0.0), cogging.get(f"cosine{j}_{name}", 0.0))
                         for name, n in HARMONICS.items() if cogging] for j in (1, 2)]

    def rate(self, x: tuple[float, ...], u: float) -> tuple[float, ...]:
        m1, m2, w1, w2 = x
        p = self.p
        q1, q2 = m1 - p["zero1"], m2 - p["zero2"]
        bc, bs = self.b * math.cos(q2), self.b * math.sin(q2)
        g2 = self.G2 * math.sin(q1 + q2)
        r1 = (bs * (2 * w1 + w2) * w2 - self.G1 * math.sin(q1) - g2 - p["damping1"] * w1 -
              p["coulomb1"] * math.atan(100 * w1))
        r2 = u - bs * w1 * w1 - g2 - p["damping2"] * w2 - p["coulomb2"] * math.atan(100 * w2)
        r1 += sum(s * math.sin(n * m1) + c * math.cos(n * m1) for n, s, c in self.cogging[0])
        r2 += sum(s * math.sin(n * m2) + c * math.cos(n * m2) for n, s, c in self.cogging[1])
        M11, M12, M22 = self.J1 + self.J2 + 2 * bc, self.J2 + bc, self.J2 + p["armature"]
        det = M11 * M22 - M12 * M12
        return w1, w2, (M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det


def main() -> None:
    source = Path(sys.argv[1])
    print("| machine | run | their twin | without cogging | with cogging |")
    print("|---|---|---|---|---|")
    for cell, (files, left_out) in CELLS.items():
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            logs, runs = [], {}
            for file in files:
                for run in runs_in(source / file):
                    # Runs whose labels differ in the last number are of one session.
                    label = run["label"].replace("=", "")
                    path = folder / cell / f"{label}.csv"
                    path.parent.mkdir(exist_ok=True)
                    write_log(run, path)
                    if run["label"] in left_out:
                        runs[run["label"]] = run
                    else:
                        logs.append(path)
            theirs = Theirs(source / THEIRS[cell]) if cell in THEIRS else None
            cells = {label: [theirs.errors(runs[label]) if theirs else ""] for label in left_out}
            for cogging in (False, True):
                twin = identify(logs, folder, cogging)
                for label, run in runs.items():
                    sessions = [s for s in twin["sessions"] if label.replace("=", "").startswith(
                        s.split("/")[-1])]
                    # A run without a session of its own is of the other excitation.
                    session = sessions[0] if sessions else list(twin["sessions"])[-1]
                    cells[label].append(Ours(twin, session).errors(run))
            for label in left_out:
                print(f"| {cell} | `{label}` | {' | '.join(cells[label])} |", flush=True)


if __name__ == "__main__":
    main()
