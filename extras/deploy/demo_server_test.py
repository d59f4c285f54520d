#!/usr/bin/env python3
"""Tests of the web server of `upswing demo` (demo_server.py): what it serves, refuses and endures."""

import gzip
import os
import re
import select
import socket
import subprocess
import sys
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "src/cli"))
from testing import ProgramTest  # noqa: E402

PROGRAM = (ROOT / "extras/deploy/demo_server.py").read_text(encoding="utf-8")
HOST = "\r\nHost: localhost"
LAST = " HTTP/1.1" + HOST + "\r\nConnection: close\r\n\r\n"


class Server(ProgramTest):
    def setUp(self):
        super().setUp()
        self.page = self.folder / "page"
        for name, text in {"index.html": "<!doctype html>", "folder/index.html": "inside",
                           "agents/agents.json": "{}", ".hidden/file.txt": "secret",
                           "../secret.txt": "secret", "large.js": "/" * 3_000_000,
                           "noise.safetensors": "n" * 2_000_000}.items():
            (self.page / name).parent.mkdir(parents=True, exist_ok=True)
            (self.page / name).write_text(text, encoding="utf-8")
        (self.page / "link.txt").symlink_to(self.folder / "secret.txt")
        (self.page / "up").symlink_to(self.folder)
        (self.page / "inner.html").symlink_to("folder/index.html")

    def start(self, *folders, patience=15, first=4173, last=65535):
        job = "\n".join(map(str, (patience, first, last, *(folders or (self.page,)))))
        server = subprocess.Popen([sys.executable, "-c", PROGRAM, job], cwd=self.folder, encoding="utf-8",
                                  stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(lambda: self.stop(server))
        return server

    @staticmethod
    def stop(server):
        """Ends the input of the server. Returns its exit code and errors."""
        errors = server.communicate(timeout=60)[1] if server.poll() is None or not server.stdin.closed else ""
        return server.returncode, errors

    def serve(self, *folders, **options):
        """Starts a server. Returns its port."""
        return int(self.start(*folders, **options).stdout.readline())

    def connect(self, port, address="127.0.0.1"):
        connection = socket.create_connection((address, port), timeout=60)
        self.addCleanup(connection.close)
        return connection

    @staticmethod
    def receive(connection):
        """All bytes until the server ends the connection; it must not reset it."""
        received = b""
        while piece := connection.recv(1 << 16):
            received += piece
        return received

    def exchange(self, port, request):
        connection = self.connect(port)
        connection.sendall(request if isinstance(request, bytes) else request.encode())
        return self.receive(connection)

    def get(self, port, target, *fields, method="GET"):
        """Status, header fields and body."""
        lines = "".join("\r\n" + field for field in fields)
        answer = self.exchange(port, f"{method} {target} HTTP/1.1{HOST}\r\nConnection: close{lines}\r\n\r\n")
        head, _, body = answer.partition(b"\r\n\r\n")
        return int(head.split()[1]), dict(re.findall(r"([\w-]+): ([^\r\n]*)", head.decode())), body

    def assert_status(self, port, request, status):
        answer = self.exchange(port, request)
        self.assertRegex(answer, rb"^HTTP/1\.1 %d " % status, request)
        self.assertIn(b"\r\nConnection: close\r\n", answer)

    def test_files_and_their_types(self):
        port = self.serve()
        for target, text in (("/", "<!doctype html>"), ("/folder/", "inside"), ("/inner.html", "inside"),
                             ("//folder//index.html?query", "inside"),
                             ("/up/page/index.html", "<!doctype html>")):  # back into the folder
            self.assertEqual(self.get(port, target)[2].decode(), text, target)
        for name, kind in {"a.html": "text/html; charset=utf-8", "a.js": "text/javascript; charset=utf-8",
                           "a.css": "text/css; charset=utf-8", "a.wasm": "application/wasm",
                           "a.json": "application/json", "a.svg": "image/svg+xml", "a.png": "image/png",
                           "a.woff2": "font/woff2", "a.safetensors": "application/octet-stream",
                           "a": "application/octet-stream", "ä b.txt": "text/plain; charset=utf-8"}.items():
            (self.page / name).write_text(name, encoding="utf-8")
            target = "/" + "".join(f"%{byte:02x}" for byte in name.encode())
            status, fields, body = self.get(port, target)
            self.assertEqual((status, fields["Content-Type"], body.decode()), (200, kind, name))
            self.assertEqual(fields["X-Content-Type-Options"], "nosniff")
        self.assertEqual(self.get(port, "/noise.safetensors", method="HEAD")[1:],
                         (self.get(port, "/noise.safetensors")[1], b""))

    def test_nothing_outside_the_folder_is_read(self):
        port = self.serve()
        for target in ("/../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt", "/folder/../../secret.txt",
                       "/./index.html", "/link.txt", "/up/secret.txt", "/.hidden/file.txt", "/folder",
                       "/agents/", "/index.html/", "/none", "//etc/passwd", "/%2fetc/passwd", "/..",
                       "/agents/..%2f../secret.txt", "/%ff"):
            status, _, body = self.get(port, target)
            self.assertEqual((status, body), (404, b"404 Not Found\n"), target)

    def test_another_folder_of_agents(self):
        (self.folder / "other").mkdir()
        (self.folder / "other/agents.json").write_text("other", encoding="utf-8")
        port = self.serve(self.page, self.folder / "other")
        for target in ("/agents/agents.json", "//%61gents/agents.json"):
            self.assertEqual(self.get(port, target)[2], b"other")
        self.assertEqual(self.get(port, "/folder/index.html")[2], b"inside")
        for target in ("/agents", "/agents/../index.html"):
            self.assertEqual(self.get(port, target)[0], 404)

    def test_compresses_for_browsers_that_accept_it(self):
        port = self.serve()
        _, plain, text = self.get(port, "/large.js")
        for names in ("gzip", "GZIP", "br;q=1, gzip;q=0.5", "*", "gzip;q=1.000", "x,gzip"):
            _, small, body = self.get(port, "/large.js", f"Accept-Encoding: {names}")
            self.assertEqual((small["Content-Encoding"], small["Content-Length"]), ("gzip", str(len(body))))
            self.assertEqual(gzip.decompress(body), text)
            self.assertEqual(small["Vary"], "Accept-Encoding")
            self.assertNotEqual(small["ETag"], plain["ETag"])
        for names in ("", "identity", "br", "gzip;q=0", "gzip;q=0.000", "gzip;q=", "gzip;x", "x-gzip"):
            self.assertNotIn("Content-Encoding", self.get(port, "/large.js", f"Accept-Encoding: {names}")[1])
        self.assertNotIn("Content-Encoding", self.get(port, "/noise.safetensors", "Accept-Encoding: gzip")[1])
        (self.page / "large.js").write_text("built again", encoding="utf-8")
        self.assertEqual(gzip.decompress(self.get(port, "/large.js", "Accept-Encoding: gzip")[2]),
                         b"built again")

    def test_a_known_version_is_not_sent_again(self):
        port = self.serve()
        tag = self.get(port, "/")[1]["ETag"]
        for known in (tag, "W/" + tag, f'"x", {tag}'):
            status, fields, body = self.get(port, "/", f"If-None-Match: {known}")
            self.assertEqual((status, fields["ETag"], body), (304, tag, b""))
        (self.page / "index.html").write_text("another page", encoding="utf-8")
        self.assertEqual(self.get(port, "/", f"If-None-Match: {tag}")[2], b"another page")

    def test_refuses_malformed_requests(self):
        port = self.serve()
        for request in ("GET", "GET /", "GET / x HTTP/1.1" + HOST, "GET index.html HTTP/1.1" + HOST,
                        "GET http://localhost/ HTTP/1.1" + HOST, "GET / HTTPS/1.1" + HOST,
                        "GET /%00 HTTP/1.1" + HOST, "GET /%0a HTTP/1.1" + HOST, "GET /%1b[2J HTTP/1.1" + HOST,
                        "GET / HTTP/1.1", "GET / HTTP/1.1" + HOST + HOST, "\x16\x03\x01 TLS"):
            self.assert_status(port, request + "\r\n\r\n", 400)
        self.assert_status(port, "GET / HTTP/2.0" + HOST + "\r\n\r\n", 505)
        for method in ("POST", "PUT", "DELETE", "OPTIONS", "CONNECT", "get"):
            self.assert_status(port, f"{method} / HTTP/1.1{HOST}\r\n\r\n", 501)
        for field in ("Content-Length: 1", "Content-Length: x", "Transfer-Encoding: chunked"):
            self.assert_status(port, f"POST / HTTP/1.1{HOST}\r\n{field}\r\n\r\nsome text", 413)
        for endless in ("GET /" + "a" * 200_000, f"GET / HTTP/1.1{HOST}\r\nA: {'a' * 200_000}\r\n\r\n",
                        f"GET / HTTP/1.1{HOST}" + "\r\nA: b" * 50_000):
            self.assert_status(port, endless, 431)
        self.exchange(port, "\r\n\r\n")
        self.assertTrue(self.exchange(port, "GET /" + LAST).endswith(b"<!doctype html>"))

    def test_only_the_names_of_this_machine(self):
        port = self.serve()
        for host in ("localhost", "LocalHost:4173", "127.0.0.1", "127.0.0.1:80", "[::1]", "[::1]:4173"):
            self.assertTrue(self.exchange(port, f"GET / HTTP/1.0\r\nHost: {host}\r\n\r\n")
                            .startswith(b"HTTP/1.1 200 "), host)
        for host in ("", "example.org", "localhost.example.org", "example.org:4173", "127.0.0.2", "0.0.0.0",
                     "::1", "[::2]", "localhost:x", "localhost:1:2", "localhost, example.org",
                     "user@localhost", "localhost.", "localhost\r\n example.org"):
            self.assert_status(port, f"GET / HTTP/1.1\r\nHost: {host}\r\n\r\n", 403)
        with self.assertRaises(ConnectionRefusedError):
            self.connect(port, "127.0.0.2")

    def test_several_requests_in_a_connection(self):
        port = self.serve()
        get = f"GET / HTTP/1.1{HOST}\r\n\r\n"
        text = f"{get}{get}GET /none{LAST}"
        once = self.exchange(port, text)
        self.assertEqual(once.count(b"<!doctype html>"), 2)
        self.assertTrue(once.endswith(b"404 Not Found\n"))
        letters = self.connect(port)
        for letter in text:
            letters.sendall(letter.encode())
        self.assertEqual(self.receive(letters), once)

    def test_ends_connections_that_take_too_long(self):
        port = self.serve(patience=0.5)
        silent, slow = self.connect(port), self.connect(port)
        self.assertEqual(self.receive(silent), b"")
        with self.assertRaises(OSError):  # letters without an end do not keep it open
            for _ in range(6000):
                slow.sendall(b"a")
                time.sleep(0.01)
        self.connect(port).sendall(f"GET /noise.safetensors HTTP/1.1{HOST}\r\n\r\n".encode())  # does not read
        self.assertTrue(self.exchange(port, "GET /" + LAST).endswith(b"<!doctype html>"))

    def test_more_connections_than_it_holds_wait(self):
        port = self.serve()
        every = [self.connect(port) for _ in range(100)]
        for connection in reversed(every):
            connection.sendall(("GET /" + LAST).encode())
        for connection in every:
            self.assertTrue(self.receive(connection).endswith(b"<!doctype html>"))
            connection.close()

    def test_ports_and_end(self):
        first = self.start()
        port = int(first.stdout.readline())
        self.assertGreater(self.serve(first=port), port)
        self.assertEqual(self.stop(self.start(first=port, last=port)),
                         (1, f"upswing: port {port} is already in use\n"))
        self.connect(port)  # an open connection does not delay the end
        self.assertEqual(self.stop(first), (0, ""))

    def test_ends_silently_after_the_program(self):
        """However the connection ends: before the port is written, or with the port unread."""
        for waits in (False, True):
            with self.subTest(waits=waits):
                ours, its = socket.socketpair()
                if not waits:
                    ours.close()
                server = subprocess.Popen([sys.executable, "-c", PROGRAM, f"15\n4173\n65535\n{self.page}"],
                                          stdin=its, stdout=its, stderr=subprocess.PIPE)
                its.close()
                if waits:
                    select.select([ours], [], [], 60)
                    ours.close()
                self.assertEqual((server.communicate()[1], server.returncode), (b"", 0))

    def test_modules_of_the_present_folder_are_not_read(self):
        (self.folder / "gzip.py").write_text("raise SystemExit('imported')\n", encoding="utf-8")
        self.assertEqual(self.get(self.serve(), "/")[0], 200)


if __name__ == "__main__":
    os.environ.pop("PYTHONSAFEPATH", None)
    unittest.main()
