"""A controller of a real machine for a loop of your own, and logs of such machines."""

from __future__ import annotations

import os
import warnings
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Union
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from . import _upswing
from ._settings import PathLike, path_of, text_of, texts_of, whole_number
from .policy import Policy, changes_of


class Controller:
    """A policy or controller as the controller of a machine whose loop is yours.

    Call it with each reading. It returns the torques to send, and does what `upswing run` does: a
    Kalman filter with the twin estimates the state, a supervisor watches the machine, and the
    motor earns its torque by a pulse that the encoders have to answer. The calls may come at any
    times: the policy acts at the reading nearest to the end of its control period, and its torque is
    held between.

    >>> controller = upswing.machine.Controller("mpc", twin="twin.toml")
    >>> torques = controller(t, q)

    Attributes:
        name: policy or controller
        actuated_joint: joint of the motor that the policy drives, 1 or 2
        control_period: time for which the policy holds a torque [s]
    """

    def __init__(
        self,
        policy: Union[Policy, PathLike],
        *,
        twin: PathLike,
        actuated_joint: int | None = None,
        start: str | Sequence[float] = "hanging",
        latency: float | None = 0.0,
        max_angle: float | None = None,
        max_velocity: float | None = None,
        max_torque: float | None = None,
        max_energy: float | None = None,
        max_age: float | None = None,
        brake_damping: float | None = None,
        brake_seconds: float | None = None,
        patience: float | None = None,
        passive_torque: float | None = None,
        compensation: float | None = None,
        control_period: float | None = None,
        made_for: Mapping[str, float] | PathLike | None = None,
        **settings: Any,
    ) -> None:
        """Makes the controller. Warns if the policy is carried over to a machine of another size,
        and if it was made for another plant.

        Args:
            policy: policy file, run folder, shipped policy such as "sac", controller such as "mpc",
                or a `Policy`
            twin: model of the machine: a twin or plant file, or a shipped plant such as
                "cloudpendulum"
            actuated_joint: joint of the motor, 1 or 2, for which a controller is designed; None: the
                policy's, or the twin's
            start: state in which the policy takes over: "hanging", "upright" or
                (q1, q2, w1, w2) [rad, rad/s]
            latency: time from a reading to sending the torques that answer it [s]; None: they are
                sent with the next reading
            max_angle: largest angle of a joint; beyond it the motors brake [rad] (12)
            max_velocity: largest velocity of a joint; beyond it they brake [rad/s] (25 for a
                machine of the size of RealAIGym's robot, in natural units for others)
            max_torque: largest torque, at most the twin's [N·m] (5 for RealAIGym's size, the
                twin's for others)
            max_energy: largest mechanical energy, 0 hanging, 1 upright; beyond it they brake (4)
            max_age: longest gap between two readings; beyond it they are off [s] (0.1)
            brake_damping: torque against the velocity while braking [N·m·s/rad] (0.2, in natural
                units for other sizes)
            brake_seconds: longest time of braking [s] (5, in natural units for other sizes)
            patience: longest wait for the start state [s] (10, longer for larger machines)
            passive_torque: largest torque of the joint without the policy's motor, for
                compensation and braking [N·m] (0.5 for RealAIGym's size, the twin's
                passive_limit for others)
            compensation: share of both joints' estimated dry friction that the motors compensate (0)
            control_period: of a controller's design [s] (0.02, in natural units for other sizes)
            made_for: changes of a controller's design plant, as for `load_policy`; the design plant
                is the twin's without dry friction
            **settings: settings of a controller, such as mpc_seconds

        Raises:
            InputError: an argument is wrong
        """
        limits = {"max_angle": max_angle, "max_velocity": max_velocity, "max_torque": max_torque,
                  "max_energy": max_energy, "max_age": max_age, "brake_damping": brake_damping,
                  "brake_seconds": brake_seconds, "patience": patience,
                  "passive_torque": passive_torque, "compensation": compensation}
        given = texts_of({name: value for name, value in limits.items() if value is not None})
        chosen = _chosen(policy, _joint(actuated_joint), path_of("twin", twin), control_period,
                         changes_of(made_for), texts_of(settings))
        self._loop = _upswing.MachineLoop(chosen, given, _start_of(start), _latency_of(latency))
        self.name: str = self._loop.name
        self.actuated_joint: int = self._loop.actuated_joint
        self.control_period: float = self._loop.control_period
        if self._loop.change_of_size:
            warnings.warn(f"{self.name}: {self._loop.change_of_size}", stacklevel=2)
        if self._loop.differences:
            warnings.warn(self._loop.differences, stacklevel=2)

    def __call__(self, t: float, q: npt.ArrayLike, w: npt.ArrayLike | None = None) -> list[float]:
        """Takes a reading, and returns the torques to send at once.

        Args:
            t: time of the reading by any clock that never goes back [s]
            q: angle of each joint [rad], counter-clockwise: joint 1 from hanging, joint 2 from
                straight links
            w: velocity of each joint [rad/s]. It is only checked: the twin estimates velocities
                from the angles

        Returns:
            Torque of each joint [N·m], at most `passive_torque` at the joint without the policy's
            motor, and 0 once `state` is "fault"

        Raises:
            InputError: t is earlier than before, or a number is not finite. All further torques are
                0
            TypeError: an argument is no number or no pair. All further torques are 0
        """
        try:
            time, angles = float(t), _pair("q", q)
            if w is not None and not np.all(np.isfinite(_pair("w", w))):
                raise _upswing.InputError(
                    f"w: expected two finite velocities in rad/s, got {_pair('w', w)}")
        except (_upswing.InputError, TypeError, ValueError) as error:
            self._loop.refuse(str(error) or repr(error))
            raise
        return list(self._loop.step(time, angles))

    def stop(self) -> None:
        """Asks for a stop: in the next calls the motor brakes until the links hang."""
        self._loop.stop()

    @property
    def state(self) -> str:
        """State of the supervisor: "idle", "armed", "probing", "running", "braking" or "fault"."""
        return self._loop.state

    @property
    def stopped(self) -> str | None:
        """Why the policy no longer drives, in a line; None while it waits or drives.

        The motor may still brake (`state` is "braking"). Otherwise all further torques are 0.
        """
        return self._loop.stopped or None

    @property
    def estimate(self) -> tuple[float, float, float, float]:
        """Estimate of q1, q2, w1, w2 at the last reading [rad, rad/s]."""
        q1, q2, w1, w2 = self._loop.estimate
        return q1, q2, w1, w2

    @property
    def driven(self) -> float:
        """Time for which the policy has driven [s]."""
        return self._loop.driven

    @property
    def upright(self) -> float:
        """Time for which both links have been within 30° of upright [s]; 0 if they are not now."""
        return self._loop.upright if self.state == "running" else 0.0

    def __repr__(self) -> str:
        return (f"<upswing.machine.Controller {self.name}, motor at joint {self.actuated_joint}: "
                f"{self.state}{': ' + self.stopped if self.stopped else ''}>")


class FakeMachine:
    """A twin's machine in simulated time, to rehearse a loop: motors, links and encoders."""

    def __init__(self, twin: PathLike, *, start: str | Sequence[float] = "hanging",
                 draw: int | None = None) -> None:
        """Begins at time 0 s.

        Args:
            twin: twin or plant file, or shipped plant
            start: true state: "hanging", "upright" or (q1, q2, w1, w2) [rad, rad/s]
            draw: seed with which the machine is drawn from the twin's covariance, as
                `upswing run --draw --seed` does; None: the twin itself

        Raises:
            InputError: an argument is wrong
        """
        seed = None if draw is None else whole_number("draw", draw)
        if seed is not None and seed < 0:
            raise _upswing.InputError(f"draw: expected 0 or more, got {seed}")
        self._machine = _upswing.simulated_machine(path_of("twin", twin), _start_of(start), seed)

    def advance(self, t: float) -> None:
        """Lets time pass until t [s]."""
        self._machine.advance(t)

    def send(self, torques: npt.ArrayLike) -> None:
        """Sends a torque to each joint [N·m], which is held until the next one. The twin's limit cuts
        it."""
        self._machine.send(_pair("torques", torques))

    def read(self) -> list[float]:
        """The angle that the encoder of each joint shows now [rad]."""
        return list(self._machine.read())

    @property
    def state(self) -> tuple[float, float, float, float]:
        """The true q1, q2, w1, w2 now [rad, rad/s]."""
        q1, q2, w1, w2 = self._machine.state()
        return q1, q2, w1, w2


def _chosen(policy: Union[Policy, PathLike], joint: int, twin: str, control_period: float | None,
            made_for: list[str], settings: list[tuple[str, str]]) -> _upswing.MachinePolicy:
    """The policy for the twin's machine."""
    if control_period is not None and not 0.001 <= control_period <= 1:
        raise _upswing.InputError(
            f"control_period: expected 0.001 to 1 s, got {control_period!r}")
    if isinstance(policy, Policy):
        for name, given in (("made_for", made_for), ("control_period", control_period),
                            *((name, True) for name, _ in settings)):
            if given:
                raise _upswing.InputError(f"{name}: expected a controller's name with it, got a Policy")
        return _upswing.machine_policy_of(policy._handle, joint, twin)  # pylint: disable=protected-access
    if not isinstance(policy, (str, bytes, os.PathLike)):
        raise _upswing.InputError(
            f"policy: expected a Policy, a path or a controller's name, got {type(policy).__name__}")
    return _upswing.machine_policy(path_of("policy", policy), settings, made_for,
                                   control_period or 0.0, joint, twin)


def _joint(joint: int | None) -> int:
    """The joint of the motor; 0: any."""
    if joint is None:
        return 0
    number = whole_number("actuated_joint", joint)
    if number not in (1, 2):
        raise _upswing.InputError(f"actuated_joint: expected 1 or 2, got {number}")
    return number


def _start_of(start: str | Sequence[float]) -> str:
    return start if isinstance(start, str) else text_of([float(number) for number in start])


def _latency_of(latency: float | None) -> float | None:
    if latency is None or 0 <= latency <= 0.1:
        return latency
    raise _upswing.InputError(f"latency: expected 0 to 0.1 s or None, got {latency!r}")


def _pair(name: str, numbers: npt.ArrayLike) -> list[float]:
    """Two numbers, one of each joint. Raises InputError."""
    try:
        pair = np.asarray(numbers, np.float64)
    except (TypeError, ValueError):
        pair = np.empty(0)
    if pair.shape != (2,):
        raise _upswing.InputError(f"{name}: expected two numbers, one of each joint, got {numbers!r}")
    return [float(pair[0]), float(pair[1])]


def csv_of_npz(file: PathLike, folder: PathLike, *, torque_joint: int | None = None) -> list[Path]:
    """Writes the logs in an archive of NumPy as CSV files for `upswing machine`.

    A log has the arrays t (n), q (n × 2), dq (n × 2, may be missing), and u (n × 2, or n for the
    torque of one joint, may be missing), in s, rad, rad/s and N·m. In an archive of several logs,
    the log's name and an underscore come before these names, as in run1_q. Other arrays are left
    out. Pickled objects are not read.

    Args:
        file: archive, .npz
        folder: folder of the CSV files, which is made if it is missing
        torque_joint: joint on which torques of one joint act, 1 or 2

    Returns:
        the files, each with the name of its log, or of an archive of one

    Raises:
        InputError: the archive has no log, its arrays do not fit, or a CSV file exists
    """
    source, target = path_of("file", file), Path(path_of("folder", folder))
    if torque_joint not in (None, 1, 2):
        raise _upswing.InputError(f"torque_joint: expected 1, 2 or None, got {torque_joint!r}")
    try:
        with np.load(source, allow_pickle=False) as archive:
            arrays = dict(archive.items()) if hasattr(archive, "items") else {}
    except (OSError, ValueError, EOFError, BadZipFile, zlib.error) as error:
        reason = " ".join((str(error) or repr(error)).split())
        raise _upswing.InputError(f"{source}: expected an archive of NumPy, got: {reason}") from None
    # An array such as delta_t is of no log.
    prefixes = [key[:-1] for key in arrays
                if (key == "t" or key.endswith("_t")) and key[:-1] + "q" in arrays]
    if not prefixes:
        raise _upswing.InputError(f"{source}: expected arrays t and q, got "
                                  f"{', '.join(list(arrays)[:5]) or 'none'}")
    logs = {}
    for prefix in prefixes:
        name = prefix.removesuffix("_")
        if os.path.basename(name) != name or not name.isprintable():
            raise _upswing.InputError(f"{source}: expected the name of a log, got {name!r}")
        path = target / f"{name or Path(source).stem}.csv"
        if os.path.lexists(path):
            raise _upswing.InputError(f"{path}: expected a new file, got one that exists")
        logs[path] = _columns_of(arrays, prefix, source, torque_joint)
    target.mkdir(parents=True, exist_ok=True)
    for path, columns in logs.items():
        with path.open("x", encoding="utf-8") as out:
            np.savetxt(out, np.column_stack(list(columns.values())), "%.17g", delimiter=",",
                       header=",".join(columns), comments="")
    return list(logs)


def _columns_of(arrays: Mapping[str, Any], prefix: str, source: str,
                torque_joint: int | None) -> dict[str, npt.NDArray[np.float64]]:
    """The columns (n) of a log by their names in CSV files. Raises InputError."""

    def array(key: str, *shapes: tuple[int, ...]) -> Any:
        where = f"{source}: {prefix}{key}"
        if prefix + key not in arrays:
            raise _upswing.InputError(f"{where}: expected this array, got none")
        found = arrays[prefix + key]
        if shapes and found.shape not in shapes:
            expected = " or ".join(str(shape) for shape in shapes)
            raise _upswing.InputError(f"{where}: expected the shape {expected}, got {found.shape}")
        if found.dtype.kind not in "fiu" or not np.isfinite(found).all():
            raise _upswing.InputError(f"{where}: expected finite numbers, got others")
        return found

    t = array("t")
    n = len(t) if t.ndim == 1 else 0
    array("t", (n,))
    columns = {"time": t}
    q = array("q", (n, 2))
    columns |= {"pos_meas1": q[:, 0], "pos_meas2": q[:, 1]}
    if prefix + "dq" in arrays:
        w = array("dq", (n, 2))
        columns |= {"vel_meas1": w[:, 0], "vel_meas2": w[:, 1]}
    if prefix + "u" not in arrays:
        return columns
    u = array("u", (n, 2), (n,))
    if u.ndim == 1:
        if torque_joint is None:
            raise _upswing.InputError(
                f"{source}: {prefix}u: expected torque_joint=1 or 2 with torques of one joint, got None")
        u = np.column_stack([u if joint == torque_joint else np.zeros(n) for joint in (1, 2)])
    return columns | {"tau_con1": u[:, 0], "tau_con2": u[:, 1]}
