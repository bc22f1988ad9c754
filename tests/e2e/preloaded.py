"""`hornbill` in its own processes, forked from one that has imported it: imports take most of a start.

Run as a program, this module is that process. It receives each command line and the destination of its output.
"""

import atexit
import gc
import io
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

PID = struct.Struct("=i")
IMPORTED = ("hornbill.cli.server.tokens", "hornbill.app.composition", "hornbill.app.network_policy",
            "hornbill.app.serving")  # fmt: skip
"""Imports of a starting server."""


class Forked:
    """A running `hornbill`, with the part of subprocess.Popen that tests use."""

    def __init__(self, pid: int, stdout: io.TextIOBase) -> None:
        self.pid = pid
        self.stdout = stdout

    def poll(self) -> int | None:
        """None while it runs, then 0: its exit status is unknown."""
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return 0
        return None

    def send_signal(self, number: int) -> None:
        """Send a signal. Harmless when it has ended."""
        try:
            os.kill(self.pid, number)
        except ProcessLookupError:
            pass

    def kill(self) -> None:
        """Kill it."""
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float) -> None:
        """Wait until it has ended. Raises TimeoutError."""
        until = time.monotonic() + timeout
        while self.poll() is None:
            if time.monotonic() > until:
                raise TimeoutError(f"process {self.pid} has not ended in {timeout:g} s")
            time.sleep(0.01)

    def end(self) -> None:
        """End it gracefully, or kill it after a timeout. Can be repeated."""
        self.send_signal(signal.SIGCONT)
        self.send_signal(signal.SIGTERM)
        try:
            self.wait(10)
        except TimeoutError:
            self.kill()
            self.wait(10)
        self.stdout.close()


def start(*words: str) -> Forked:
    """Start `hornbill` with these words, in the folder and environment of this process."""
    reading, writing = os.pipe()
    request = {"words": words, "environment": dict(os.environ), "folder": str(Path.cwd())}
    with tempfile.TemporaryFile("w+") as question:
        json.dump(request, question)
        question.seek(0)
        line = _parent().line
        socket.send_fds(line, [b"?"], [question.fileno(), writing])
        os.close(writing)
        pid = PID.unpack(line.recv(PID.size))[0]
    return Forked(pid, open(reading, encoding="utf-8"))  # noqa: PTH123 - `end` closes it


class _Parent:
    """The process that forks. It ends with this process and the connection between them."""

    def __init__(self) -> None:
        self.line, theirs = socket.socketpair()
        with theirs:
            command = (sys.executable, __file__, str(theirs.fileno()))
            self._process = subprocess.Popen(command, pass_fds=[theirs.fileno()], stdout=subprocess.DEVNULL)
        atexit.register(self._end)

    def _end(self) -> None:
        self.line.close()
        self._process.wait()


@cache
def _parent() -> _Parent:
    return _Parent()


def prepare() -> None:
    """Start the process that forks, so that servers have the rights this process has now."""
    _parent()


def main(line: socket.socket) -> None:
    """Fork on request, until the requesting process ends; then end all forks."""
    for name in IMPORTED:
        import_module(name)
    _build_routes()
    os.setpgrp()
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # children are not waited for: each is removed when it ends
    gc.collect()
    gc.freeze()
    while True:
        message, descriptors, _, _ = socket.recv_fds(line, 1, 2)
        if not message:
            os.killpg(0, signal.SIGTERM)
            return
        question, output = descriptors
        pid = os.fork()
        if pid == 0:
            line.close()
            with open(question, encoding="utf-8") as file:  # noqa: PTH123 - a descriptor
                request = json.load(file)
            _become(request, output)
        os.close(question)
        os.close(output)
        line.send(PID.pack(pid))


def _build_routes() -> None:
    """Build all routes, so that not every server does."""
    from hornbill.api.http import create_api
    from hornbill.api.routing import build_route
    from hornbill.schema.catalog import Catalog

    for route in create_api(Catalog.load()).routes:
        build_route(route)


def _become(request: dict[str, Any], output: int) -> None:
    """Run `hornbill` as in `request`."""
    from hornbill.cli import main as hornbill

    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    sys.stdout = open(output, "w", encoding="utf-8")  # noqa: SIM115 - open until the process ends
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.argv = ["hornbill", *request["words"]]
    hornbill()


if __name__ == "__main__":
    main(socket.socket(fileno=int(sys.argv[1])))
