#!/usr/bin/env python3
"""Tests of `./upswing demo`: what it serves and refuses. tools/web_test runs this with the built
page in UPSWING_PAGE; nothing is installed or built."""

import base64
import gzip
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import unittest
import urllib.error
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "src/cli"))
from testing import UPSWING, ProgramTest, small, snapshot  # noqa: E402

PAGE = Path(os.environ["UPSWING_PAGE"])


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


class DemoTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.page = self.folder / "built page"
        shutil.copytree(PAGE, self.page)
        self.temporary = self.folder / "temporary"
        self.temporary.mkdir()
        self.environment = os.environ | {"UPSWING_PAGE": str(self.page),
                                         "TMPDIR": str(self.temporary)}
        self.work = self.folder / "work"
        self.work.mkdir()

    def command(self, *arguments):
        return [ROOT / "upswing", "--no-setup", "demo", *map(str, arguments)]

    def demo(self, *arguments):
        return subprocess.run(self.command(*arguments), cwd=self.work, env=self.environment,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, check=False,
                              stderr=subprocess.PIPE, encoding="utf-8")

    def serve(self, *arguments, command=None):
        """Starts the server. Returns the process and the address in its first line."""
        server = subprocess.Popen(command or self.command(*arguments), cwd=self.work, env=self.environment,
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.DEVNULL, encoding="utf-8")
        self.addCleanup(self.end, server)
        line = server.stdout.readline()
        self.assertRegex(line, r"http://localhost:\d+/\S* ")
        return server, line.split()[4]

    def open(self, address, **fields):
        # A configured proxy is bypassed.
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        request = urllib.request.Request(address.replace("localhost", "127.0.0.1"), headers=fields)
        with opener.open(request) as reply:
            return reply.headers, reply.read()

    def fetch(self, address):
        return self.open(address)[1]

    def test_serves_the_page_until_it_is_interrupted(self):
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            server, address = self.serve()
            self.assertEqual(self.fetch(address), (self.page / "index.html").read_bytes())
            self.assertEqual(self.end(server, number), (code, ""))

    def test_serves_every_file_also_compressed(self):
        _, address = self.serve()
        for path in self.page.rglob("*"):
            if not path.is_file():
                continue
            name = path.relative_to(self.page).as_posix()
            with self.subTest(file=name):
                self.assertEqual(self.fetch(address + name), path.read_bytes())
                fields, body = self.open(address + name, **{"Accept-Encoding": "gzip, br"})
                if fields["Content-Encoding"] == "gzip":
                    body = gzip.decompress(body)
                self.assertEqual(body, path.read_bytes())
                if path.suffix in {".html", ".js", ".css", ".wasm", ".json", ".svg"}:
                    self.assertEqual(fields["Content-Encoding"], "gzip")
                self.assertEqual(fields["Cache-Control"], "no-cache")

    def test_sees_a_page_that_is_built_again(self):
        _, address = self.serve()
        fields, _ = self.open(address)
        (self.page / "index.html").write_text("another page", encoding="utf-8")
        again, body = self.open(address, **{"If-None-Match": fields["ETag"]})
        self.assertEqual(body, b"another page")
        with self.assertRaises(urllib.error.HTTPError) as unchanged:
            self.open(address, **{"If-None-Match": again["ETag"]})
        unchanged.exception.close()
        self.assertEqual(unchanged.exception.code, 304)

    def test_only_this_machine_and_only_the_page(self):
        _, address = self.serve()
        for path, host, code in (("", "example.org", 403), ("%2e%2e/temporary", "localhost", 404)):
            with self.subTest(path=path, host=host):
                with self.assertRaises(urllib.error.HTTPError) as refused:
                    self.open(address + path, Host=host)
                refused.exception.close()
                self.assertEqual(refused.exception.code, code)

    def test_an_installed_program_finds_its_page(self):
        place = self.folder / "installed"
        (place / "bin").mkdir(parents=True)
        for program in ("upswing", "upswing-deploy"):
            shutil.copy2(UPSWING.with_name(program), place / "bin")
        del self.environment["UPSWING_PAGE"]
        command = [place / "bin/upswing", "demo"]
        done = subprocess.run(command, env=self.environment, stdin=subprocess.DEVNULL, check=False,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8")
        self.assert_one_line(done, 1, place / "share/upswing/page", "UPSWING_PAGE")
        (place / "share/upswing").mkdir(parents=True)
        self.page.rename(place / "share/upswing/page")
        _, address = self.serve(command=command)
        self.assertEqual(self.fetch(address), (PAGE / "index.html").read_bytes())

    def test_port(self):
        port = free_port()
        _, address = self.serve("--port", port)
        self.assertEqual(address, f"http://localhost:{port}/")
        busy = self.demo(f"--port={port}")
        self.assert_one_line(busy, 1, port, "already in use")
        self.assertEqual(busy.stdout, "")

    def test_runs_are_in_the_page(self):
        self.succeed(*small(out="work/My Run"))
        self.assertEqual(self.demo("My Run", "--dist", "site").returncode, 0)
        self.read_only(self.page)
        server, shown = self.serve("My Run", PAGE / "agents/sac.safetensors")
        address, _, playing = shown.partition("#")
        self.assertEqual(playing, "agent=my-run&on=1")
        for agents in (json.loads(self.fetch(address + "agents/agents.json")),
                       json.loads((self.work / "site/agents/agents.json").read_text())):
            (mine,) = [each for each in agents["agents"] if each["id"] == "my-run"]
        policy = (self.work / "My Run/policy.safetensors").read_bytes()
        self.assertEqual(self.fetch(address + "agents/" + mine["file"]), policy)
        self.assertEqual((self.work / "site/agents" / mine["file"]).read_bytes(), policy)
        self.assertEqual(self.fetch(address + "agents/d3qn.safetensors"),
                         (PAGE / "agents/d3qn.safetensors").read_bytes())
        # The page itself has no new file, and nothing is left.
        self.assertEqual(snapshot(self.page), snapshot(PAGE))
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            self.assertNotEqual(list(self.temporary.iterdir()), [])
            self.assertEqual(self.end(server, number), (code, ""))
            self.assertEqual(list(self.temporary.iterdir()), [])
            server, _ = self.serve("My Run")

    def read_only(self, folder):
        """Makes the page read-only for all users except root, like an installed page."""
        for path in (folder, *folder.rglob("*")):
            path.chmod(path.stat().st_mode & 0o555)
        self.addCleanup(lambda: [path.chmod(0o755) for path in (folder, *folder.rglob("*"))])

    def test_dist_is_the_page(self):
        (self.work / "empty").mkdir()
        folders = {"new": "new", "empty": "empty", "it's; new": "'it'\\''s; new'"}
        for folder, quoted in folders.items():
            done = self.demo("--dist", folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""), done)
            self.assertIn(f"http.server -d {quoted}\n", done.stdout)
            self.assertEqual(snapshot(self.work / folder), snapshot(self.page))
            self.assertEqual((self.work / folder).stat().st_mode & 0o777, 0o755)
        self.assertEqual({path.name for path in self.work.iterdir()}, set(folders))
        self.assertNotIn("\x1b", self.demo("--dist", "\x1b[2J").stdout)

    def test_one_file_holds_the_page_and_the_runs(self):
        self.succeed(*small(out="work/My Run"))
        done = self.demo("My Run", "--file", "page.html")
        self.assertEqual((done.returncode, done.stderr), (0, ""), done)
        html = (self.work / "page.html").read_text(encoding="utf-8")
        held = dict(re.findall(r'data-file="([^"]*)">([^<]*)</script>', html))
        agents = json.loads(gzip.decompress(base64.b64decode(held["agents.json"])))
        (mine,) = [each for each in agents["agents"] if each["id"] == "my-run"]
        self.assertEqual(gzip.decompress(base64.b64decode(held[mine["file"]])),
                         (self.work / "My Run/policy.safetensors").read_bytes())
        for path in self.page.rglob("*.wasm"):
            self.assertEqual(gzip.decompress(base64.b64decode(held[path.name])), path.read_bytes())
        self.assertEqual(list(self.temporary.iterdir()), [])

    def test_bad_input_is_refused_in_one_line(self):
        (self.work / "full").mkdir()
        (self.work / "full/file").touch()
        (self.work / "notes.txt").write_text("mine", encoding="utf-8")
        before = snapshot(self.work)
        for arguments, *words in ((["--prot", "1"], "--prot", "--port"),
                                  (["--port"], "--port"),
                                  (["--port", "0"], "--port", 'got "0"'),
                                  (["--port", "65536"], "--port"),
                                  (["--port=80x"], "80x"),
                                  (["--dist", "full"], "full", "empty"),
                                  (["--dist", "full/file"], "full/file"),
                                  (["--dist", "no/where"], "no"),
                                  (["--dist="], "--dist"),
                                  (["--dist", "x", "--port", "1024"], "--port: expected no --dist"),
                                  (["--file", "x.html", "--dist", "x"], "--dist: expected no --file"),
                                  (["--file", "no/where.html"], "--file", "no/where.html"),
                                  (["--file", "notes.txt"], "notes.txt: expected a new file or an older page"),
                                  (["nothing"], "nothing"),
                                  (["full"], "full"),
                                  (["lqr"], "lqr"),
                                  (["full", "--dist", "x"], "full")):
            with self.subTest(arguments=arguments):
                done = self.demo(*arguments)
                self.assert_one_line(done, 2, *words)
                self.assertEqual(done.stdout, "")
                self.assertEqual(snapshot(self.work), before)
        self.assertEqual(snapshot(self.page), snapshot(PAGE))
        self.assertEqual(list(self.temporary.iterdir()), [])

    def test_a_page_that_was_never_built(self):
        self.environment["UPSWING_PAGE"] = str(self.folder / "none")
        self.assert_one_line(self.demo(), 1, "UPSWING_PAGE", "builds the page")

    def test_a_missing_python_is_named(self):
        self.environment["UPSWING_PYTHON"] = "/none"
        self.assert_one_line(self.demo(), 1, "demo: cannot run /none", "UPSWING_PYTHON")

    def test_help(self):
        done = self.demo("--help")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        for word in ("--port", "--dist", "--file", "Examples"):
            self.assertIn(word, done.stdout)


if __name__ == "__main__":
    unittest.main()
