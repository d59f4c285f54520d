#!python
"""The command `upswing` of a wheel: runs the program inside the package, with MuJoCo's library from its
own wheel. Imports neither package, so that it starts at once."""

import importlib.util
import os
import sys
from pathlib import Path


def folder(package):
    return Path(importlib.util.find_spec(package).submodule_search_locations[0])


program = folder("upswing") / "bin/upswing"
libraries = [str(folder("mujoco")), *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
os.execve(program, [str(program), *sys.argv[1:]],
          {"UPSWING_PYTHON": sys.executable} | os.environ
          | {"LD_LIBRARY_PATH": os.pathsep.join(libraries)})
