"""How programs, modules and libraries are linked, as readelf tells it: where the loader looks for their
libraries, and whether attackers could overwrite addresses of functions."""

import re
import subprocess

ORIGIN = re.compile(r"\$(ORIGIN|\{ORIGIN\})(/.*)?", re.DOTALL)


def is_elf(path):
    """Whether a file is a program, a module or a shared library, and no link."""
    if path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(17)
    return head[:4] == b"\x7fELF" and head[16] in (2, 3)  # EXEC, DYN; in both byte orders


def faults_of_run_path(run_path, packaged):
    """Faults of a run path. Anyone may put a library into the current folder, where the loader
    looks for an empty or a relative entry, and into a place of this machine that others lack."""
    faults = []
    for entry in run_path.split(":"):
        if ORIGIN.fullmatch(entry):
            continue
        if not entry:
            faults.append("an empty entry, which is the current folder")
        elif not entry.startswith("/"):
            faults.append(f"the relative entry {entry}")
        elif packaged:
            faults.append(f"the entry {entry} of the build machine")
    return faults


def faults_of(path, packaged, ours=True, readelf="readelf"):
    """Faults of a file, in lines. `packaged`: whether it is installed or packaged, not in a build
    folder. `ours`: whether this project has linked it."""
    text = subprocess.run([readelf, "--wide", "--dynamic", "--program-headers", path], check=True,
                          encoding="utf-8", stdout=subprocess.PIPE).stdout
    faults = []
    for kind, run_path in re.findall(r"\((RPATH|RUNPATH)\) .*?\[(.*)\]$", text, re.MULTILINE):
        faults += [f"{kind} has {fault}" for fault in faults_of_run_path(run_path, packaged)]
    if ours:
        if not re.search(r"\(FLAGS(_1)?\) .*\b(BIND_)?NOW\b", text):
            faults.append("no BIND_NOW: addresses of functions stay writable")
        if "GNU_RELRO" not in text:
            faults.append("no GNU_RELRO: addresses of functions are writable")
        if not re.search(r"GNU_STACK .* RW ", text):
            faults.append("an executable stack")
    return [f"{path}: {fault}" for fault in faults]


def faults_below(folder, own, readelf="readelf"):
    """Faults of the files below a folder that is installed or packaged. `own`: its folders whose
    files this project has linked."""
    return [fault for path in sorted(folder.rglob("*")) if is_elf(path)
            for fault in faults_of(path, True, path.parent.relative_to(folder).as_posix() in own, readelf)]
