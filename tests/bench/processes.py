"""The processes of benchmarks in real time: servos behind a serial adapter, and a server as a user starts it."""

import os
import pty
import re
import subprocess
import sys
import time
import tty
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

import httpx

HERE = Path(__file__).parents[1]


@contextmanager
def adapter(module: str, count: int) -> Generator[tuple[str, "subprocess.Popen[bytes]"]]:
    """The device of a serial adapter with servos behind it, run by `module` in a separate process."""
    theirs, ours = pty.openpty()
    tty.setraw(ours)
    command = [sys.executable, "-m", module, str(theirs), str(count)]
    with subprocess.Popen(command, pass_fds=(theirs,), cwd=HERE, stdout=subprocess.PIPE, bufsize=0) as process:
        try:
            yield os.ttyname(ours), process
        finally:
            process.terminate()
            os.close(ours)
            os.close(theirs)


@contextmanager
def server(module: Sequence[str], *arguments: str) -> Generator[tuple[str, int]]:
    """Address and process ID of a server that `python MODULE ARGUMENTS` starts, until the block ends."""
    command = [sys.executable, *module, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=HERE) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"http://\S+/", process.stdout.readline())
            assert found is not None, "the server printed no address"
            yield found[0], process.pid
        finally:
            process.terminate()
            process.wait(timeout=30)


@contextmanager
def listeners(url: str, sockets: int) -> Generator["subprocess.Popen[bytes]"]:
    """Sockets and a reader that use a server until the block ends."""
    command = [sys.executable, "-m", "bench.stop_listeners", url, str(sockets)]
    with subprocess.Popen(command, cwd=HERE) as process:
        try:
            yield process
        finally:
            process.terminate()


def wait_until_ready(url: str, count: int) -> None:
    """Return when that many servos are ready; fails after a minute."""
    until = time.monotonic() + 60
    while sum(one["state"] == "ready" for one in httpx.get(url + "api/v1/servos", timeout=30).json()) < count:
        assert time.monotonic() < until, f"not all {count} servos are ready after a minute"
        time.sleep(0.5)


def cpu_s(pid: int) -> float:
    """CPU time of a process, which a busy machine affects less than wall time."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
