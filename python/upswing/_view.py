"""Draws double pendulums with MuJoCo's renderer and viewer: for `render` of the environments, and for
the program `upswing view`, which runs this file by itself (see main)."""

from __future__ import annotations

import contextlib
import fractions
import json
import os
import queue
import sys
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any

PACKAGES = '"mujoco-core[rendering]==4.0.0" pillow av'
INSTALL = f"expected its Python packages: pip install {PACKAGES} (with the wheel: pip install 'upswing[view]')"
os.environ.setdefault("MUJOCO_GL", "egl")  # draws without a display
try:
    import mujoco
    import numpy as np
except ImportError as missing:
    if __name__ != "__main__":
        raise
    sys.exit(f"upswing: view: {missing}: expected Python 3.11 or newer with the packages {PACKAGES}; "
             f"make one by: python3 -m venv view && view/bin/pip install {PACKAGES} && "
             "export UPSWING_PYTHON=$PWD/view/bin/python")
except Exception as broken:  # pylint: disable=broad-exception-caught  # many kinds
    PROBLEM = (f"cannot draw with MUJOCO_GL={os.environ['MUJOCO_GL']}: {broken}: expected its libraries; "
               "egl needs Debian's packages libegl1 and libgl1-mesa-dri")
    if __name__ != "__main__":
        raise ImportError(PROBLEM) from broken
    sys.exit(f"upswing: view: {PROBLEM}")

PERIOD = 0.02  # s, control step
TRAIL = 60  # control steps that the path of the tip shows
FOVY = np.radians(40)  # height of the picture as an angle

TORQUE, PATH = (0.96, 0.55, 0.10, 1.0), (0.95, 0.50, 0.15, 0.8)
GOAL, REACHED = (0.45, 0.55, 0.65, 0.55), (0.20, 0.75, 0.35, 0.9)


class CannotDraw(Exception):
    """Something that drawing needs is missing; the message says what."""


class Scene:
    """Pendulums side by side, in the order of `plants`, with torque, goal and the tip's path.

    The model is for pictures: another program computes the motion.
    """

    def __init__(self, plants: Sequence[dict[str, float]], aspect: float) -> None:
        self.plants = plants
        self.reach = max(plant["length1"] + plant["length2"] for plant in plants)  # m
        spacing = 2.4 * self.reach
        self.places = [spacing * (i - (len(plants) - 1) / 2) for i in range(len(plants))]
        # The whole reach with a margin, in width and height.
        across = (self.places[-1] + 1.2 * self.reach) / aspect
        distance = max(across, 1.2 * self.reach) / np.tan(FOVY / 2)
        self.model = mujoco.MjModel.from_xml_string(self._mjcf(distance))
        self.data = mujoco.MjData(self.model)
        self.torques = [0.0] * len(plants)
        # Of each pendulum: for each link 1 if it is to point up, -1 if down.
        self.goals: Sequence[Sequence[float]] = [(1, 1)] * len(plants)
        self.labels = [""] * len(plants)  # texts below the pendulums
        self._paths: list[deque[tuple[float, float]]] = [deque() for _ in plants]
        self._times: deque[float] = deque()

    def _mjcf(self, distance: float) -> str:
        r = self.reach
        floor, back, thin = -1.15 * r, 0.32 * r, 0.035 * r
        radius = min(0.05, 0.15 * r)
        bodies = ""
        for x, plant in zip(self.places, self.plants):
            l1, l2 = plant["length1"], plant["length2"]
            bodies += f"""
    <geom type="box" pos="{x} {back} {(floor + thin) / 2}" size="{thin} {thin} {(thin - floor) / 2}"
          material="metal"/>
    <geom type="box" pos="{x} {back} {floor + thin}" size="{0.16 * r} {0.16 * r} {thin}"
          material="metal"/>
    <geom type="cylinder" fromto="{x} {radius + 0.01 * r} 0 {x} {back} 0" size="{1.25 * radius}"
          material="motor"/>
    <body pos="{x} 0 0">
      <joint type="hinge" axis="0 1 0"/>
      <geom type="capsule" size="{radius}" fromto="0 0 0 0 0 {-l1}" mass="{plant["mass1"]}"
            material="link1"/>
      <geom type="cylinder" size="{0.55 * radius}" fromto="0 {-1.12 * radius} 0 0 {1.12 * radius} 0"
            mass="0" material="metal"/>
      <body pos="0 0 {-l1}">
        <joint type="hinge" axis="0 1 0"/>
        <geom type="capsule" size="{0.97 * radius}" fromto="0 0 0 0 0 {-l2}" mass="{plant["mass2"]}"
              material="link2"/>
        <geom type="cylinder" size="{0.55 * radius}" fromto="0 {-1.12 * radius} 0 0 {1.12 * radius} 0"
              mass="0" material="metal"/>
      </body>
    </body>"""
        extent = distance / 1.5  # MuJoCo's free camera is 1.5 extents away
        return f"""<mujoco>
  <visual>
    <headlight ambient="0.38 0.38 0.38" diffuse="0.25 0.25 0.25" specular="0.05 0.05 0.05"/>
    <quality offsamples="4" numslices="16" numstacks="8"/>
    <map znear="0.02" zfar="60" force="0.08"/>
    <rgba haze="0.86 0.90 0.94 1" force="0.85 0.20 0.55 1"/>
    <scale forcewidth="0.04"/>
    <global fovy="{np.degrees(FOVY)}" azimuth="{80 if len(self.plants) == 1 else 90}" elevation="-8"/>
  </visual>
  <statistic extent="{extent}" center="0 0 0"/>
  <asset>
    <texture type="skybox" builtin="gradient" rgb1="0.96 0.97 0.99" rgb2="0.66 0.75 0.84" width="64"
             height="384"/>
    <texture name="floor" type="2d" builtin="checker" mark="edge" rgb1="0.80 0.83 0.86"
             rgb2="0.74 0.77 0.81" markrgb="0.66 0.70 0.74" width="256" height="256"/>
    <material name="floor" texture="floor" texuniform="true" texrepeat="{1 / r} {1 / r}"
              specular="0.2" shininess="0.2"/>
    <material name="link1" rgba="0.13 0.30 0.52 1" specular="0.5" shininess="0.6"/>
    <material name="link2" rgba="0.22 0.52 0.80 1" specular="0.5" shininess="0.6"/>
    <material name="metal" rgba="0.62 0.65 0.69 1" specular="0.6" shininess="0.5"/>
    <material name="motor" rgba="0.24 0.27 0.31 1" specular="0.5" shininess="0.5"/>
  </asset>
  <worldbody>
    <light directional="true" pos="{-0.7 * r} {-1.1 * r} {2 * r}" dir="0.35 0.55 -1"
           diffuse="0.62 0.62 0.60" specular="0.25 0.25 0.25" castshadow="false"/>
    <geom type="plane" pos="0 0 {floor}" size="0 0 1" material="floor"/>{bodies}
  </worldbody>
</mujoco>"""

    def show(self, states: Any, torques: Sequence[float], steps: float = 0) -> None:
        """Sets the states (N, 4) [rad, rad/s] and torques (N) [N·m] at a time in control steps. The
        paths begin again unless that is after the last time."""
        states = np.reshape(states, (len(self.plants), 4))
        self.data.qpos[:], self.data.qvel[:] = states[:, :2].ravel(), states[:, 2:].ravel()
        mujoco.mj_forward(self.model, self.data)
        self.torques = list(torques)
        if self._times and steps <= self._times[-1]:
            self._times.clear()
            for path in self._paths:
                path.clear()
        self._times.append(steps)
        for i, path in enumerate(self._paths):
            path.append(self._tip(i))
        while self._times[0] < steps - TRAIL:
            self._times.popleft()
            for path in self._paths:
                path.popleft()

    def at_goal(self, i: int) -> bool:
        """Whether both links are within 30° of the goal."""
        (up1, up2), (q1, q2) = self.goals[i], self.data.qpos[2 * i:2 * i + 2]
        return bool(max(up1 * np.cos(q1), up2 * np.cos(q1 + q2)) < -np.cos(np.pi / 6))

    def pulls(self, perturb: Any) -> list[float]:
        """Torques about all joints (2 N) [N·m] of the mouse that pulls at a link in the viewer."""
        if not perturb.active or perturb.select <= 0:
            return [0.0] * self.model.nv
        self.data.xfrc_applied[:] = 0
        mujoco.mjv_applyPerturbForce(self.model, self.data, perturb)
        force = self.data.xfrc_applied[perturb.select]
        torques = np.zeros(self.model.nv)
        mujoco.mj_applyFT(self.model, self.data, force[:3], force[3:],
                          self.data.xipos[perturb.select], perturb.select, torques)
        return list(torques)

    def mark(self, scene: mujoco.MjvScene) -> None:
        """Adds torque, goal and path to a scene of MuJoCo."""
        for i in range(len(self.plants)):
            self._add_path(scene, i)
            self._add_goal(scene, i)
            self._add_torque(scene, i)
            if self.labels[i]:
                # In a crowd, labels stand in two rows and begin further left.
                left, down = (1.15, 1.14 + 0.35 * (i % 2)) if len(self.plants) > 4 else (0.4, 1.14)
                at = np.array((self.places[i] - left * self.reach, 0, -down * self.reach))
                geom = _new_geom(scene, mujoco.mjtGeom.mjGEOM_LABEL, at, (0.1, 0.1, 0.1, 1))
                geom.label = self.labels[i]

    def _tip(self, i: int) -> tuple[float, float]:
        """Position x, z of the second link's end [m]."""
        q1, q2 = self.data.qpos[2 * i:2 * i + 2]
        l1, l2 = self.plants[i]["length1"], self.plants[i]["length2"]
        return (self.places[i] - l1 * np.sin(q1) - l2 * np.sin(q1 + q2),
                -l1 * np.cos(q1) - l2 * np.cos(q1 + q2))

    def _add_path(self, scene: mujoco.MjvScene, i: int) -> None:
        points = list(self._paths[i])
        for k in range(1, len(points)):
            age = k / len(points)  # 1: newest
            _add(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, 0.010 * self.reach * (0.4 + 0.6 * age),
                 (points[k - 1][0], 0, points[k - 1][1]), (points[k][0], 0, points[k][1]),
                 (*PATH[:3], PATH[3] * age * age), 0.5)

    def _add_goal(self, scene: mujoco.MjvScene, i: int) -> None:
        up1, up2 = self.goals[i]
        top = up1 * self.plants[i]["length1"] + up2 * self.plants[i]["length2"]
        reached = self.at_goal(i)
        ring = _arc((self.places[i], 0, top), 0.075 * self.reach, np.linspace(0, 2 * np.pi, 33))
        for start, end in zip(ring, ring[1:]):
            _add(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, 0.009 * self.reach, start, end,
                 REACHED if reached else GOAL, 0.6 if reached else 0.3)

    def _add_torque(self, scene: mujoco.MjvScene, i: int) -> None:
        """An arrow around the motor, in front of it, that begins at the top: 135° at the limit."""
        share = float(np.clip(self.torques[i] / self.plants[i]["torque_limit"], -1, 1))
        if abs(share) < 0.01:
            return
        q1, arm = self.data.qpos[2 * i], self.plants[i]["length1"]
        motor = (self.places[i], -0.10 * self.reach, 0)
        if self.plants[i].get("actuated_joint", 1) == 2:
            motor = (motor[0] - arm * np.sin(q1), motor[1], -arm * np.cos(q1))
        radius, width = 0.2 * self.reach, 0.014 * self.reach
        end = np.pi + share * 0.75 * np.pi
        shaft = _arc(motor, radius, np.linspace(np.pi, end, 2 + int(24 * abs(share))))
        for a, b in zip(shaft, shaft[1:]):
            _add(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, width, a, b, TORQUE, 0.4)
        head = _arc(motor, radius, end + np.sign(share) * np.linspace(0, 0.5, 13))
        for k, (a, b) in enumerate(zip(head, head[1:])):
            _add(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, 3 * width * (1 - (k + 0.5) / 12), a, b, TORQUE,
                 0.4)


def _arc(centre: tuple[float, float, float], radius: float, angles: Any) -> list[tuple[float, ...]]:
    """Points on a circle; the angles grow as those of the joints do."""
    x, y, z = centre
    return [(x - radius * np.sin(a), y, z - radius * np.cos(a)) for a in angles]


def _add(scene: mujoco.MjvScene, kind: int, width: float, start: Any, end: Any,
         color: tuple[float, ...], emission: float) -> None:
    """Adds a shape between two points; nothing if the scene is full."""
    if scene.ngeom >= scene.maxgeom or np.array_equal(start, end):
        return
    geom = _new_geom(scene, kind, np.zeros(3), color)
    mujoco.mjv_connector(geom, kind, width, np.array(start, float), np.array(end, float))
    geom.emission, geom.specular = emission, 0.1


def _new_geom(scene: mujoco.MjvScene, kind: int, at: Any, color: tuple[float, ...]) -> Any:
    geom = scene.geoms[scene.ngeom]
    scene.ngeom += 1
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), at, np.eye(3).ravel(), np.array(color, np.float32))
    geom.category = mujoco.mjtCatBit.mjCAT_DECOR
    return geom


def _cannot_draw(error: Exception) -> CannotDraw:
    text = str(error).partition("\n")[0]
    if isinstance(error, ModuleNotFoundError):
        return CannotDraw(f"cannot draw: {text}: {INSTALL}")
    return CannotDraw(
        f"cannot draw without a display: {text}: expected EGL (Debian's packages libegl1 and "
        f"libgl1-mesa-dri) and the Python packages {PACKAGES}")


class Canvas:
    """Pictures without a window, of any scenes. `close` frees it."""

    def __init__(self, width: int, height: int) -> None:
        self._rect = mujoco.MjrRect(0, 0, width, height)
        self._camera, self._option = mujoco.MjvCamera(), mujoco.MjvOption()
        self._scene: mujoco.MjvScene | None = None
        try:
            if os.environ["MUJOCO_GL"] == "egl":  # even if `mujoco` was imported before this file
                from mujoco import egl  # pylint: disable=import-outside-toplevel
                self._graphics = egl.GLContext(width, height)
            else:
                self._graphics = mujoco.GLContext(width, height)
        except Exception as error:  # pylint: disable=broad-exception-caught  # many kinds
            raise _cannot_draw(error) from error

    def draw(self, scene: Scene) -> Any:
        """Pixels (height, width, 3) in red, green, blue."""
        self._graphics.make_current()
        if self._scene is None:
            scene.model.vis.global_.offwidth = self._rect.width
            scene.model.vis.global_.offheight = self._rect.height
            try:
                self._context = mujoco.MjrContext(scene.model, mujoco.mjtFontScale.mjFONTSCALE_100)
            except mujoco.FatalError as error:
                raise _cannot_draw(error) from error
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
            self._scene = mujoco.MjvScene(scene.model, 2000)
        mujoco.mjv_defaultFreeCamera(scene.model, self._camera)
        mujoco.mjv_updateScene(scene.model, scene.data, self._option, None, self._camera,
                               mujoco.mjtCatBit.mjCAT_ALL, self._scene)
        scene.mark(self._scene)
        mujoco.mjr_render(self._rect, self._scene, self._context)
        pixels = np.empty((self._rect.height, self._rect.width, 3), np.uint8)
        mujoco.mjr_readPixels(pixels, None, self._rect, self._context)
        return np.flipud(pixels)

    def close(self) -> None:
        if self._scene is not None:
            self._graphics.make_current()
            self._context.free()
            self._scene = None
        self._graphics.free()


class Viewer:
    """MuJoCo's viewer, in a window."""

    def __init__(self, scene: Scene) -> None:
        _check_display()
        from mujoco import viewer  # pylint: disable=import-outside-toplevel  # needs GLFW

        self.scene = scene
        self.keys: queue.SimpleQueue[int] = queue.SimpleQueue()
        self._next = time.monotonic()  # s, see wait
        self._words: list[str] = []  # see say
        others = threading.enumerate()
        self._handle = viewer.launch_passive(scene.model, scene.data, key_callback=self.keys.put,
                                             show_left_ui=False, show_right_ui=False)
        self._threads = [thread for thread in threading.enumerate() if thread not in others]
        with self._handle.lock():
            mujoco.mjv_defaultFreeCamera(scene.model, self._handle.cam)

    def is_open(self) -> bool:
        return bool(self._handle.is_running())

    def pulls(self) -> list[float]:
        """Torques of the mouse, see Scene.pulls."""
        with self._handle.lock():
            return self.scene.pulls(self._handle.perturb)

    def draw(self) -> None:
        """Shows the scene's present state."""
        scene = self._handle.user_scn
        with self._handle.lock():
            scene.ngeom = 0
            self.scene.mark(scene)
        self._handle.sync()

    def say(self, words: list[str]) -> None:
        """Shows words in the upper left corner."""
        if words == self._words:
            return
        self._words = words
        text = (mujoco.mjtFontScale.mjFONTSCALE_100, mujoco.mjtGridPos.mjGRID_TOPLEFT, "   ".join(words), "")
        self._handle.set_texts([text] if words else [])

    def wait(self, seconds: float) -> None:
        """Waits until this long after the last call's wait."""
        self._next = max(self._next + seconds, time.monotonic() - seconds)
        time.sleep(max(0, self._next - time.monotonic()))

    def close(self) -> None:
        """Closes the window. A thread of MuJoCo that outlives Python's end would crash it."""
        self._handle.close()
        for thread in self._threads:
            thread.join(5)


def _check_display() -> None:
    """Raises CannotDraw unless a window can be opened: the viewer's own thread could not say so."""
    try:
        import glfw  # pylint: disable=import-outside-toplevel
    except ImportError as error:
        raise CannotDraw(f"cannot open a window: {error}: {INSTALL}") from error
    if not os.environ.get("DISPLAY") and not os.environ.get("WAYLAND_DISPLAY"):
        raise CannotDraw("cannot open a window: DISPLAY and WAYLAND_DISPLAY are not set: "
                         "expected a display; recordings and rgb_array need none")
    problems: list[str] = []

    def note(_: int, text: Any) -> None:
        problems.append(text.decode(errors="replace"))

    glfw.set_error_callback(note)
    if glfw.init():
        glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
        window = glfw.create_window(16, 16, "upswing", None, None)
        glfw.default_window_hints()
        if window:
            glfw.destroy_window(window)
            return
    raise CannotDraw(f"cannot open a window: {'; '.join(problems)}: expected a display with OpenGL "
                     "(Debian's packages libgl1 and libgl1-mesa-dri)")


# The program that `upswing view` starts. It computes nothing: it asks for states on standard output
# and reads them on standard input.

SPACE, MINUS, EQUAL, BACKSPACE, RIGHT = 32, 45, 61, 259, 262  # GLFW's codes


class Episodes:
    """The episodes of `upswing view`, and what they look like at the present moment."""

    def __init__(self, job: dict[str, Any], aspect: float) -> None:
        self.steps = 0.0  # time, control steps
        self.names = [name.encode("ascii", "replace").decode() for name in job["names"]]
        self.scene = Scene(job["plants"], aspect)
        self.scene.goals = job["goals"]

    def go(self, steps: float, pulls: Sequence[float] = ()) -> None:
        """Goes to another time; back to 0 starts again. `pulls`: torques of the mouse [N·m]."""
        if steps < self.steps or steps == 0:
            self._ask(0, pulls)
        if self.steps < steps - TRAIL:
            self._ask(steps - TRAIL, pulls)
        while self.steps < steps:  # half steps make the path smooth
            asked = min(steps, np.floor(2 * self.steps + 1) / 2)
            self._ask(asked, pulls)
            if self.steps < asked:
                return  # the motion diverged, and the program has started again

    def _ask(self, steps: float, pulls: Sequence[float]) -> None:
        request = " ".join(map(str, (steps, *pulls))) + "\n"
        line = ""
        with contextlib.suppress(ConnectionError):
            os.write(sys.stdout.fileno(), request.encode())  # print could leave a rest to write at the end
            line = sys.stdin.readline()
        if not line:
            sys.exit(0)  # the program has ended
        self.steps, *numbers = map(float, line.split())
        table = np.reshape(numbers, (len(self.names), 5))
        self.scene.show(table[:, :4], table[:, 4].tolist(), self.steps)

    def label(self) -> None:
        """Labels each pendulum with name, time and torque."""
        for i, (name, torque) in enumerate(zip(self.names, self.scene.torques)):
            time_shown = round(self.steps * PERIOD, 6)
            self.scene.labels[i] = f"{name}   {time_shown:.2f} s   {torque:+.2f} N m"


def record(job: dict[str, Any]) -> None:
    """Writes a film or pictures."""
    episodes = Episodes(job, job["width"] / job["height"])
    canvas = Canvas(job["width"], job["height"])

    def frame(k: int) -> Any:
        episodes.go(round(job["first"] + k * job["stride"], 6))
        episodes.label()
        return canvas.draw(episodes.scene)

    with contextlib.closing(canvas):
        _WRITERS[job["kind"]](job, frame)


def _write_png(job: dict[str, Any], frame: Callable[[int], Any]) -> None:
    from PIL import Image  # pylint: disable=import-outside-toplevel

    Image.fromarray(frame(0)).save(job["path"], "PNG")


def _write_folder(job: dict[str, Any], frame: Callable[[int], Any]) -> None:
    from PIL import Image  # pylint: disable=import-outside-toplevel

    for k in range(job["frames"]):
        Image.fromarray(frame(k)).save(os.path.join(job["path"], f"frame-{k:05}.png"))


def _write_gif(job: dict[str, Any], frame: Callable[[int], Any]) -> None:
    from PIL import Image  # pylint: disable=import-outside-toplevel

    # One palette for the whole film keeps the file small, because still parts stay equal.
    some = range(0, job["frames"], -(-job["frames"] // 8))
    palette = Image.fromarray(np.concatenate([frame(k) for k in some])).quantize(256)
    film: Iterator[Any] = (Image.fromarray(frame(k)).quantize(palette=palette, dither=Image.Dither.NONE)
                           for k in range(job["frames"]))
    next(film).save(job["path"], "GIF", save_all=True, append_images=film, loop=0,
                    duration=round(1000 / job["fps"]))


def _write_mp4(job: dict[str, Any], frame: Callable[[int], Any]) -> None:
    import av  # pylint: disable=import-outside-toplevel

    with av.open(job["path"], "w", format="mp4", options={"movflags": "+faststart"}) as file:
        film = file.add_stream("libx264", rate=fractions.Fraction(job["fps"]).limit_denominator(1000))
        film.width, film.height = job["width"] // 2 * 2, job["height"] // 2 * 2
        film.pix_fmt = "yuv420p"  # which all players know; it needs even sizes
        for k in range(job["frames"]):
            pixels = np.ascontiguousarray(frame(k)[:film.height, :film.width])
            file.mux(film.encode(av.VideoFrame.from_ndarray(pixels, "rgb24")))
        file.mux(film.encode())


_WRITERS = {"png": _write_png, "folder": _write_folder, "gif": _write_gif, "mp4": _write_mp4}


def show(job: dict[str, Any]) -> None:
    """Shows the episodes in a window until it is closed."""
    episodes = Episodes(job, 1.5)
    viewer = Viewer(episodes.scene)
    with contextlib.closing(viewer):
        _run(job, episodes, viewer)


def _run(job: dict[str, Any], episodes: Episodes, viewer: Viewer) -> None:
    speed, paused, end = job["speed"], False, job["end"]
    last = time.monotonic()
    while viewer.is_open() and (end is None or episodes.steps < end):
        now = time.monotonic()
        steps = episodes.steps
        if not paused:
            steps += min(now - last, 0.1) * speed / PERIOD
        last = now
        while not viewer.keys.empty():
            key = viewer.keys.get()
            if key == SPACE:
                paused = not paused
            elif key in (MINUS, EQUAL):
                speed = float(np.clip(speed * (0.5 if key == MINUS else 2), 1 / 64, 8))
            elif key == BACKSPACE:
                steps = 0
            elif key == RIGHT:
                paused, steps = True, np.floor(steps) + 1
        episodes.go(steps, viewer.pulls())
        episodes.label()
        viewer.say([f"speed {speed:g}"] * (speed != 1) + ["paused"] * paused)
        viewer.draw()
        viewer.wait(1 / 60)


def main() -> None:
    job = json.loads(sys.argv[1])
    warnings.simplefilter("ignore")  # of GLFW, before an error that says the same
    try:
        record(job) if "path" in job else show(job)  # pylint: disable=expression-not-assigned
    except ImportError as error:
        sys.exit(f"upswing: view: {error}: expected the Python packages {PACKAGES}")
    except (CannotDraw, OSError) as error:
        sys.exit(f"upswing: view: {error}")


if __name__ == "__main__":
    main()
