"""Virtual environments of tests: build/NAME-venv has the packages in tools/NAME-requirements.txt.
It is created if it is missing or the list has changed.
"""

import fcntl
import os
import shutil
import subprocess
import sys
from pathlib import Path

from testing import ROOT


def folder(name):
    return ROOT / f"build/{name}-venv"


def requirements(name):
    return ROOT / f"tools/{name}-requirements.txt"


def enter(script, name):
    """Restarts the test `script` in the environment's Python if it is the running program."""
    is_program = Path(sys.argv[0]).resolve() == Path(script).resolve()
    if not is_program or inside(name):
        return
    make(name)
    python = folder(name) / "bin/python"
    os.execv(python, [str(python), "-B", *sys.argv])


def inside(name):
    return folder(name).exists() and os.path.samefile(sys.prefix, folder(name))


def wanted(name):
    """The inputs of the environment, as text; a change requires a new one."""
    packages = requirements(name).read_text(encoding="utf-8")
    return f"{sys.version}\n{sys.base_exec_prefix}\n{packages}"


def make(name):
    """Creates the environment if it is missing; writes its mark last."""
    venv = folder(name)
    mark = venv / "made-of.txt"
    venv.parent.mkdir(exist_ok=True)
    with open(f"{venv}.lock", "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if mark.exists() and mark.read_text(encoding="utf-8") == wanted(name):
            return
        shutil.rmtree(venv, ignore_errors=True)
        command("cannot make a virtual environment (is python3-venv installed?)",
                sys.executable, "-m", "venv", venv)
        command(f"cannot install {requirements(name).name} (is there a network?)",
                venv / "bin/python", "-m", "pip", "--disable-pip-version-check", "install", "--quiet",
                "--only-binary=:all:", "--require-hashes", "--requirement", requirements(name))
        mark.write_text(wanted(name), encoding="utf-8")


def command(problem, *arguments):
    """Runs a command to its end; a failure fails the test. pip would leave out packages that it
    finds in PYTHONPATH."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(arguments, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          encoding="utf-8", env=environment)
    if done.returncode != 0:
        sys.exit(f"{Path(sys.argv[0]).name}: {problem}:\n{done.stdout}")
