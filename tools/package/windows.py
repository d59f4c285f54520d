"""The parts of packages that only the archive for Windows has."""

import datetime
import re
import subprocess
import zipfile
from pathlib import Path

# Libraries that a program may need: Windows' own, and MuJoCo's, which is in the archive.
LIBRARIES = re.compile(r"(mujoco|msvcrt|kernel32|user32|advapi32|shell32|api-ms-win-core-synch-[\w-]+)\.dll",
                       re.IGNORECASE)
SAFE = ("DYNAMIC_BASE", "NX_COMPAT", "HIGH_ENTROPY_VA")  # random addresses, no code in data


def faults(programs, objdump):
    """Faults of programs that may not go into the archive, in words."""
    for program in programs:
        listed = subprocess.run([objdump, "-p", program], check=True, encoding="utf-8",
                                stdout=subprocess.PIPE).stdout
        for name in re.findall(r"DLL Name: (\S+)", listed):
            if not LIBRARIES.fullmatch(name):
                yield f"{program.name} needs {name}"
        for mark in SAFE:
            if mark not in listed:
                yield f"{program.name} lacks {mark}"


def write_zip(tree, path, epoch):
    """Writes a folder as a zip archive: the same files give the same bits."""
    time = datetime.datetime.fromtimestamp(epoch, datetime.timezone.utc).timetuple()[:6]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for member in sorted(tree.rglob("*")):
            if member.is_file():
                entry = zipfile.ZipInfo(str(Path(tree.name) / member.relative_to(tree)), time)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, member.read_bytes())
