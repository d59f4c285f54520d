"""Loads MuJoCo's library from the package mujoco-core."""

import ctypes
import importlib.util
from pathlib import Path

LIBRARY = "libmujoco.so.4.0.0"


def load() -> None:
    """Loads the library of the package. Without it, the extension module uses the library of its
    build."""
    # Finds the package without importing it.
    spec = importlib.util.find_spec("mujoco")
    for folder in (spec and spec.submodule_search_locations) or ():
        if (Path(folder) / LIBRARY).exists():
            ctypes.CDLL(str(Path(folder) / LIBRARY))
            return


def stop_clock() -> None:
    """Removes the clock that `import mujoco` gives to the library. It halves the speed of every
    environment of this process, and set_mjcb_time(None) does not remove it."""
    ctypes.c_void_p.in_dll(ctypes.CDLL(LIBRARY), "mjcb_time").value = None


load()
