"""The program's own description: its commands, flags, settings and named agents.

Tools and tests that need one of these use this module. The environment variable UPSWING names the
program; without it, the release build is used.
"""

import dataclasses
import functools
import os
import re
import subprocess
from pathlib import Path

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parent.parent))
UPSWING = Path(os.environ.get("UPSWING", ROOT / "build/release/bin/upswing"))

# Commands of the launcher; the program only knows their names.
LAUNCHER_COMMANDS = {"docs", "package", "python", "test"}
# The named agent with the defaults of each algorithm.
ALGORITHMS = {"dqn": "d3qn", "sac": "sac", "ppo": "ppo"}


@functools.cache
def output_of(*command):
    """The standard output of a command, which must succeed."""
    return subprocess.run(command, check=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          encoding="utf-8").stdout


def program(*arguments):
    return output_of(UPSWING, *arguments)


def _table(text, heading):
    """{name: description} of the indented table below a heading, which ends at an empty line."""
    body = re.search(rf"^{heading}:\n((?: +\S.*\n)+)", text, re.MULTILINE)[1]
    entries = {}
    for line in body.splitlines():
        if entry := re.match(r"  (\S+)\s+(\S.*)", line):
            name = entry[1]
            entries[name] = entry[2]
        else:
            entries[name] += " " + line.strip()
    return entries


def commands():
    """{command: description}, in the order of --help."""
    return _table(program("--help"), "(?:Subcommands|Commands)")


def help_of(command, *arguments):
    """The help text of a command."""
    if command in LAUNCHER_COMMANDS:
        return output_of(ROOT / "upswing", "--no-setup", command, "--help")
    return program(command, *arguments, "--help")


@functools.cache
def flags(command):
    """All flags of a command, for all algorithms."""
    texts = [help_of(command)]
    if command == "train":
        texts += [help_of("train", "--agent", agent) for agent in ALGORITHMS.values()]
    if "\nSubcommands" in texts[0]:
        texts += [help_of(command, own) for own in _table(texts[0], "Subcommands")]
    return {flag for text in texts for flag in re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", text)}


@dataclasses.dataclass(frozen=True)
class Setting:
    """One line of `train --print-config`: `name = default  # meaning [unit] (values)`."""

    section: str
    name: str
    default: str
    meaning: str
    unit: str
    values: str


@functools.cache
def settings(agent):
    """The settings of a named agent, by name."""
    found = {}
    section = ""
    for line in program("train", "--agent", agent, "--print-config").splitlines():
        if heading := re.fullmatch(r"\[(\w+)\]", line):
            section = heading[1]
        elif entry := re.fullmatch(r"(\w+) = (.*?)  # (.*)", line):
            name, default, meaning = entry.groups()
            meaning, values = _cut(meaning, r" \(([^()]*)\)") if default not in (
                "true", "false") else (meaning, "")
            meaning, unit = _cut(meaning, r" \[([^\[\]]*)\]")
            found[name] = Setting(section, name, default, meaning, unit, values)
    return found


def _cut(text, pattern):
    """The text without its matching end, and the group of the match."""
    end = re.search(pattern + "$", text)
    return (text[:end.start()], end[1]) if end else (text, "")
