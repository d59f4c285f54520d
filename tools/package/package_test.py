#!/usr/bin/env python3
"""Tests of the packages: the same bits twice, and a program that runs from a read-only folder with
spaces, without HOME. Wheels take minutes to compile; the workflow that makes releases tests them.

UPSWING names the program, whose packages are made (see src/cli/testing.py). Needs the virtual
environment build/package/venv, which ./upswing package and ./upswing test make.
"""

import gzip
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest
import zipfile
from pathlib import Path

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parent.parent.parent))
sys.path.insert(0, str(ROOT / "src/cli"))
import elf  # noqa: E402  pylint: disable=wrong-import-position
import windows  # noqa: E402  pylint: disable=wrong-import-position
from testing import UPSWING, read_tensors, small  # noqa: E402  pylint: disable=wrong-import-position

FOLDER = Path(__file__).resolve().parent
PYTHON = ROOT / "build/package/venv/bin/python"
READY = PYTHON.exists() and UPSWING.parent.parent.name == "release"


def call(*command, **more):
    return subprocess.run([str(word) for word in command], check=False, encoding="utf-8",
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          **more)


@unittest.skipUnless(READY or "UPSWING_REQUIRE_PACKAGE" in os.environ,
                     "needs a release build and what ./upswing package installs")
class PackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory(prefix="upswing-")
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = Path(temporary.name)
        shutil.copytree(ROOT / "web/public", cls.folder / "page")
        shutil.copytree(ROOT / "docs/start", cls.folder / "docs")
        done = cls.package("first", "tarball", "deb")
        assert done.returncode == 0, done.stderr
        (archive,) = (cls.folder / "first").glob("*.tar.gz")
        unpacked = cls.folder / "a folder with spaces"
        unpacked.mkdir()
        done = call("tar", "-xzf", archive, "-C", unpacked)
        assert done.returncode == 0, done.stderr
        (cls.tree,) = unpacked.iterdir()

    @classmethod
    def package(cls, out, *arguments):
        return call(PYTHON, "-B", FOLDER / "package.py", *arguments, "--allow-changes",
                    "--page", cls.folder / "page", "--docs", cls.folder / "docs",
                    "--out", cls.folder / out, "--work", cls.folder / "work",
                    # xz, which a package has otherwise, takes most of the time.
                    env=os.environ | {"DPKG_DEB_COMPRESSOR_TYPE": "gzip",
                                      "DPKG_DEB_COMPRESSOR_LEVEL": "1"})

    def test_same_commit_gives_same_bits(self):
        os.utime(self.folder / "page/icon.svg", (1, 1))
        (self.folder / "page/icon.svg").chmod(0o600)
        done = self.package("second", "tarball", "deb")
        self.assertEqual(done.returncode, 0, done.stderr)
        first, second = self.folder / "first", self.folder / "second"
        names = sorted(path.name for path in first.iterdir())
        self.assertEqual({Path(name).suffix for name in names}, {"", ".gz", ".deb"})
        self.assertEqual(names, sorted(path.name for path in second.iterdir()))
        for name in names:
            self.assertTrue((first / name).read_bytes() == (second / name).read_bytes(), name)
        self.assertEqual(call("sha256sum", "--check", "SHA256SUMS", cwd=first).returncode, 0)

    def test_trains_from_a_read_only_folder_without_home(self):
        def policy(program, out):
            done = call(program, *small(agent="d3qn-small", out=out), env={})
            self.assertEqual(done.returncode, 0, done.stderr)
            return read_tensors(out / "policy.safetensors")[1]

        for path in [self.tree, *self.tree.rglob("*")]:
            if not path.is_symlink():
                path.chmod(path.stat().st_mode & ~0o222)
        self.assertEqual(policy(self.tree / "bin/upswing", self.folder / "packaged"),
                         policy(UPSWING, self.folder / "built"))

    def test_help_is_that_of_an_installed_program(self):
        for words in ([], ["train"], ["demo"], ["run"]):
            text = call(self.tree / "bin/upswing", *words, "--help").stdout
            self.assertIn(f"\n  upswing {(words or ['train'])[0]}", text)
            self.assertNotIn("./upswing", text)
        commands = call(self.tree / "bin/upswing", "--help").stdout
        self.assertRegex(commands, r"\n  demo +")
        self.assertNotRegex(commands, r"\n  (docs|package|python|test) +")
        (deb,) = (self.folder / "first").glob("*.deb")
        call("dpkg-deb", "-x", deb, self.folder / "deb")
        manual = gzip.decompress((self.folder / "deb/usr/share/man/man1/upswing.1.gz").read_bytes())
        self.assertIn(b"upswing train", manual)
        self.assertNotIn(b"./upswing", manual)

    def test_has_all_libraries_and_their_notices(self):
        for program in (self.tree / "bin").iterdir():
            self.assertNotIn("not found", call("ldd", program).stdout)
        listed = tomllib.loads((FOLDER / "components.toml").read_text("utf-8"))["component"]
        components = [component for component in listed if component.get("system") != "windows"]
        parts = " ".join(component["part"] for component in components)
        libraries = list((self.tree / "lib/upswing").glob("*.so*"))
        self.assertGreater(len(libraries), 3)
        for library in libraries:
            self.assertIn(f"lib/upswing/{library.name.split('.so')[0]}.so", parts)
        documents = self.tree / "share/doc/upswing"
        notice = (documents / "NOTICE").read_text("utf-8")
        bom = json.loads((documents / "sbom.cdx.json").read_text("utf-8"))
        self.assertEqual(len(bom["components"]), len(components))
        for entry in bom["components"]:
            self.assertTrue(entry["licenses"])
            self.assertIn(entry["name"] + (f" {entry['version']}" if "version" in entry else ""), notice)

    def test_is_linked_safely(self):
        (deb,) = (self.folder / "first").glob("*.deb")
        call("dpkg-deb", "-x", deb, self.folder / "linked")
        for tree, own in ((self.tree, "bin"), (self.folder / "linked", "usr/bin")):
            self.assertTrue(elf.is_elf(tree / own / "upswing"))
            self.assertEqual(elf.faults_below(tree, {own}), [])

    def test_has_shipped_policies(self):
        done = call(self.tree / "bin/upswing", "info", "sac", cwd="/")
        self.assertEqual((done.returncode, done.stdout[:4]), (0, "sac\n"), done.stderr)

    def test_command_of_a_wheel(self):
        site = self.folder / "site"
        (site / "upswing").mkdir(parents=True)
        (site / "upswing/bin").symlink_to(self.tree / "bin")
        (site / "mujoco").symlink_to(self.tree / "lib/upswing/mujoco/lib")
        command = shutil.copy(ROOT / "python/upswing_command.py", self.folder / "command")
        done = call(sys.executable, command, "info", env={"PYTHONPATH": str(site)})
        self.assertIn("MuJoCo 4.0.0", done.stdout, done.stderr)

    @unittest.skipUnless(shutil.which("lintian"), "needs lintian")
    def test_lintian_is_content(self):
        (deb,) = (self.folder / "first").glob("*.deb")
        found = [line for line in call("lintian", "--allow-root", deb).stdout.splitlines()
                 if re.match(r"[EW]: ", line)]
        self.assertEqual(found, [])

    def test_refuses_uncommitted_changes(self):
        clone = self.folder / "clone"
        self.assertEqual(call("git", "clone", "-q", "--shared", ROOT, clone).returncode, 0)
        shutil.copytree(FOLDER, clone / "tools/package", dirs_exist_ok=True)
        (clone / "new.txt").touch()
        done = call(PYTHON, "-B", clone / "tools/package/package.py", "--out", self.folder / "none")
        self.assertEqual(done.returncode, 2)
        self.assertRegex(done.stderr, r"^upswing: package: expected a clean checkout, got changes in \d+ "
                                      r"files, such as .*\n$")
        self.assertFalse((self.folder / "none").exists())


class PythonsTest(unittest.TestCase):
    def check(self, *kinds):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "git").symlink_to(shutil.which("git"))
            return call(sys.executable, "-B", FOLDER / "package.py", *kinds, "--check",
                        "--allow-changes", env={"PATH": folder})

    def test_missing_pythons_are_told_before_the_build(self):
        done = self.check()
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (0, 2), done.stderr)
        self.assertIn("no wheel for Python 3.12 or newer: expected it with its headers", done.stderr)
        self.assertEqual(self.check("tarball").stderr, "")
        self.assertEqual(self.check("wheels").returncode, 2)


class VersionTest(unittest.TestCase):
    def test_files_agree_with_cmake(self):
        def found(pattern, name):
            return re.search(pattern, (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)[1]

        version = found(r"project\(upswing VERSION ([\d.]+)", "CMakeLists.txt")
        self.assertEqual(found(r"^version: (.*)$", "CITATION.cff"), version)
        self.assertEqual(found(r"^## \[([\d.]+)\]", "CHANGELOG.md"), version)


class WindowsTest(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def faults(self, listed):
        """The faults of a program of which objdump says this."""
        objdump = self.folder / "objdump"
        objdump.write_text(f"#!/bin/sh\ncat <<'END'\n{listed}\nEND\n", encoding="utf-8")
        objdump.chmod(0o755)
        return list(windows.faults([Path("upswing.exe")], objdump))

    def test_programs_need_only_libraries_of_windows(self):
        safe = "DYNAMIC_BASE NX_COMPAT HIGH_ENTROPY_VA\n\tDLL Name: KERNEL32.dll\n\tDLL Name: mujoco.dll"
        self.assertEqual(self.faults(safe), [])
        self.assertEqual(self.faults(f"{safe}\n\tDLL Name: zlib1.dll"), ["upswing.exe needs zlib1.dll"])
        self.assertEqual(self.faults(safe.replace("NX_COMPAT ", "")), ["upswing.exe lacks NX_COMPAT"])

    def test_the_same_files_give_the_same_archive(self):
        tree = self.folder / "tree"
        tree.mkdir()
        for name in ("b", "a"):
            (tree / name).write_text(name, encoding="utf-8")
        archives = []
        for time in (0, 1_000_000_000):
            os.utime(tree / "a", (time, time))
            archives.append(self.folder / f"{time}.zip")
            windows.write_zip(tree, archives[-1], 1_700_000_000)
        self.assertEqual(*(path.read_bytes() for path in archives))
        with zipfile.ZipFile(archives[0]) as archive:
            self.assertEqual(archive.namelist(), ["tree/a", "tree/b"])


class PinsTest(unittest.TestCase):
    def test_actions_are_pinned_by_hash(self):
        for path in (ROOT / ".github/workflows").glob("*.yml"):
            for action in re.findall(r"uses: (.*)", path.read_text(encoding="utf-8")):
                self.assertRegex(action, r"^actions/[\w-]+@[0-9a-f]{40} # v[\d.]+$")


class LauncherTest(unittest.TestCase):
    def test_bad_arguments(self):
        for words, message in ((["zip"], 'expected tarball, deb, wheels or windows, got "zip"'),
                               (["windows", "deb"], "expected windows without another kind"),
                               (["windows", "--arch", "arm64"], "expected windows without another kind"),
                               (["--arch", "riscv"], 'expected x86-64 or arm64, got "riscv"'),
                               (["--out"], "--out: expected a value, got none"),
                               (["--fast"], "unknown flag --fast")):
            with self.subTest(words=words):
                done = call(ROOT / "upswing", "--no-setup", "package", *words)
                self.assertEqual((done.returncode, done.stdout), (2, ""))
                self.assertIn(message, done.stderr)
                self.assertEqual(len(done.stderr.splitlines()), 1)


if __name__ == "__main__":
    unittest.main()
