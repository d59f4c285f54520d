#!/usr/bin/env python3
"""Successes of shipped policies and controllers on plants of the nominal shape and another size, on plants
whose links are up to 2.5 times as long or as short, and of controllers at other control periods.

Prints the tables of docs/tutorials/your-own-plant.md:
    python3 tools/results/sizes.py
"""

import json
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
POLICIES = ("sac", "d3qn", "any-pose", "mpc", "tvlqr", "energy", "pfl")
CONTROLLERS = ("tvlqr", "energy", "pfl")
SIZES = ((0.1, 0.01), (1, 1), (10, 1000))  # length and mass over those of the nominal plant
NEAR_SIZES = (0.4, 0.6, 1.5, 2, 2.5)  # length over that of the nominal plant
CARRIED = ("sac", "d3qn", "any-pose")
PERIODS = (0.002, 0.005, 0.01, 0.02)       # s
EPISODES = 100
# The nominal plant with its inertias as numbers, in SI units.
NOMINAL = {"mass1": 1, "mass2": 1, "length1": 0.5, "length2": 0.5, "center1": 0.25, "center2": 0.25,
           "inertia1": 0.0242, "inertia2": 0.0242, "armature": 0.01, "damping1": 0.2,
           "damping2": 0.2, "torque_limit": 5}


def image(length: float, mass: float) -> str:
    """A plant file: lengths times `length`, masses times `mass`, times times sqrt(length)."""
    inertia, time = mass * length ** 2, length ** 0.5
    units = {"mass": mass, "length": length, "center": length, "inertia": inertia,
             "armature": inertia, "damping": inertia / time, "torque": inertia / time ** 2}
    rows = [f"{name} = {value * units[name.rstrip('12').removesuffix('_limit')]!r}"
            for name, value in NOMINAL.items()]
    return "[plant]\n" + "\n".join(rows) + "\n"


def successes(length: float, mass: float, policies: tuple[str, ...], *flags: str) -> list[str]:
    """Successes of the policies on the image of the nominal plant."""
    with tempfile.TemporaryDirectory() as folder:
        plant = Path(folder) / "plant.toml"
        plant.write_text(image(length, mass), encoding="utf-8")
        done = subprocess.run(
            [ROOT / "upswing", "eval", *policies, "--plant", plant, "--goal", "up-up", "--physics",
             "closed-form", "--episodes", str(EPISODES), "--json", *flags],
            check=True, stdout=subprocess.PIPE, encoding="utf-8")
    result = json.loads(done.stdout)
    reports = result["policies"] if len(policies) > 1 else [result]
    return [str(report["successes"]) for report in reports]


def main() -> None:
    print(f"| length of a link | {' | '.join(POLICIES)} |")
    print("|---|" + "---|" * len(POLICIES))
    for length, mass in SIZES:
        print(f"| {0.5 * length:g} m | {' | '.join(successes(length, mass, POLICIES))} |", flush=True)
    print()
    print(f"| length of a link | mass of a link | {' | '.join(CARRIED)} |")
    print("|---|---|" + "---|" * len(CARRIED))
    for length in NEAR_SIZES:
        for mass in (1, length ** 3):
            counts = successes(length, mass, CARRIED)
            print(f"| {0.5 * length:g} m | {mass:.3g} kg | {' | '.join(counts)} |", flush=True)
    print()
    print(f"| length of a link | control period | {' | '.join(CONTROLLERS)} |")
    print("|---|---|" + "---|" * len(CONTROLLERS))
    for length, mass in SIZES:
        for period in PERIODS:
            counts = successes(length, mass, CONTROLLERS, "--control-period", str(period))
            print(f"| {0.5 * length:g} m | {1000 * period:g} ms | {' | '.join(counts)} |", flush=True)


if __name__ == "__main__":
    main()
