#!/usr/bin/env python3
"""Writes the hashes of all wheels of the pinned versions into the requirement files, after a change of
versions. Adds no packages: what a list lacks is an error.

Asks the package index through uv, in the virtual environment build/uv-venv.
"""

import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "src/cli"))
import test_environment  # noqa: E402  pylint: disable=wrong-import-position

UV = test_environment.folder("uv") / "bin/uv"
PYTHONS = ("3.11.2", "3.12", "3.13", "3.14")  # the first one is Debian 12's
EVERYWHERE = [(python, machine) for python in PYTHONS for machine in ("x86_64", "aarch64")]
# The lists that pip installs from, and where. tools/fetch_wheel reads the other lists.
LISTS = {name: EVERYWHERE for name in (
    "docs-requirements.txt", "python-requirements.txt", "python-test-requirements.txt",
    "readers-requirements.txt", "uv-requirements.txt", "view-requirements.txt", "package/requirements.txt",
    "peers/requirements-rltools.txt")}
# Box2D has no other wheels.
LISTS["peers/requirements.txt"] = [(python, "x86_64") for python in ("3.11.2", "3.12", "3.13")]
PIN = re.compile(r"^([\w.-]+)(\[[\w,]+\])?==([^\s;]+)( \\\n    --hash=sha256:[0-9a-f]{64})*$", re.MULTILINE)


class CannotInstall(Exception):
    """A list cannot be installed; the message is uv's."""


def key(name, version):
    """A pin with the name as package indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower(), version


def pins(text):
    """{pin: its hashes} of a list."""
    return {key(match[1], match[3]): set(re.findall("sha256:(.*?)(?: |$)", match[0], re.MULTILINE))
            for match in PIN.finditer(text)}


def wheels(path, python, machine, cache):
    """{pin: hash of its wheel} of what a list installs, with all that it depends on."""
    done = subprocess.run(
        [UV, "pip", "compile", "--no-config", "--cache-dir", cache, "--no-build", "--no-header",
         "--format", "pylock.toml", "--python", sys.executable, "--python-version", python,
         "--python-platform", f"{machine}-manylinux_2_36", path],
        check=False, stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8")
    if done.returncode != 0:
        raise CannotInstall(f"{path.relative_to(ROOT)} for Python {python} on {machine}: {done.stderr}")
    for warning in re.findall("^warning: .*", done.stderr, re.MULTILINE):  # of withdrawn versions, for example
        print(f"{path.relative_to(ROOT)}: {warning}", file=sys.stderr)
    return {key(package["name"], package["version"]): package["wheels"][0]["hashes"]["sha256"]
            for package in tomllib.loads(done.stdout).get("packages", [])}


def main():
    test_environment.make("uv")
    with tempfile.TemporaryDirectory(prefix="upswing-") as cache:
        for name, places in LISTS.items():
            path = ROOT / "tools" / name
            text = path.read_text(encoding="utf-8")
            found = {pin: set() for pin in pins(text)}
            for python, machine in places:
                for pin, digest in wheels(path, python, machine, cache).items():
                    if pin not in found:
                        sys.exit(f"requirements.py: {path}: expected a pin of {'=='.join(pin)}, got none")
                    found[pin].add(digest)

            def with_hashes(match):
                hashes = sorted(found[key(match[1], match[3])])  # pylint: disable=cell-var-from-loop
                return " \\\n    --hash=sha256:".join([f"{match[1]}{match[2] or ''}=={match[3]}", *hashes])

            path.write_text(PIN.sub(with_hashes, text), encoding="utf-8")


if __name__ == "__main__":
    main()
