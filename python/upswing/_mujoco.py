"""Loads MuJoCo's library from the package mujoco-core, wherever that is installed."""

import ctypes
import importlib.util
from pathlib import Path

LIBRARY = "libmujoco.so.4.0.0"


def load() -> None:
    """Loads it, if the package has it; else the extension module looks for it where it was built."""
    # Found, not imported: the package's own Python is not needed.
    spec = importlib.util.find_spec("mujoco")
    for folder in (spec and spec.submodule_search_locations) or ():
        if (Path(folder) / LIBRARY).exists():
            ctypes.CDLL(str(Path(folder) / LIBRARY))
            return


load()
