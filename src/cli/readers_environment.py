"""The virtual environment in build/readers-venv with independent readers of our files. It is
created if it is missing or tools/readers-requirements.txt has changed.
"""

import fcntl
import os
import shutil
import subprocess
import sys
from pathlib import Path

from testing import ROOT

VENV = ROOT / "build/readers-venv"
REQUIREMENTS = ROOT / "tools/readers-requirements.txt"


def enter(script):
    """Restarts the test `script` in the environment's Python if it is the running program."""
    is_program = Path(sys.argv[0]).resolve() == Path(script).resolve()
    if not is_program or inside():
        return
    make()
    os.execv(VENV / "bin/python", [str(VENV / "bin/python"), "-B", *sys.argv])


def inside():
    return VENV.exists() and os.path.samefile(sys.prefix, VENV)


def wanted():
    """The inputs of the environment, as text; a change requires a new one."""
    return f"{sys.version}\n{sys.base_exec_prefix}\n{REQUIREMENTS.read_text(encoding='utf-8')}"


def make():
    """Creates the environment if it is missing; writes its mark last."""
    mark = VENV / "made-of.txt"
    VENV.parent.mkdir(exist_ok=True)
    with open(f"{VENV}.lock", "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if mark.exists() and mark.read_text(encoding="utf-8") == wanted():
            return
        shutil.rmtree(VENV, ignore_errors=True)
        command("cannot make a virtual environment (is python3-venv installed?)",
                sys.executable, "-m", "venv", VENV)
        command("cannot install the readers (is there a network?)", VENV / "bin/python", "-m",
                "pip", "--disable-pip-version-check", "install", "--quiet", "--only-binary=:all:",
                "--requirement", REQUIREMENTS)
        mark.write_text(wanted(), encoding="utf-8")


def command(problem, *arguments):
    """Runs a command to its end; a failure fails the test."""
    done = subprocess.run(arguments, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          encoding="utf-8")
    if done.returncode != 0:
        sys.exit(f"{Path(sys.argv[0]).name}: {problem}:\n{done.stdout}")
