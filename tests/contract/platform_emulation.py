"""A pretence: this Python as on another system, as far as hornbill can tell: `-m contract.elsewhere win32`.

What others need of the system is imported before; then everything POSIX alone has is taken away, and the demo is
started by the command line's own function, asked over HTTP, and ended.
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
from typing import Any, Final

NEEDED_BY_OTHERS: Final = (
    "can.interfaces.socketcan",
    "fastapi",
    "serial.tools.list_ports",
    "sqlalchemy.dialects.sqlite",
    "typer.testing",
    "uvicorn.protocols.http.h11_impl",
    "uvicorn.protocols.websockets.websockets_sansio_impl",
    "viser",
)
"""Third parties that look at the system when they are imported: that they know others is theirs to test."""
POSIX_MODULES: Final = ("fcntl", "pty", "termios", "pwd", "grp", "resource", "tty", "syslog", "uvloop", "httptools")
LINUX: Final = ((socket, "AF_CAN PF_CAN CAN_RAW AF_NETLINK"), (select, "epoll"), (os, "sched_setaffinity"))
POSIX: Final = (
    (signal, "SIGUSR1 SIGUSR2 SIGHUP SIGKILL SIGALRM SIGQUIT setitimer pthread_sigmask"),
    (os, "fork getuid geteuid getgid uname mkfifo openpty setsid killpg getpgid geteuid nice chown statvfs"),
    (socket, "AF_UNIX"),
    (select, "poll"),
)


class Missing(importlib.abc.MetaPathFinder):
    """Finds that some modules are not there."""

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None) -> None:
        """Raises ModuleNotFoundError for them; knows no other."""
        if fullname in POSIX_MODULES:
            raise ModuleNotFoundError(f"No module named {fullname!r}", name=fullname)


def pretend(platform: str) -> None:
    """Take away what `platform` ("win32" or "darwin") has not."""
    import platformdirs.macos
    import platformdirs.windows

    for name in NEEDED_BY_OTHERS:
        import_module(name)
    socket.socketpair = partial(socket.socketpair, socket.AF_UNIX)  # type: ignore[assignment] - the loop's own need
    for module, names in (*LINUX, *(POSIX if platform == "win32" else ())):
        for name in names.split():
            if hasattr(module, name):
                delattr(module, name)
    for name in POSIX_MODULES:
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, Missing())
    sys.platform = platform
    if platform == "darwin":
        platformdirs.PlatformDirs = platformdirs.macos.MacOS  # type: ignore[misc]
    if platform == "win32":
        platformdirs.PlatformDirs = platformdirs.windows.Windows  # type: ignore[misc]
        socket.SO_EXCLUSIVEADDRUSE = socket.SO_KEEPALIVE  # type: ignore[attr-defined] - one that Linux takes
        # It would ask the shell or the registry for the folder; the third way is the one there is here.
        platformdirs.windows.get_win_folder = platformdirs.windows.get_win_folder_from_env_vars

        def none(_self: object, *_arguments: object) -> None:
            raise NotImplementedError

        asyncio.unix_events._UnixSelectorEventLoop.add_signal_handler = none  # type: ignore[attr-defined] # pyright: ignore


def start_and_ask() -> None:
    """The demo, as `hornbill demo --port 0` starts it; prints what it answered."""
    from hornbill.app import serving
    from hornbill.app.settings import Settings
    from hornbill.cli.server import starting

    print("data", Settings().data_dir, flush=True)
    listening: list[int] = []
    listen = serving.listen

    def heard(host: str, port: int) -> socket.socket:
        made = listen(host, port)
        print("reuse", made.getsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR), flush=True)
        listening.append(made.getsockname()[1])
        return made

    serving.listen = heard
    failed: list[BaseException] = []

    def ask() -> None:
        try:
            while not listening:
                threading.Event().wait(0.05)
            for path in ("api/v1/health", "api/v1/bus/adapters", "api/v1/bus/doctor", "viser/", ""):
                with urllib.request.urlopen(f"http://127.0.0.1:{listening[0]}/{path}", timeout=60) as answer:
                    # One write a line: the server prints from another thread.
                    sys.stdout.write(f"\n{answer.status} {path} {len(answer.read())}\n")
                    sys.stdout.flush()
        except BaseException as error:
            failed.append(error)
        finally:
            signal.raise_signal(signal.SIGINT)

    threading.Thread(target=ask, daemon=True).start()
    starting.demo(port=0, servos=1)
    if failed:
        raise failed[0]


def main(arguments: list[str]) -> Any:
    """Pretend and start."""
    pretend(arguments[0])
    start_and_ask()


if __name__ == "__main__":
    main(sys.argv[1:])
