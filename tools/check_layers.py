#!/usr/bin/env python3
"""Checks that folders are layers: includes point only to lower layers, and there is no cycle. Rooms
of a folder are floors: a file includes its own room and lower floors. The product, src/, includes
nothing of extras/.

    tools/check_layers.py [ROOT]

Prints a line FILE:LINE: PROBLEM for each wrong include. Exit code 1 if there is one.
"""

import re
import sys
from pathlib import Path

# Layers that must not need an operating system.
PORTABLE = {"src/base", "src/nn", "src/pendulum", "src/rl", "src/control", "src/agents"}
BELOW_RUNS = PORTABLE | {"src/os", "src/mujoco", "src/report"}
PRODUCT = BELOW_RUNS | {"src/runs", "src/judge"}
EXTRAS = {"extras/machine", "extras/realaigym", "extras/deploy"}

# Folders that each folder may include, besides itself. The commands of extras match COMMAND and
# count as a folder of their own.
LAYERS = {
    "src/base": set(),
    "src/nn": {"src/base"},
    "src/pendulum": {"src/base"},
    "src/rl": {"src/nn", "src/base"},
    "src/control": {"src/pendulum", "src/base"},
    "src/os": {"src/base"},
    "src/mujoco": {"src/pendulum", "src/os", "src/base"},
    "src/report": {"src/os", "src/base"},
    "src/agents": PORTABLE - {"src/agents"},
    "src/runs": BELOW_RUNS,
    "src/judge": BELOW_RUNS | {"src/runs"},
    "src/cli": PRODUCT,
    "extras/machine": PRODUCT,
    "extras/realaigym": PRODUCT | {"extras/machine"},
    "extras/deploy": PRODUCT,
    "commands": PRODUCT | EXTRAS | {"src/cli"},
    "tools/fuzz": PRODUCT | EXTRAS,
    "python": PRODUCT | EXTRAS,
    "web": PRODUCT | EXTRAS,
    "examples": PRODUCT | EXTRAS,
}
COMMAND = re.compile(r"extras/\w+/(commands/)?(\w+_command|main)\.cc$")

# Rooms of a folder by floor, from the ground up; "": files of the folder itself. A file may include
# its own room and lower floors, a test any room.
ROOMS = {
    "src/rl": [{"replay"}, {""}, {"dqn", "sac", "ppo"}, {"train"}],
    "extras/machine": [{"logs"}, {"twin"}, {"drive"}],
}

# Files that may include each foreign library.
ALLOWED_FILES = {
    "mujoco": re.compile(r"src/mujoco/"),
    "zlib.h": re.compile(r"src/os/gzip(_test)?\.cc$"),
    "google": re.compile(r"(src/runs|extras/deploy)/"),
    "nanobind": re.compile(r"python/"),
    "muParser.h": re.compile(r"src/pendulum/own_reward\.cc$"),
    "hwy": re.compile(r"src/(base/simd(_test)?|nn/(linear|product|registers-inl)|"
                      r"pendulum/(closed_form|sine_cosine(-inl|_test)))\.(h|cc)$"),
    "Eigen": re.compile(r"src/(control/|nn/[^/]*_test\.cc$)|extras/(machine|realaigym)/"),
}

# Tests of the portable layers may include headers of the operating system.
MAY_ASK_SYSTEM = re.compile(r"_test\.cc$|/testing\.h$")
SYSTEM = re.compile(r"(unistd|fcntl|poll|sched|signal|csignal|filesystem|fstream|cstdio|stdio)(\.h)?$|"
                    r"sys/")

SOURCE_ENDINGS = (".h", ".inc", ".cc", ".cc.in")
INCLUDE = re.compile(r'\s*#\s*include\s*(["<])([^">]+)[">]')


def layer_of(path):
    """The layer of a file, by its path relative to root; None for another file."""
    if COMMAND.match(path):
        return "commands"
    parts = path.split("/")
    return next((name for name in ("/".join(parts[:2]), parts[0]) if name in LAYERS), None)


def room_of(path, folder):
    """The room of a file of a folder, and its floor; None for a room that ROOMS lacks."""
    inner = path.removeprefix(f"{folder}/")
    room = inner.split("/")[0] if "/" in inner else ""
    floors = (floor for floor, rooms in enumerate(ROOMS[folder]) if room in rooms)
    return room, next(floors, None)


def upward(file, path, folder):
    """The problem of an include between the rooms of a folder, or None."""
    (room, floor), (other, below) = room_of(file, folder), room_of(path, folder)
    if floor is None:
        return f"{folder}/{room}/ is no room of {folder}/"
    if room == other or (below is not None and below < floor):
        return None
    return f'{"/".join(filter(None, (folder, room)))} may not include the room {other or folder}: {path}'


def place_of(root, included):
    """The path of an included file relative to root. The folders of src/ are included from there."""
    return f"src/{included}" if (root / "src" / included.split("/")[0]).is_dir() else included


def includes(root):
    """Yields (file, line, quote, included path) of all sources; file is relative to root."""
    for folder in LAYERS:
        # The page's C++ is in one folder, apart from the thousands of files of its packages.
        place = root / folder / "wasm" if folder == "web" else root / folder
        for path in sorted(place.rglob("*")):
            if not path.name.endswith(SOURCE_ENDINGS):
                continue
            for line, text in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                if match := INCLUDE.match(text):
                    yield path.relative_to(root).as_posix(), line, *match.groups()


def offence(root, file, quote, included):
    """The problem of one include, or None."""
    folder = layer_of(file)
    path = place_of(root, included)
    target = layer_of(path)
    library = included.split("/")[0]
    foreign = quote == "<" and not (root / path).is_file()
    if foreign and library in ALLOWED_FILES:
        files = ALLOWED_FILES[library]
        return None if files.match(file) else f"{included} is not for this file ({files.pattern})"
    if foreign and folder in PORTABLE and SYSTEM.match(included) and not MAY_ASK_SYSTEM.search(file):
        return f"<{included}>: {folder}/ must not need an operating system"
    if foreign:
        return None  # the standard library, another library or a generated header
    if folder == "examples" and "/" not in included:
        return None  # in its own folder, which can be copied
    if target is None or included.startswith("src/"):
        return f'"{included}": expected "folder/file.h" with one of our folders'
    if not (root / path).is_file():
        return f'"{included}" does not exist'
    if target == folder and folder in ROOMS and not file.endswith("_test.cc"):
        return upward(file, path, folder)
    if target != folder and target not in LAYERS[folder]:
        allowed = ", ".join(sorted(LAYERS[folder])) or "no other folder"
        return f'{folder}/ may not include "{included}" (allowed: {allowed})'
    return None


def cycles(edges):
    """The cycles between folders, each as a list that begins with its alphabetically first
    folder."""
    found = []

    def walk(path):
        for target in sorted(edges.get(path[-1], ())):
            if target == path[0]:
                found.append(path)
            elif target > path[0] and target not in path:
                walk(path + [target])

    for folder in sorted(edges):
        walk([folder])
    return found


def check(root):
    """All problems, as lines of text."""
    problems = []
    edges = {}  # folder -> {included folder: place of the first include}
    for file, line, quote, included in includes(root):
        if problem := offence(root, file, quote, included):
            problems.append(f"{file}:{line}: {problem}")
        folder, target = layer_of(file), layer_of(place_of(root, included))
        if target is not None and target != folder:
            edges.setdefault(folder, {}).setdefault(target, f"{file}:{line}")
    for cycle in cycles(edges):
        steps = list(zip(cycle, cycle[1:] + cycle[:1]))
        where = ", ".join(edges[a][b] for a, b in steps[1:])
        problems.append(f"{edges[steps[0][0]][steps[0][1]]}: a cycle between folders: "
                        f"{' -> '.join(cycle + cycle[:1])} (and {where})")
    return problems


def main():
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent
    if not any((root / folder).is_dir() for folder in LAYERS):
        sys.exit(f"check_layers: expected one of the folders {', '.join(LAYERS)} in {root}")
    problems = check(root)
    for problem in problems:
        print(problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
