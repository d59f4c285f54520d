#!/usr/bin/env python3
"""Drives a double pendulum of CloudPendulum (https://github.com/cloudpendulum) with an Upswing policy.

    ./upswing python examples/python/cloudpendulum.py runs/pendubot                    a rehearsal
    ./upswing python examples/python/cloudpendulum.py runs/pendubot --token TOKEN --cell 202

Without --token a fake machine stands in for the platform's client. This project has no access to the
platform: the loop follows its public example (cloudpendulum/benchmarking-example on GitHub), and is
tested with the fake machine only.
"""

from __future__ import annotations

import argparse
import dataclasses
import random
import sys
from typing import Any

import upswing


def drive(control_loop: Any, controller: upswing.machine.Controller) -> Any:
    """Runs an experiment, and returns what the client returns at its end."""
    control_loop.start()
    try:
        while not control_loop.finished():
            state = control_loop.get_state()
            torques = controller(control_loop.time(), [joint.position for joint in state],
                                 [joint.velocity for joint in state])
            control_loop.step(torques)
    finally:
        result = control_loop.stop()
    return result


@dataclasses.dataclass
class MotorState:
    position: float  # rad
    velocity: float  # rad/s


class FakeControlLoop:
    """A stand-in for the client's ControlLoop: a fake machine in simulated time.

    Cycles take dt [s], and now and then up to `longest_gap`. `draw` is the seed of a machine drawn
    from the twin's covariance (None: the twin itself), and `seed` that of the gaps.
    """

    def __init__(self, twin: str = "cloudpendulum", experiment_time: float = 10, dt: float = 0.002,
                 draw: int | None = None, seed: int = 0, longest_gap: float = 0.07,
                 gaps_per_second: float = 0.5):
        self.machine = upswing.machine.FakeMachine(twin, draw=draw)
        self.random = random.Random(seed)
        self.seconds, self.dt, self.now = experiment_time, dt, 0.0
        self.longest_gap, self.gap_share = longest_gap, gaps_per_second * dt
        self.state: list[MotorState] = []
        self.torques = [(0.0, 0.0)]  # that were sent

    def start(self) -> None:
        self._read(self.dt)

    def finished(self) -> bool:
        return self.now >= self.seconds

    def time(self) -> float:
        return self.now

    def get_state(self) -> list[MotorState]:
        return self.state

    def step(self, torques: list[float]) -> None:
        """Sends the torques, waits for the next cycle, and reads."""
        self.machine.send(torques)
        self.torques.append((torques[0], torques[1]))
        cycle = self.dt
        if self.random.random() < self.gap_share:
            cycle = self.random.uniform(self.dt, self.longest_gap)
        self._read(cycle)

    def stop(self) -> tuple[str, str]:
        self.machine.send([0, 0])
        return "", ""

    def _read(self, cycle: float) -> None:
        self.now += cycle
        self.machine.advance(self.now)
        angles = self.machine.read()
        before = [joint.position for joint in self.state] or angles
        self.state = [MotorState(new, (new - old) / cycle) for new, old in zip(angles, before)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policy", help="run folder, policy file or controller")
    parser.add_argument("--twin", default="cloudpendulum", help="twin of the machine")
    parser.add_argument("--token", help="your token of the platform; without it: a rehearsal")
    parser.add_argument("--cell", type=int, help="number of the machine on the platform")
    parser.add_argument("--seconds", type=float, default=10, help="length of the experiment [s]")
    parser.add_argument("--draw", type=int, help="seed of a fake machine that differs from the twin")
    parser.add_argument("--seed", type=int, default=0, help="seed of the fake machine's gaps")
    arguments = parser.parse_args()
    # The platform's own limits are an error there: 50 rad and 50 rad/s.
    controller = upswing.machine.Controller(arguments.policy, twin=arguments.twin, max_angle=50,
                                            max_velocity=50)
    if arguments.token is None:
        loop: Any = FakeControlLoop(arguments.twin, arguments.seconds, draw=arguments.draw,
                                    seed=arguments.seed)
    else:
        from cloudpendulumclient.benchmark.control_loop import ControlLoop  # type: ignore # pylint: disable=all
        loop = ControlLoop(user_token=arguments.token, experiment_time=arguments.seconds,
                           experiment_type="DoublePendulum", dt=0.002, cell_id=arguments.cell,
                           disturbances=[])
    drive(loop, controller)
    print(f"{controller.driven:.2f} s driven, {controller.upright:.2f} s upright at the end")
    if controller.stopped:
        print(f"stopped: {controller.stopped}")
    if controller.stopped or controller.upright == 0:
        sys.exit(1)  # the exit code of `upswing run`


if __name__ == "__main__":
    main()
