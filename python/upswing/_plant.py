"""Reads a double pendulum from an MJCF or URDF file, for the program `upswing plant`, which runs this
file by itself (see main). MuJoCo compiles the model. This file turns it into a plant, and moves the model
from random states, so that the program can compare its own motions.

Symbols as in src/pendulum/equations.h; theta: the angles of the file's joints [rad], q: those of the plant.
"""

from __future__ import annotations

import json
import math
import os
import re
import stat
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

os.environ["MUJOCO_GL"] = "disable"  # nothing is drawn
try:
    import mujoco
    import numpy as np
except ImportError as missing:
    sys.exit(f"upswing: plant: {missing}: expected Python 3.11 or newer with the package mujoco-core==4.0.0; "
             "make one by: python3 -m venv plant && plant/bin/pip install mujoco-core==4.0.0 && "
             "export UPSWING_PYTHON=$PWD/plant/bin/python")

# Limits for files of strangers.
MOST_BYTES, MOST_MESH_BYTES = 1 << 20, 1 << 24  # of an XML file, of all meshes
MOST_INCLUDES, MOST_ELEMENTS, MOST_DEPTH = 20, 5000, 100

NO_END = "centre of mass, because the link has neither sites nor shapes"
MOTIONS, PERIODS = 200, 50  # compared motions; control periods of each
TURNS = 4 * math.pi  # rad; a joint limit that is further away does not count
ALIGNED = 1e-4  # rad, largest angle between directions that count as parallel
ZERO = 1e-12  # a length [m] for 0, which a plant file would read as half of the link

# Elements that only draw, measure or reserve memory; elements that multiply others or need plugins.
UNUSED = {"visual", "statistic", "size", "custom", "sensor", "keyframe", "texture", "material", "skin",
          "camera", "light"}
REFUSED = {"plugin", "extension", "composite", "flexcomp", "flex", "deformable", "replicate", "attach",
           "model", "hfield"}
FOLDERS = ("meshdir", "assetdir", "texturedir", "strippath")  # attributes of `compiler`


class Refusal(Exception):
    """The file is no plant; the message says why."""


class Physics(NamedTuple):
    """How the program moves a plant."""

    timestep: float  # s
    steps: int  # Runge-Kutta steps in a control period
    friction_slope: float  # k in the dry friction c·atan(k w), s/rad


def printable(text: str) -> str:
    """Text of a stranger for messages and comments: one line of at most 80 characters."""
    shown = "".join(c if c.isprintable() else "?" for c in text)
    return shown if len(shown) <= 80 else shown[:77] + "..."


# Reading: the file, its includes and its meshes, without anything outside of its folder.

def read_bytes(path: Path, limit: int, where: str) -> bytes:
    """A regular file of at most `limit` bytes; never waits for a pipe. `where` begins messages."""
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise Refusal(f"{where}expected a regular file")
            data = file.read(limit + 1)
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise Refusal(f"{where}cannot read: {why}") from error
    if len(data) > limit:
        raise Refusal(f"{where}expected at most {limit} bytes, got more")
    return data


def parse(path: Path, where: str) -> ET.Element:
    """The root element of an XML file. `where` begins messages."""
    try:
        text = read_bytes(path, MOST_BYTES, where).decode("utf-8-sig")
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            raise Refusal(f"{where}expected no DOCTYPE and no ENTITY")
        parser: Any = ET.XMLPullParser(("start", "end"))
        parser.feed(text)
        parser.close()
    except (UnicodeDecodeError, ET.ParseError, ValueError, LookupError) as error:
        raise Refusal(f"{where}expected XML in UTF-8: {printable(str(error))}") from error
    depth = 0
    root: ET.Element | None = None
    for event, element in parser.read_events():
        root = element if root is None else root
        depth += 1 if event == "start" else -1
        if depth > MOST_DEPTH:
            raise Refusal(f"{where}expected elements at most {MOST_DEPTH} deep")
    assert root is not None
    return root


class Document:
    """A file with its includes and meshes. `leave_out`: names of --drop."""

    def __init__(self, path: Path, leave_out: set[str]) -> None:
        self.folder, self.leave_out = path.parent.resolve(), leave_out
        self.left_out: list[str] = []  # what --drop left out
        self.files = [path]  # all files that were read
        self.assets: dict[str, bytes] = {}
        self._includes = 0
        self.root = parse(path, "")
        if self.root.tag not in ("mujoco", "robot"):
            raise Refusal(f"expected MJCF (<mujoco>) or URDF (<robot>), got <{printable(self.root.tag)}>")
        self.is_urdf = self.root.tag == "robot"
        self._include(self.root)
        if sum(1 for _ in self.root.iter()) > MOST_ELEMENTS:
            raise Refusal(f"expected at most {MOST_ELEMENTS} elements, got more")
        # Joints that have a motor in a URDF file.
        self.driven = {joint.get("name") for joint in self.root.iterfind("transmission/joint")}
        self._simplify()
        self._load_meshes()
        if self.is_urdf:
            self._weld_base()

    def _inside(self, name: str) -> Path | None:
        """The path of a file in the folder of the main file or below; None for another one."""
        try:
            path = (self.folder / re.sub("^package://[^/]*/", "", name)).resolve()
        except (OSError, ValueError, RuntimeError):
            return None
        return path if path.is_relative_to(self.folder) and path.exists() else None

    def _include(self, element: ET.Element) -> None:
        """Puts the content of included files in their place."""
        for child in list(element):
            if child.tag != "include":
                self._include(child)
                continue
            self._includes += 1
            if self._includes > MOST_INCLUDES:
                raise Refusal(f"expected at most {MOST_INCLUDES} included files")
            name = child.get("file", "")
            path, place = self._inside(name), list(element).index(child)
            element.remove(child)
            if path is not None:
                content = parse(path, f"{printable(name)}: ")
                self.files.append(path)
                self._include(content)
                for part in reversed(content):
                    element.insert(place, part)
            elif "includes" in self.leave_out:
                self.left_out.append(f"includes: {printable(name)}")
            else:
                raise Refusal(f"include: expected a file in {printable(str(self.folder))}, got "
                              f"{printable(name)}; --drop includes leaves it out")

    def _simplify(self) -> None:
        """Removes what does not move the links."""
        for parent in list(self.root.iter()):
            for child in list(parent):
                if child.tag in REFUSED:
                    raise Refusal(f"a plant file cannot hold <{child.tag}>")
                if child.tag in UNUSED:
                    parent.remove(child)
                elif child.tag == "collision" and "contacts" in self.leave_out:
                    parent.remove(child)
            parent.attrib.pop("material", None)

    def _load_meshes(self) -> None:
        """Loads the files of meshes, and gives them new names."""
        folders: dict[str, str] = {}
        for element in self.root.iter("compiler"):
            folders |= {name: element.attrib.pop(name) for name in FOLDERS if name in element.attrib}
        below = folders.get("meshdir", folders.get("assetdir", ""))
        for element in self.root.iter():
            if element.tag == "mesh" and (element.get("file") or element.get("filename")):
                key = "filename" if element.get("filename") else "file"
                name = element.attrib[key]
                path = self._inside(os.path.join(below, name)) or (self._inside(name) if self.is_urdf else None)
                if path is None:
                    why = "; --drop contacts leaves collision shapes out" if self.is_urdf else ""
                    raise Refusal(f"mesh: expected a file in {printable(str(self.folder))}, got "
                                  f"{printable(name)}{why}")
                left = MOST_MESH_BYTES - sum(map(len, self.assets.values()))
                own = f"mesh{len(self.assets)}{path.suffix.lower()}"
                self.assets[own] = read_bytes(path, left, f"{printable(name)}: ")
                self.files.append(path)
                if key == "file":
                    element.attrib.setdefault("name", Path(name).stem)
                element.set(key, own)
            elif any(name.startswith("file") for name in element.attrib):
                raise Refusal(f"<{printable(element.tag)}>: expected no file besides includes and meshes")

    def _weld_base(self) -> None:
        """Adds what MuJoCo needs: the link `world`, and a compiler that changes no inertia."""
        links = {link.get("name") for link in self.root.iterfind("link")}
        parents = {parent.get("link") for parent in self.root.iterfind("joint/parent")}
        if "world" in parents - links:
            self.root.insert(0, ET.Element("link", name="world"))
        extension = self.root.find("mujoco")
        if extension is None:
            extension = ET.SubElement(self.root, "mujoco")
        compiler = extension.find("compiler")
        if compiler is None:
            compiler = ET.SubElement(extension, "compiler")
        compiler.attrib |= {"discardvisual": "true", "balanceinertia": "false"}

    def compile(self) -> mujoco.MjModel:
        try:
            text = ET.tostring(self.root, encoding="unicode")
            return mujoco.MjModel.from_xml_string(text, self.assets)
        except (ValueError, mujoco.FatalError) as error:
            words = " ".join(str(error).split())
            raise Refusal(f"MuJoCo: {printable(words)}") from error


# What a plant file cannot hold.

class Feature:
    """A property of the model that a plant cannot have: a name for --drop, the values, and a function
    that removes it from the model; None if that is not possible."""

    def __init__(self, name: str, values: str, remove: Callable[[], None] | None = None) -> None:
        self.name, self.values, self.remove = name, values, remove


class Pendulum:
    """The two links of a model, as rigid bodies in a plane."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        self._expect_two_hinges()
        self.names = [model.joint(k).name or f"joint {k + 1}" for k in range(2)]
        self.shown = [printable(name) for name in self.names]
        self.links = [int(model.body_weldid[model.jnt_bodyid[k]]) for k in range(2)]
        above = [int(model.body_weldid[model.body_parentid[link]]) for link in self.links]
        if above != [0, self.links[0]]:
            raise Refusal(f"expected joint {self.shown[0]} on the ground and joint {self.shown[1]} at the "
                          "end of its link")
        self.measure()

    def _expect_two_hinges(self) -> None:
        kinds = {mujoco.mjtJoint.mjJNT_FREE: "free base", mujoco.mjtJoint.mjJNT_BALL: "ball joint",
                 mujoco.mjtJoint.mjJNT_SLIDE: "slide joint (a cart)", mujoco.mjtJoint.mjJNT_HINGE: "hinge"}
        found = [f"{kinds[mujoco.mjtJoint(self.model.jnt_type[k])]} {printable(self.model.joint(k).name)}".strip()
                 for k in range(self.model.njnt)]
        if self.model.njnt != 2 or any(self.model.jnt_type != int(mujoco.mjtJoint.mjJNT_HINGE)):
            shown = ", ".join(found[:6]) + (", ..." if len(found) > 6 else "")
            raise Refusal(f"expected two hinges and no other joint, got {shown or 'no joint'}")

    def measure(self) -> None:
        """Computes the geometry in the file's zero pose, projected on the plane of motion."""
        model, data = self.model, self.data
        data.qpos[:] = model.qpos0
        mujoco.mj_forward(model, data)
        axis1, axis2 = data.xaxis
        self.axis = axis1
        self.sign2 = 1 if axis1 @ axis2 > 0 else -1  # of theta2 in q2
        turn = float(np.linalg.norm(np.cross(axis1, axis2)))
        if turn > ALIGNED:
            raise Refusal(f"expected parallel axes, got {math.degrees(math.asin(min(1, turn))):.4g} degrees "
                          "between the axes of both joints")
        gravity = model.opt.gravity
        if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY or not np.linalg.norm(gravity):
            raise Refusal("expected gravity, got none")
        self.tilt = math.asin(min(1, abs(gravity @ axis1) / np.linalg.norm(gravity)))  # rad
        self.gravity = float(np.linalg.norm(self._flat(gravity)))
        self.down = self._flat(gravity) / self.gravity if self.gravity else data.xmat[0][:3]
        arm = self._flat(data.xanchor[1] - data.xanchor[0])
        self.l1 = float(np.linalg.norm(arm))
        if self.l1 < 1e-6:
            raise Refusal("expected a distance between the axes of both joints, got none")
        self.along1 = arm / self.l1
        self.across1 = np.cross(axis1, self.along1)
        (self.m1, centre1, self.I1), (self.m2, centre2, self.I2) = map(self._rigid, self.links)
        middle = self._flat(centre1 - data.xanchor[0])
        self.c1, self.offset = float(middle @ self.along1), float(middle @ self.across1)
        self.arm2 = self._flat(centre2 - data.xanchor[1])
        self.c2 = float(np.linalg.norm(self.arm2))
        self.l2, self.l2_from = self._reach()
        along2 = self.arm2 / self.c2 if self.c2 > 1e-9 * self.l1 else self.along1
        # q in the zero pose.
        self.zero = [self._angle(self.along1, self.down), self._angle(along2, self.along1)]

    def _flat(self, vector: Any) -> Any:
        """The part of a vector in the plane of motion."""
        return vector - self.axis * (vector @ self.axis)

    def _angle(self, to: Any, start: Any) -> float:
        """Angle about the axis of joint 1 from one direction to another [rad]."""
        return math.atan2(np.cross(self.axis, start) @ to, start @ to)

    def _bodies(self, link: int) -> Any:
        return np.flatnonzero(self.model.body_weldid == link)

    def _rigid(self, link: int) -> tuple[float, Any, float]:
        """Mass [kg], centre of mass [m] and moment of inertia about it and the axis [kg·m²] of all bodies
        welded to a link."""
        bodies, data = self._bodies(link), self.data
        masses = self.model.body_mass[bodies]
        centre = masses @ data.xipos[bodies] / masses.sum()
        inertia = 0.0
        for body, mass in zip(bodies, masses):
            axis = data.ximat[body].reshape(3, 3).T @ self.axis
            away = self._flat(data.xipos[body] - centre)
            inertia += axis @ (self.model.body_inertia[body] * axis) + mass * away @ away
        return float(masses.sum()), centre, float(inertia)

    def _reach(self) -> tuple[float, str]:
        """Length of link 2 and the rule that gives it: its farthest site, else the end of its farthest
        shape along the shape's longest axis, else its centre of mass."""
        model, data, bodies = self.model, self.data, self._bodies(self.links[1])
        far = [(self._distance(data.site_xpos[k]), f"site {printable(model.site(k).name)}".strip())
               for k in range(model.nsite) if model.site_bodyid[k] in bodies]
        if not far or max(far)[0] < 1e-6:
            far = [(self._distance(end), f"end of geom {printable(model.geom(k).name)}".strip())
                   for k in range(model.ngeom) if model.geom_bodyid[k] in bodies for end in self._ends(k)]
        if not far or max(far)[0] < 1e-6:
            far = [(self.c2, NO_END)]
        return max(far)

    def _distance(self, point: Any) -> float:
        return float(np.linalg.norm(self._flat(point - self.data.xanchor[1])))

    def _ends(self, geom: int) -> Iterator[Any]:
        """Both ends of a shape, without a capsule's caps."""
        sizes, kind = self.model.geom_size[geom], int(self.model.geom_type[geom])
        place, turn = self.data.geom_xpos[geom], self.data.geom_xmat[geom].reshape(3, 3)
        if kind in (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER):
            half = np.array([0, 0, sizes[1]])
        elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
            half = np.zeros(3)
        else:
            half = np.where(np.arange(3) == np.argmax(sizes), sizes, 0)
        yield place + turn @ half
        yield place - turn @ half

    # The features.

    def features(self) -> Iterator[Feature]:
        """Everything that a plant file cannot hold."""
        model, disabled = self.model, self.model.opt.disableflags
        flags = mujoco.mjtDisableBit
        constraints = not disabled & flags.mjDSBL_CONSTRAINT

        def zero(*fields: str) -> Callable[[], None]:
            def remove() -> None:
                for field in fields:
                    getattr(model, field)[:] = 0
            return remove

        if not disabled & flags.mjDSBL_SPRING:
            yield from self._of_joints("stiffness", model.jnt_stiffness, "N·m/rad",
                                       zero("jnt_stiffness", "jnt_stiffnesspoly"))
            if np.any(model.jnt_stiffnesspoly) and not np.any(model.jnt_stiffness):
                yield Feature("stiffness", "a nonlinear spring", zero("jnt_stiffnesspoly"))
        if np.any(model.dof_dampingpoly) and not disabled & flags.mjDSBL_DAMPER:
            yield Feature("nonlinear-damping", "coefficients of powers of the velocity", zero("dof_dampingpoly"))
        if constraints and not disabled & flags.mjDSBL_LIMIT:
            reached = [self._limit(k) for k in range(2) if self._is_reached(k)]
            if reached:
                yield Feature("limits", ", ".join(reached), zero("jnt_limited"))
        if constraints and not disabled & flags.mjDSBL_FRICTIONLOSS:
            yield from self._of_joints("frictionloss", model.dof_frictionloss, "N·m", zero("dof_frictionloss"))
        if constraints and not disabled & flags.mjDSBL_EQUALITY and np.any(model.eq_active0):
            yield Feature("equality", f"{int(sum(model.eq_active0))} constraints", self._without_equality)
        if model.ntendon:
            yield Feature("tendons", f"{model.ntendon}", zero(
                "tendon_stiffness", "tendon_stiffnesspoly", "tendon_damping", "tendon_dampingpoly",
                "tendon_limited", "tendon_frictionloss", "tendon_armature"))
        if model.opt.density or model.opt.viscosity:
            yield Feature("fluid", f"density {model.opt.density:g} kg/m³, viscosity {model.opt.viscosity:g} "
                          f"Pa·s, wind {' '.join(f'{x:g}' for x in model.opt.wind)} m/s", self._without_fluid)
        if np.any(model.body_gravcomp):
            yield Feature("gravcomp", f"up to {max(model.body_gravcomp):g}", self._without_gravcomp)
        if self.tilt > ALIGNED:
            yield Feature("tilt", f"the plane of motion leans by {math.degrees(self.tilt):.4g} degrees; dropped: "
                          f"gravity is {self.gravity:.6g} m/s², its exact part in the plane", lambda: None)
        if abs(self.offset) > 1e-6 * self.l1:
            yield Feature("offset", f"centre of mass of link 1 is {self.offset:.6g} m off the line through both "
                          "joints", self._without_offset)
        if self.c1 < -1e-9 * self.l1:
            yield Feature("counterweight", f"centre of mass of link 1 is {-self.c1:.6g} m behind joint 1")
        if constraints and not disabled & flags.mjDSBL_CONTACT:
            touching = self._touching()
            if touching:
                yield Feature("contacts", touching, self._without_contacts)

    def _of_joints(self, name: str, values: Any, unit: str, remove: Callable[[], None]) -> Iterator[Feature]:
        texts = [f"{joint} {value:g} {unit}" for joint, value in zip(self.shown, values) if value]
        if texts:
            yield Feature(name, ", ".join(texts), remove)

    def _is_reached(self, k: int) -> bool:
        if not self.model.jnt_limited[k]:
            return False
        sign = (1, self.sign2)[k]
        ends = [self.zero[k] + sign * (end - self.model.qpos0[k]) for end in self.model.jnt_range[k]]
        return bool(min(ends) > -TURNS or max(ends) < TURNS)

    def _limit(self, k: int) -> str:
        low, high = self.model.jnt_range[k]
        return f"{self.shown[k]} {low:.4g} to {high:.4g} rad"

    def _touching(self) -> str:
        """The first two shapes that touch in a grid of poses; empty: none."""
        model, data = self.model, self.data
        angles = np.linspace(-np.pi, np.pi, 36, endpoint=False)
        for theta1 in angles:
            for theta2 in angles:
                data.qpos[:] = model.qpos0 + (theta1, theta2)
                mujoco.mj_fwdPosition(model, data)
                if data.ncon:
                    names = [printable(model.geom(g).name) or f"geom {g}" for g in data.contact[0].geom]
                    return f"{names[0]} touches {names[1]} at {theta1:.3g}, {theta2:.3g} rad"
        return ""

    def _without_equality(self) -> None:
        self.model.eq_active0[:] = 0
        self.data = mujoco.MjData(self.model)

    def _without_fluid(self) -> None:
        self.model.opt.density = self.model.opt.viscosity = 0

    def _without_gravcomp(self) -> None:
        self.model.body_gravcomp[:] = 0

    def _without_contacts(self) -> None:
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT

    def _without_offset(self) -> None:
        """Moves the heaviest body of link 1, so that the link's centre of mass is on the line."""
        model, bodies = self.model, self._bodies(self.links[0])
        body = bodies[np.argmax(model.body_mass[bodies])]
        move = -self.offset * self.across1 * self.m1 / model.body_mass[body]
        model.body_ipos[body] += self.data.xmat[body].reshape(3, 3).T @ move
        model.body_sameframe[body] = model.body_simple[:] = model.dof_simplenum[:] = 0


# The motor.

class Motor:
    """The motor of the plant, and how it acts on the model."""

    def __init__(self, pendulum: Pendulum, document: Document, job: dict[str, Any]) -> None:
        self.model, self.data, self.pendulum = pendulum.model, pendulum.data, pendulum
        self.left_out: list[str] = []
        self.model.opt.disableactuator = 0
        self.model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
        actuators = self._actuators(document)
        given = document.driven if document.is_urdf else set()
        driven = set(actuators) | {k for k in range(2) if pendulum.names[k] in given}
        self.k = self._joint(driven, job["motor"])  # 0 or 1
        self.actuator: int | None = actuators.get(self.k)
        # The file's motor turns the plant's way, or the other one.
        self.sign = (1, pendulum.sign2)[self.k]
        for i in range(self.model.nactuator):
            if i != self.actuator:
                self.model.actuator_gear[i] = 0
        # 1: a positive control is a positive torque of the plant, -1: a negative one; 0: no control.
        self.turns = 0 if self.actuator is None else self.sign * np.sign(self._slope(self.actuator))
        self.limit, self.source = self._limit(job["torque_limit"])

    def _actuators(self, document: Document) -> dict[int, int]:
        """The motor of each joint that has one."""
        model = self.model
        motors: dict[int, int] = {}
        others: list[str] = []
        for i in range(model.nactuator):
            name = printable(model.actuator(i).name) or f"actuator {i}"
            if not self._is_motor(i):
                others.append(name)
            elif motors.setdefault(int(model.actuator_trnid[i, 0]), i) != i:
                raise Refusal(f"expected one motor at a joint, got another one: {name}")
        if others and "actuators" not in document.leave_out:
            raise Refusal("a plant file cannot hold actuators that are no plain motors (servos, filters, delays, "
                          f"tendons): {', '.join(others)}; --drop actuators leaves them out")
        self.left_out += [f"actuators: {name}" for name in others]
        return motors

    def _is_motor(self, i: int) -> bool:
        """Whether an actuator is a torque about a joint that follows its control at once."""
        model = self.model
        joints = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
        return bool(int(model.actuator_trntype[i]) in joints
                    and int(model.actuator_gaintype[i]) == mujoco.mjtGain.mjGAIN_FIXED
                    and int(model.actuator_biastype[i]) == mujoco.mjtBias.mjBIAS_NONE
                    and int(model.actuator_dyntype[i]) == mujoco.mjtDyn.mjDYN_NONE
                    and not np.any(model.actuator_delay[i]) and not np.any(model.actuator_damping[i])
                    and not np.any(model.actuator_dampingpoly[i]) and not np.any(model.actuator_armature[i])
                    and self._slope(i))

    def _slope(self, i: int) -> float:
        """Torque about the file's joint for a control of 1 [N·m]."""
        return float(self.model.actuator_gainprm[i, 0] * self.model.actuator_gear[i, 0])

    def _joint(self, driven: set[int], asked: int) -> int:
        shown = self.pendulum.shown
        if not asked and not driven:
            raise Refusal("expected a motor, got none; choose a joint with --motor 1 or 2 and give --torque-limit")
        if not asked and len(driven) == 2:
            raise Refusal(f"a plant file cannot hold two motors: choose one of {shown[0]} (--motor 1) and "
                          f"{shown[1]} (--motor 2)")
        chosen = asked - 1 if asked else min(driven)
        self.left_out += [f"motor of {shown[k]}: --motor {chosen + 1}" for k in driven - {chosen}]
        return chosen

    def _limit(self, asked: float | None) -> tuple[float, str]:
        """The largest torque [N·m] and where it comes from."""
        model, k = self.model, self.k
        if asked is not None:
            self._act_directly()
            return asked, "--torque-limit"
        if self.actuator is not None:
            top, bottom = self._torque(1e9), self._torque(-1e9)
            if max(abs(top), abs(bottom)) > 1e6:
                raise Refusal("expected a limited torque (ctrlrange, forcerange or actuatorfrcrange), got none; "
                              "give --torque-limit")
            if abs(top + bottom) > 1e-9 * abs(top):
                raise Refusal(f"a plant file cannot hold a torque between {min(top, bottom):g} and "
                              f"{max(top, bottom):g} N·m; give --torque-limit")
            return abs(top), f"actuator {printable(model.actuator(self.actuator).name)} at full control".replace(
                "  ", " ")
        if model.jnt_actfrclimited[k] and model.jnt_actfrcrange[k, 1] == -model.jnt_actfrcrange[k, 0] > 0:
            self._act_directly()
            return float(model.jnt_actfrcrange[k, 1]), "effort of the joint"
        raise Refusal("expected a limited torque (a motor, or an effort in URDF), got none; give --torque-limit")

    def _torque(self, control: float) -> float:
        """Torque about the file's joint under a control [N·m]."""
        data = self.data
        data.qpos[:], data.qvel[:], data.ctrl[:] = self.model.qpos0, 0, 0
        data.ctrl[self.model.actuator_ctrladr[self.actuator]] = control
        mujoco.mj_forward(self.model, data)
        return float(data.qfrc_actuator[self.k])

    def _act_directly(self) -> None:
        """Applies torques to the joint instead of controls, which have another limit."""
        self.model.actuator_gear[:] = 0
        self.actuator = None

    def drive(self, data: mujoco.MjData, torque: float) -> None:
        """Applies a torque of the plant's motor [N·m] until the next one."""
        if self.actuator is None:
            data.qfrc_applied[self.k] = self.sign * torque
        else:
            data.ctrl[self.model.actuator_ctrladr[self.actuator]] = (
                self.sign * torque / self._slope(self.actuator))


# The plant, and motions of the model to compare it with.

class Parameter:
    """A setting of the plant file: value, unit and where it comes from."""

    def __init__(self, name: str, value: float, unit: str, source: str) -> None:
        self.name, self.value, self.unit, self.source = name, float(value), unit, source

    def line(self) -> str:
        unit = f"{self.unit}: " if self.unit else ""
        number = f"{self.value:.0f}" if self.value.is_integer() and abs(self.value) < 1e6 else repr(self.value)
        return f"{self.name} = {number}  # {unit}{self.source}\n"


def parameters_of(p: Pendulum, motor: Motor, coulomb: Any, length2: float | None) -> list[Parameter]:
    """All settings of a plant file."""
    model = p.model
    damping = np.zeros(2)
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_DAMPER:
        damping = model.dof_damping
    a1, a2 = model.dof_armature
    bodies = [", ".join(printable(model.body(b).name) or f"body {b}" for b in p._bodies(link)[:8])
              for link in p.links]
    friction = "frictionloss · 2/π, see above" if any(coulomb) else "no frictionloss"
    reach = (p.l2, p.l2_from) if length2 is None else (length2, "--length2")
    parameters = [
        Parameter("mass1", p.m1, "kg", bodies[0]),
        Parameter("mass2", p.m2, "kg", bodies[1]),
        Parameter("length1", p.l1, "m", f"{p.shown[0]} to {p.shown[1]}"),
        Parameter("length2", reach[0], "m", f"{p.shown[1]} to {reach[1]}" if length2 is None else reach[1]),
        Parameter("center1", max(p.c1, ZERO), "m", f"{p.shown[0]} to the centre of mass"),
        Parameter("center2", max(p.c2, ZERO), "m", f"{p.shown[1]} to the centre of mass"),
        Parameter("inertia1", p.I1, "kg·m²", "about the centre of mass and the axis"),
        Parameter("inertia2", p.I2, "kg·m²", "about the centre of mass and the axis"),
        Parameter("armature", a2, "kg·m²", f"armature of {p.shown[1]}"),
        Parameter("damping1", damping[0], "N·m·s/rad", f"damping of {p.shown[0]}"),
        Parameter("damping2", damping[1], "N·m·s/rad", f"damping of {p.shown[1]}"),
        Parameter("coulomb1", coulomb[0], "N·m", friction),
        Parameter("coulomb2", coulomb[1], "N·m", friction),
        Parameter("gravity", p.gravity, "m/s²", "gravity in the plane of motion"),
        Parameter("torque_limit", motor.limit, "N·m", motor.source),
        Parameter("actuated_joint", motor.k + 1, "", p.shown[motor.k]),
        Parameter("rotor_inertia", 0, "kg·m²", "in the armature"),
        Parameter("gear_ratio", 1, "", "no effect without a rotor inertia"),
    ]
    if a1 != a2:
        parameters.append(Parameter("armature1", a1, "kg·m²", f"armature of {p.shown[0]}"))
    return parameters


def move(p: Pendulum, motor: Motor, physics: Physics, starts: Any, torques: Any, coulomb: Any) -> Any:
    """Angles q (motions, periods + 1, 2) of the model from states of the plant (motions, 4), under torques
    (motions, periods) [N·m] that are held for a control period each, with dry friction c (2) [N·m]."""
    model, data = p.model, mujoco.MjData(p.model)
    signs, zero = np.array([1, p.sign2]), np.array(p.zero)
    model.opt.timestep, model.opt.integrator = physics.timestep, mujoco.mjtIntegrator.mjINT_RK4
    angles = np.empty((*torques.shape[:1], torques.shape[1] + 1, 2))

    def friction(_: Any, data: mujoco.MjData) -> None:
        data.qfrc_passive[:2] -= coulomb * np.arctan(physics.friction_slope * data.qvel[:2])

    if any(coulomb):
        mujoco.set_mjcb_passive(friction)
    for n, start in enumerate(starts):
        mujoco.mj_resetData(model, data)
        data.qpos[:2] = model.qpos0 + signs * (start[:2] - zero)
        data.qvel[:2] = signs * start[2:]
        angles[n, 0] = start[:2]
        for t, torque in enumerate(torques[n]):
            motor.drive(data, torque)
            mujoco.mj_step(model, data, physics.steps)
            angles[n, t + 1] = zero + signs * (data.qpos[:2] - model.qpos0)
    mujoco.set_mjcb_passive(None)
    return angles


def random_motions(p: Pendulum, motor: Motor) -> tuple[Any, Any]:
    """Random states (motions, 4) and torques (motions, periods) of the plant."""
    random = np.random.default_rng(1)
    fast = 2 * math.sqrt(p.gravity / p.l1)  # rad/s, as a swinging pendulum
    starts = random.uniform(-1, 1, (MOTIONS, 4)) * (math.pi, math.pi, fast, fast)
    return starts, random.uniform(-1, 1, (MOTIONS, PERIODS)) * motor.limit


def toml_of(p: Pendulum, parameters: list[Parameter], remarks: list[str]) -> str:
    """The text of the plant file."""
    return ("".join(f"# {remark}\n" for remark in remarks) + "\n[plant]\n"
            + "".join(parameter.line() for parameter in parameters))


def remarks_of(p: Pendulum, motor: Motor, left_out: list[str], length2_given: bool) -> list[str]:
    """Lines about the angles and torques of the file in terms of the plant's, and about everything left out."""
    remarks = []
    for k, sign in enumerate((1, p.sign2)):
        zero = f"{p.zero[k]:.9g} {'+' if sign > 0 else '-'} " if abs(p.zero[k]) > 1e-12 or sign < 0 else ""
        ref = p.model.qpos0[k]
        qpos = f", where its qpos is {ref:.9g}" if ref else ""
        remarks.append(f"q{k + 1} = {zero}{p.shown[k]} [rad], the angle from the file's zero pose{qpos}")
    if motor.turns:
        remarks.append(f"A positive control is a {'positive' if motor.turns > 0 else 'negative'} torque here.")
    if p.l2_from == NO_END and not length2_given:
        remarks.append(f"length2 is {p.l2:g} m, the distance to the {NO_END}; --length2 sets it")
    return remarks + [f"Left out by --drop: {text}" if "--" not in text else f"Left out: {text}"
                      for text in left_out]


def remove_features(p: Pendulum, leave_out: set[str], convert_friction: bool) -> list[str]:
    """Removes the features that --drop names and returns their texts. Raises Refusal if others are there."""
    removed, refused = [], []
    for feature in p.features():
        converted = feature.name == "frictionloss" and convert_friction
        if feature.remove is None or not (converted or feature.name in leave_out):
            refused.append(feature)
            continue
        feature.remove()
        if not converted:
            removed.append(f"{feature.name}: {feature.values}")
    if refused:
        texts = "; ".join(f"{feature.name} ({feature.values})" for feature in refused)
        names = " ".join(f"--drop {feature.name}" for feature in refused if feature.remove)
        advice = f"; {names} leaves out what it names" if names else ""
        if any(feature.name == "frictionloss" for feature in refused):
            advice += "; --convert-friction approximates frictionloss"
        raise Refusal(f"a plant file cannot hold {texts}{advice}")
    return removed


def periods_for(plant: str) -> tuple[float, int]:
    """The control period [s] that the program takes for a plant (TOML), and the Runge-Kutta steps in it."""
    print(json.dumps({"toml": plant}), flush=True)
    answer = sys.stdin.readline()
    if not answer:  # the program refuses the plant
        sys.exit(1)
    period, steps = answer.split()
    return float(period), int(steps)


def read_plant(job: dict[str, Any]) -> dict[str, Any]:
    """The plant of a file as TOML, with the files read and random motions of the file's model."""
    document = Document(Path(job["file"]), set(job["drop"]))
    p = Pendulum(document.compile())
    frictionloss = p.model.dof_frictionloss.copy()
    left_out = document.left_out + remove_features(p, document.leave_out, job["convert_friction"])
    converted = "frictionloss" not in document.leave_out and bool(
        np.any(frictionloss) and not np.any(p.model.dof_frictionloss))
    coulomb = frictionloss * 2 / math.pi if converted else np.zeros(2)
    p.measure()
    motor = Motor(p, document, job)
    remarks = remarks_of(p, motor, left_out + motor.left_out, job["length2"] is not None)
    parameters = parameters_of(p, motor, coulomb, job["length2"])
    period, steps = periods_for(toml_of(p, parameters, []))
    physics = Physics(timestep=period / steps, steps=steps, friction_slope=job["friction_slope"])
    starts, torques = random_motions(p, motor)
    angles = move(p, motor, physics, starts, torques, coulomb)
    if converted:
        p.model.dof_frictionloss[:] = frictionloss
        other = np.abs(move(p, motor, physics, starts, torques, np.zeros(2)) - angles)
        remarks.append(f"frictionloss c became c·2/π·atan({physics.friction_slope:g} w), which is c at speed and "
                       "weaker below about "
                       f"0.1 rad/s; over the {MOTIONS} motions this law moves the joints by {np.median(other[:, -1]):.2g} "
                       f"rad (median) and {other.max():.2g} rad (largest) from MuJoCo's")
    if not np.all(np.isfinite(angles)):
        raise Refusal(f"MuJoCo's motion diverges in Runge-Kutta steps of {physics.timestep:g} s")
    return {"toml": toml_of(p, parameters, remarks), "remarks": remarks, "starts": starts.tolist(),
            "torques": torques.tolist(), "angles": angles.tolist(),
            "files": [str(file) for file in document.files]}


def main() -> None:
    job = json.loads(sys.argv[1])
    mujoco.set_mju_user_warning(lambda _: None)  # which would write MUJOCO_LOG.TXT
    try:
        result = read_plant(job)
    except Refusal as refusal:
        print(f"upswing: plant: {printable(job['file'])}: {refusal}", file=sys.stderr)
        sys.exit(2)
    print(json.dumps(result, allow_nan=False))


if __name__ == "__main__":
    main()
