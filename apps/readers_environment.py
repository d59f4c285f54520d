"""The virtual environment with independent readers of our files, in build/readers-venv. It is made when
it is missing or when tools/readers-requirements.txt has changed.
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
    """Continues the test `script` in the Python of the environment if it is the program that runs."""
    is_program = Path(sys.argv[0]).resolve() == Path(script).resolve()
    if not is_program or inside():
        return
    make()
    os.execv(VENV / "bin/python", [str(VENV / "bin/python"), "-B", *sys.argv])


def inside():
    return VENV.exists() and os.path.samefile(sys.prefix, VENV)


def wanted():
    """What the environment has to be made of."""
    return f"{sys.version}\n{sys.base_exec_prefix}\n{REQUIREMENTS.read_text(encoding='utf-8')}"


def make():
    """Makes the environment unless it is there; its mark is written last."""
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
    """Runs a command to its end; if it fails, so does the test."""
    done = subprocess.run(arguments, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          encoding="utf-8")
    if done.returncode != 0:
        sys.exit(f"{Path(sys.argv[0]).name}: {problem}:\n{done.stdout}")
