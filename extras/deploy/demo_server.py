"""The web server of `upswing demo`, which runs this file by itself: python3 -c TEXT JOB.

Lines of JOB:
  patience [s] with a request, and with a part of an answer
  first port
  last port; the server takes the first free one
  folder of the page
  folder to serve as agents/ (optional)

Prints the port, and serves files on 127.0.0.1 until its input ends.
"""

import sys

sys.path = [place for place in sys.path if place]  # no modules from the present folder

# pylint: disable=wrong-import-position
import contextlib  # noqa: E402
import errno  # noqa: E402
import gzip  # noqa: E402
import hashlib  # noqa: E402
import http.server  # noqa: E402
import io  # noqa: E402
import os  # noqa: E402
import re  # noqa: E402
import socket  # noqa: E402
import socketserver  # noqa: E402
import threading  # noqa: E402
import time  # noqa: E402
import urllib.parse  # noqa: E402

MOST_BYTES = 16384  # of a request line and its header fields
MOST_CONNECTIONS = 64  # further ones wait in the system's queue
THIS_MACHINE = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])(:\d*)?", re.IGNORECASE | re.ASCII)

TEXTS = {".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8",
         ".css": "text/css; charset=utf-8", ".xml": "text/xml; charset=utf-8",
         ".txt": "text/plain; charset=utf-8", ".json": "application/json", ".svg": "image/svg+xml",
         ".webmanifest": "application/manifest+json", ".wasm": "application/wasm"}  # gzip shrinks them
TYPES = TEXTS | {".png": "image/png", ".gif": "image/gif", ".ico": "image/x-icon", ".webm": "video/webm",
                 ".woff2": "font/woff2"}

PATIENCE, FIRST_PORT, LAST_PORT, *FOLDERS = sys.argv[1].split("\n")
COMPRESSED = {}  # file: (version, bytes)


def file_of(path):
    """The file for a decoded path; None if there is none, if it is hidden or outside the folder."""
    parts = [part for part in path.split("/") if part]
    if path.endswith("/"):
        parts.append("index.html")
    if any(part.startswith(".") for part in parts):
        return None
    folder = os.path.realpath(FOLDERS[0])
    if parts[0] == "agents" and len(FOLDERS) > 1:
        folder = os.path.realpath(FOLDERS[1])
        del parts[0]
    file = os.path.realpath(os.path.join(folder, *parts))
    return file if file.startswith(folder + "/") and os.path.isfile(file) else None


def compressed(file, text, version):
    if COMPRESSED.get(file, ("",))[0] != version:
        COMPRESSED[file] = version, gzip.compress(text, 6, mtime=0)
    return COMPRESSED[file][1]


def version_of(text):
    return hashlib.sha256(text).hexdigest()[:16]


def compress_all(folder):
    """Compresses all texts, so that no request waits for that."""
    for place, _, names in os.walk(folder):
        for name in names:
            file = os.path.realpath(os.path.join(place, name))
            if os.path.splitext(name)[1] in TEXTS and os.path.isfile(file):
                with open(file, "rb") as opened:
                    text = opened.read()
                compressed(file, text, version_of(text))


class Handler(http.server.BaseHTTPRequestHandler):
    """A connection, which may have several requests."""

    protocol_version = default_request_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    timeout = float(PATIENCE)
    error_message_format = "%(code)d %(message)s\n"
    error_content_type = "text/plain; charset=utf-8"
    received = b""  # not yet answered

    def handle_one_request(self):
        """Receives a whole request within PATIENCE, and answers it."""
        end = time.monotonic() + self.timeout
        while (size := self.received.find(b"\r\n\r\n", 0, MOST_BYTES)) < 0:
            if len(self.received) >= MOST_BYTES:
                self.command, self.request_version = "", "HTTP/1.1"
                self.send_error(431)
                return
            self.connection.settimeout(max(end - time.monotonic(), 1e-3))
            try:
                piece = self.connection.recv(4096)
            except OSError:
                piece = b""
            if not piece:
                self.close_connection = True
                return
            self.received += piece
        self.connection.settimeout(self.timeout)
        self.rfile = io.BytesIO(self.received[:size + 4])
        self.received = self.received[size + 4:]
        super().handle_one_request()

    def parse_request(self):
        """Refuses requests for other machines (DNS rebinding), with a body, or with odd paths."""
        if not super().parse_request():
            return False
        hosts = self.headers.get_all("Host", [])
        self.path = urllib.parse.unquote(self.path.split("?")[0])
        if len(hosts) != 1 or not self.path.startswith("/") or not self.path.isprintable():
            self.send_error(400)
        elif not THIS_MACHINE.fullmatch(hosts[0]):
            self.send_error(403)
        elif self.headers.get("Transfer-Encoding") or self.headers.get("Content-Length", "0") != "0":
            self.send_error(413)
        else:
            return True
        return False

    def do_GET(self):  # pylint: disable=invalid-name
        file = file_of(self.path)
        if file is None:
            self.send_error(404)
            return
        try:
            with open(file, "rb") as opened:
                body = opened.read()
        except OSError:
            self.send_error(500)
            return
        ending, version = os.path.splitext(file)[1], version_of(body)
        if ending in TEXTS and self.takes_gzip():
            body = compressed(file, body, version)
            version += "-gzip"
        known = f'"{version}"' in self.headers.get("If-None-Match", "")
        self.send_response(304 if known else 200)
        # The browser asks each time, so that it sees a page that was built again.
        self.send_header("Cache-Control", "no-cache")
        self.send_header("ETag", f'"{version}"')
        if ending in TEXTS:
            self.send_header("Vary", "Accept-Encoding")
        if not known:
            self.send_header("Content-Type", TYPES.get(ending, "application/octet-stream"))
            self.send_header("Content-Length", str(len(body)))
            if version.endswith("-gzip"):
                self.send_header("Content-Encoding", "gzip")
        self.end_headers()
        if self.command == "GET" and not known:
            for start in range(0, len(body), 1 << 16):  # PATIENCE for each piece
                self.wfile.write(body[start:start + (1 << 16)])

    do_HEAD = do_GET

    def takes_gzip(self):
        """Whether Accept-Encoding has gzip with a weight other than 0."""
        return any(re.fullmatch(r"\s*(gzip|\*)\s*(;q=(?!0(\.0*)?$)[0-9.]+)?\s*", entry, re.IGNORECASE)
                   for entry in self.headers.get("Accept-Encoding", "").split(","))

    def send_response(self, code, message=None):
        self.send_response_only(code, message)  # no fields Server and Date
        self.send_header("X-Content-Type-Options", "nosniff")

    def log_message(self, *_):  # pylint: disable=arguments-differ
        pass

    def finish(self):
        """Waits until the browser ends: closing with unread data could discard the answer."""
        super().finish()
        self.connection.shutdown(socket.SHUT_WR)
        end = time.monotonic() + self.timeout
        while time.monotonic() < end and self.connection.recv(1 << 16):
            pass


class Server(socketserver.ThreadingTCPServer):
    allow_reuse_address, allow_reuse_port = True, False
    daemon_threads = True
    request_queue_size = 128
    free = threading.Semaphore(MOST_CONNECTIONS)

    def process_request(self, request, client_address):
        self.free.acquire()  # pylint: disable=consider-using-with
        super().process_request(request, client_address)

    def process_request_thread(self, request, client_address):
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.free.release()

    def handle_error(self, request, client_address):
        pass  # a browser that went away


def listen():
    for port in range(int(FIRST_PORT), int(LAST_PORT) + 1):
        try:
            return Server(("127.0.0.1", port), Handler)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                sys.exit(f"upswing: cannot listen on port {port}: {error.strerror}")
    sys.exit(f"upswing: port {port} is already in use")


def main():
    server = listen()
    compress_all(FOLDERS[0])
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with contextlib.suppress(ConnectionError):
        os.write(sys.stdout.fileno(), b"%d\n" % server.server_address[1])
        sys.stdin.buffer.read()  # until the program ends


main()
