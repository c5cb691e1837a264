"""A page and its tables served to a browser of this machine, which may be at the other end of an SSH tunnel."""

import re
import sys
import threading
from collections.abc import Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from socket import socket
from typing import Any
from urllib.parse import unquote

from jaxsat.errors import InputError

NAMES = ("127.0.0.1", "localhost", "[::1]")
"""By which a browser may call this machine: under another name a page of a stranger would ask, and read the answer."""
MOST_AT_ONCE = 16
PATIENCE_S = 10.0
"""For a connection on which nothing comes, as browsers keep one at hand."""


class OnePage(ThreadingHTTPServer):
    """Answers all requests with the page, but those for its tables; connections beyond `MOST_AT_ONCE` are closed."""

    daemon_threads = True
    request_queue_size = 4 * MOST_AT_ONCE

    def __init__(self, page: bytes, port: int, tables: Mapping[str, Path]):
        super().__init__(("127.0.0.1", port), _Answer)
        self.page, self.tables = page, tables
        self._free = threading.Semaphore(MOST_AT_ONCE)

    def process_request(self, request: Any, client_address: Any) -> None:
        """In a thread of its own, where one is free."""
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Gives its place free when it is done."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: socket | tuple[bytes, socket], client_address: Any) -> None:
        """Silent where the other side went away, which is its right."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Answer(BaseHTTPRequestHandler):
    server: OnePage
    timeout = PATIENCE_S

    def do_GET(self) -> None:
        if re.sub(":[0-9]*$", "", self.headers.get("Host", "")).lower() not in NAMES:
            self.send_error(403, "Ask for localhost")
            return
        table = self.server.tables.get(unquote(self.path.lstrip("/")))
        # Not a link to a file, which may be any.
        found = table is not None and table.is_file() and not table.is_symlink()
        content = table.read_bytes() if table is not None and found else self.server.page
        self.send_response(200)
        self.send_header("Content-Type", "text/plain; charset=utf-8" if found else "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: object) -> None:
        """Silent: the page is asked for by one person."""


def serve(page: bytes, port: int, tables: Mapping[str, Path] | None = None) -> None:
    """Answers requests on 127.0.0.1 with the page, until interrupted; raises `InputError` for a port in use.

    `tables` are the files that it links to, by their names: these and no others are given.
    """
    try:
        server = OnePage(page, port, tables or {})
    except OSError as error:
        raise InputError(f"cannot be used: {error.strerror}", field=f"port {port}") from None
    with server:
        print(f"http://127.0.0.1:{port}/ until interrupted by Ctrl-C", flush=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            print("", file=sys.stderr)
