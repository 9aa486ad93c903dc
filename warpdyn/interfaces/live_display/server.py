"""A web server on the loopback interface that sends a page and its newest frame to browsers of this computer."""

from __future__ import annotations

import secrets
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from socketserver import TCPServer
from typing import Any
from urllib.parse import parse_qs

PAGE = Path(__file__).parent / "display.html"
LOOPBACK = "127.0.0.1"
HOSTS = (LOOPBACK, "localhost")  # another name in a request is that of a web site which a browser resolved to LOOPBACK
LONGEST_WAIT = 1.0  # time that a request waits for a new frame [s]
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; "
    "frame-ancestors 'none'"
)
MOST_REQUESTS = 32  # requests at the same time, one thread each; a browser makes one or two


class PageServer(ThreadingHTTPServer):
    """A server of the page and its newest frame; each request has a thread, which never holds up `publish` for long.

    Args:
        port: Port on the loopback interface; 0: a free port.

    Raises:
        ValueError: If the port is not free.
    """

    daemon_threads = True

    def __init__(self, port: int) -> None:
        self.identity = secrets.token_hex(4)  # a page that remained open recognises another display at its port
        # Part of the address, so that other users of this computer, who do not know it, cannot read the page.
        self.token = secrets.token_urlsafe(16)
        self._free = threading.Semaphore(MOST_REQUESTS)
        self._frame, self._number, self._is_open = b"{}", 0, True
        self._changed = threading.Condition()
        try:
            super().__init__((LOOPBACK, port), _Request)
        except OSError as error:
            raise ValueError(f"port {port} is not free ({error.strerror}): give another port, or port=0") from None
        self._thread = threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
        self._thread.start()

    def server_bind(self) -> None:
        """Bind the socket, without asking for the name of this computer in the network."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = self.server_address[:2]  # type: ignore[assignment]

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{LOOPBACK}:{self.server_port}/{self.token}/"

    def process_request(self, request: Any, client_address: Any) -> None:
        """Handle a request in a new thread; close its connection at once if MOST_REQUESTS are being handled."""
        if self._free.acquire(blocking=False):
            try:
                super().process_request(request, client_address)
            except BaseException:  # no thread could be started
                self._free.release()
                raise
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Handle a request in its thread."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def publish(self, frame: str) -> None:
        """Replace the frame, a JSON text."""
        with self._changed:
            self._frame = frame.encode()
            self._number += 1
            self._changed.notify_all()

    def frame_after(self, known: str) -> tuple[str, bytes] | None:
        """Wait for a frame other than a known one; return its name and its text, or None if there is no new one."""
        with self._changed:
            self._changed.wait_for(lambda: self._name != known or not self._is_open, timeout=LONGEST_WAIT)
            return None if self._name == known else (self._name, self._frame)

    @property
    def _name(self) -> str:
        return f"{self.identity}-{self._number}"

    def close(self) -> None:
        """End the server, its waiting requests and its thread."""
        with self._changed:
            self._is_open = False
            self._changed.notify_all()
        self.shutdown()
        self._thread.join()
        self.server_close()


class _Request(BaseHTTPRequestHandler):
    """A request of a browser: for the page, or for the frame after the one that it has shown last."""

    server: PageServer
    timeout = 5  # s for reading a request

    def do_GET(self) -> None:
        """Answer a request."""
        path, _, query = self.path.partition("?")
        folder, _, name_of_page = path.removeprefix("/").partition("/")
        if self.headers.get("Host", "").rsplit(":", 1)[0] not in HOSTS:
            self._send(403, "text/plain", b"only for browsers of this computer")
        elif not secrets.compare_digest(folder.encode(), self.server.token.encode()):
            self._send(404, "text/plain", b"not found: open the whole address that display.url contains")
        elif name_of_page == "":
            self._send(200, "text/html; charset=utf-8", PAGE.read_bytes())
        elif name_of_page == "frame":
            found = self.server.frame_after(parse_qs(query).get("after", [""])[0])
            name, frame = found or ("", b"")
            self._send(200 if found else 204, "application/json", frame, name)
        else:
            self._send(404, "text/plain", b"not found")

    def _send(self, status: int, kind: str, body: bytes, name: str = "") -> None:
        self.send_response(status)
        headers = {"Content-Type": kind, "Content-Length": str(len(body)), "Cache-Control": "no-store"}
        headers |= {"Content-Security-Policy": POLICY, "X-Content-Type-Options": "nosniff"}
        for key, value in (headers | ({"ETag": f'"{name}"'} if name else {})).items():
            self.send_header(key, value)
        self.end_headers()
        self.wfile.write(body)

    def handle(self) -> None:
        """Handle a request; a browser may leave before the answer arrives."""
        try:
            super().handle()
        except (ConnectionError, TimeoutError):
            self.close_connection = True

    def log_message(self, format: str, *args: object) -> None:
        """Write nothing."""
