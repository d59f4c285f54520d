#!/usr/bin/env python3
"""Checks that folders are layers: includes point only to lower layers, and there is no cycle. Rooms
of a folder are floors: a file includes its own room and lower floors. The product, src/, includes
nothing of extras/. Modules of Python and TypeScript import each other without a cycle.

    tools/check_layers.py [ROOT]

Prints a line FILE:LINE: PROBLEM for each wrong include or import. Exit code 1 if there is one.
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

# Folders of modules, with the ending of their files.
MODULES = {"python/upswing": ".py", "web/src": ".ts"}
IMPORT = {
    ".py": re.compile(r"^[ \t]*from \.(?P<module>\w*) import (?P<names>\([^)]*\)|[\w, ]*)", re.M),
    ".ts": re.compile(r"""^[^/\n]*(?:\bfrom|\bimport\b\s*\(?)\s*'(?P<module>\.[^']+)'""", re.M),
}

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
    """The cycles between folders or modules, each as a list that begins with its alphabetically
    first one."""
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


def imports(path):
    """Yields (line, imported path) of a module's imports of other modules."""
    text = path.read_text(encoding="utf-8")
    for match in IMPORT[path.suffix].finditer(text):
        line = 1 + text.count("\n", 0, match.start("module"))
        if path.suffix == ".py":  # from .module import ..., from . import module, module
            names = [match["module"]] if match["module"] else re.findall(r"\w+", match["names"])
        else:
            names = [match["module"]]
        for name in names:
            target = (path.parent / f"{name}{path.suffix}").resolve()
            if target.is_file():
                yield line, target


def in_cycles(edges):
    """The edges on a cycle and those between two cycles. Modules that import none of the others, or
    that none of the others imports, are removed until none is left."""
    while True:
        imported = {target for targets in edges.values() for target in targets}
        left = {module: {target: place for target, place in targets.items() if edges.get(target)}
                for module, targets in edges.items() if module in imported}
        left = {module: targets for module, targets in left.items() if targets}
        if left == edges:
            return edges
        edges = left


def module_cycles(root):
    """Yields a line of text for each cycle between modules."""
    for folder, ending in MODULES.items():
        edges = {}  # module -> {imported module: place of the first import}
        for path in sorted((root / folder).rglob(f"*{ending}")):
            file = path.relative_to(root).as_posix()
            for line, target in imports(path):
                edges.setdefault(file, {}).setdefault(
                    target.relative_to(root.resolve()).as_posix(), f"{file}:{line}")
        edges = in_cycles(edges)
        yield from (cycle_text(edges, cycle, "modules") for cycle in cycles(edges))


def cycle_text(edges, cycle, what):
    """The problem of a cycle between folders or modules."""
    steps = list(zip(cycle, cycle[1:] + cycle[:1]))
    first, *others = (edges[a][b] for a, b in steps)
    return (f"{first}: a cycle between {what}: {' -> '.join(cycle + cycle[:1])} "
            f"(and {', '.join(others)})")


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
    problems += (cycle_text(edges, cycle, "folders") for cycle in cycles(edges))
    problems += module_cycles(root)
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
