"""Runs the demo as on Windows, as far as possible: `-m contract.platform_emulation`.

Imports the third-party packages, removes what only POSIX has, and starts the demo with the command line's function,
sends it requests, and ends it.
"""

import asyncio
import importlib.abc
import os
import select
import signal
import socket
import sys
import threading
import urllib.request
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import Final

THIRD_PARTY: Final = (
    "can.interfaces.socketcan",
    "fastapi",
    "serial.tools.list_ports",
    "sqlalchemy.dialects.sqlite",
    "typer.testing",
    "uvicorn.protocols.http.h11_impl",
    "uvicorn.protocols.websockets.websockets_sansio_impl",
    "viser",
)
"""Packages that depend on the system when they are imported."""
POSIX_MODULES: Final = ("fcntl", "pty", "termios", "pwd", "grp", "resource", "tty", "syslog", "uvloop", "httptools")
POSIX: Final = (
    (signal, "SIGUSR1 SIGUSR2 SIGHUP SIGKILL SIGALRM SIGQUIT setitimer pthread_sigmask"),
    (socket, "AF_CAN PF_CAN CAN_RAW AF_NETLINK AF_UNIX"),
    (os, "sched_setaffinity fork getuid geteuid getgid uname mkfifo openpty setsid killpg getpgid nice chown statvfs"),
    (select, "epoll poll"),
)


class Missing(importlib.abc.MetaPathFinder):
    """Hides POSIX modules."""

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None) -> None:
        """Raises ModuleNotFoundError for them; finds no other."""
        if fullname in POSIX_MODULES:
            raise ModuleNotFoundError(f"No module named {fullname!r}", name=fullname)


def emulate_windows() -> None:
    """Remove what Windows lacks."""
    import platformdirs.windows

    for name in THIRD_PARTY:
        import_module(name)
    socket.socketpair = partial(socket.socketpair, socket.AF_UNIX)  # type: ignore[assignment] - the event loop needs it
    for module, names in POSIX:
        for name in names.split():
            if hasattr(module, name):
                delattr(module, name)
    for name in POSIX_MODULES:
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, Missing())
    sys.platform = "win32"
    platformdirs.PlatformDirs = platformdirs.windows.Windows  # type: ignore[misc]
    socket.SO_EXCLUSIVEADDRUSE = socket.SO_KEEPALIVE  # type: ignore[attr-defined] - one that Linux takes
    # The shell and the registry are not available here.
    platformdirs.windows.get_win_folder = platformdirs.windows.get_win_folder_from_env_vars

    def none(_self: object, *_arguments: object) -> None:
        raise NotImplementedError

    asyncio.unix_events._UnixSelectorEventLoop.add_signal_handler = none  # type: ignore[attr-defined] # pyright: ignore


def start_and_request() -> None:
    """Start the demo as `hornbill demo --port 0` does, and print its responses."""
    from hornbill.app import serving
    from hornbill.app.settings import Settings
    from hornbill.cli.server import starting

    print("data", Settings().data_dir, flush=True)
    listening: list[int] = []
    listen = serving.listen

    def listen_and_report(host: str, port: int) -> socket.socket:
        made = listen(host, port)
        print("reuse", made.getsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR), flush=True)
        listening.append(made.getsockname()[1])
        return made

    serving.listen = listen_and_report
    failed: list[BaseException] = []

    def send_requests() -> None:
        try:
            while not listening:
                threading.Event().wait(0.05)
            for path in ("api/v1/health", "api/v1/bus/adapters", "api/v1/bus/doctor", "viser/", ""):
                with urllib.request.urlopen(f"http://127.0.0.1:{listening[0]}/{path}", timeout=60) as response:
                    # One write per line: the server prints from another thread.
                    sys.stdout.write(f"\n{response.status} {path} {len(response.read())}\n")
                    sys.stdout.flush()
        except BaseException as error:
            failed.append(error)
        finally:
            signal.raise_signal(signal.SIGINT)

    threading.Thread(target=send_requests, daemon=True).start()
    starting.demo(port=0, servos=1)
    if failed:
        raise failed[0]


if __name__ == "__main__":
    emulate_windows()
    start_and_request()
