#!/usr/bin/env python3
"""Checks that folders are layers: includes point only to lower layers, and there is no cycle.

    tools/check_layers.py [ROOT]

Prints a line FILE:LINE: PROBLEM for each wrong include. Exit code 1 if there is one.
"""

import re
import sys
from pathlib import Path

# Layers that must not need an operating system.
PORTABLE = {"core", "nn", "sim", "rl", "control", "setup"}
BELOW_RUN = PORTABLE | {"io", "mujoco"}
LIBRARIES = BELOW_RUN | {"report", "machine", "realaigym", "loop", "run", "study", "judge", "export", "view"}

# Folders that each folder may include, besides itself.
LAYERS = {
    "core": set(),
    "nn": {"core"},
    "sim": {"core"},
    "rl": {"nn", "core"},
    "control": {"sim", "core"},
    "io": {"core"},
    "mujoco": {"sim", "io", "core"},
    "report": {"io", "core"},
    "setup": PORTABLE - {"setup"},
    "run": BELOW_RUN,
    "machine": BELOW_RUN | {"run", "report"},
    "realaigym": BELOW_RUN | {"run", "report", "machine"},
    "loop": BELOW_RUN | {"run", "report", "machine", "realaigym"},
    "study": BELOW_RUN | {"run"},
    "judge": BELOW_RUN | {"run", "study", "report"},
    "export": BELOW_RUN | {"run", "report"},
    "view": BELOW_RUN | {"run", "judge"},
    "apps": LIBRARIES,
    "bench": LIBRARIES | {"apps"},
    "python": LIBRARIES,
    "web": LIBRARIES,
    "fuzz": LIBRARIES,
    "examples": LIBRARIES,
}

# Files that may include each foreign library.
ALLOWED_FILES = {
    "mujoco": re.compile(r"mujoco/"),
    "GLFW": re.compile(r"mujoco/glfw-inl\.h$"),
    "zlib.h": re.compile(r"io/(png|gzip)\.cc$"),
    "google": re.compile(r"io/"),
    "nanobind": re.compile(r"python/"),
    "hwy": re.compile(r"(core/simd(_test)?|nn/(linear|product|registers-inl)|bench/roofline|"
                      r"sim/(closed_form|sine_cosine-inl)|realaigym/swing_net)\.(h|cc)$"),
    "Eigen": re.compile(r"(control|machine|realaigym)/|nn/[^/]*_test\.cc$|bench/"),
}

# Tests and benchmarks of the portable layers may include headers of the operating system.
MAY_ASK_SYSTEM = re.compile(r"(_test|_bench)\.cc$|/testing\.h$")
SYSTEM = re.compile(r"(unistd|fcntl|poll|sched|signal|csignal|filesystem|fstream|cstdio|stdio)(\.h)?$|"
                    r"sys/")

SOURCE_ENDINGS = (".h", ".cc", ".cc.in")
INCLUDE = re.compile(r'\s*#\s*include\s*(["<])([^">]+)[">]')


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
    folder = file.split("/")[0]
    target = included.split("/")[0]
    foreign = quote == "<" and not (root / included).is_file()
    if foreign and target in ALLOWED_FILES:
        files = ALLOWED_FILES[target]
        return None if files.match(file) else f"{included} is not for this file ({files.pattern})"
    if foreign and folder in PORTABLE and SYSTEM.match(included) and not MAY_ASK_SYSTEM.search(file):
        return f"<{included}>: {folder}/ must not need an operating system"
    if foreign:
        return None  # the standard library, another library or a generated header
    if target not in LAYERS:
        return f'"{included}": expected "folder/file.h" with one of our folders'
    if not (root / included).is_file():
        return f'"{included}" does not exist'
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
        folder, target = file.split("/")[0], included.split("/")[0]
        if target in LAYERS and target != folder:
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
