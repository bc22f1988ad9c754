"""Starting: the import, the first HTTP response, six readable servos; and memory while the 3D view is shown."""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

from bench.line import line
from bench.processes import cpu_s
from e2e.servers import running_demo
from unit.view.onlooker import Onlooker

ROUNDS = 3
SHOWN_S = 3.0
"""Duration of watching the 3D view before memory is read."""


def figures() -> Iterator[dict[str, Any]]:
    """Warm starts of Python with hornbill, and of `hornbill demo --servos 6`."""
    with _compiled():
        yield _importing()
        yield _importing_client()
        yield from _starting()


def _starting() -> Iterator[dict[str, Any]]:
    http: list[float] = []
    ready: list[float] = []
    cpu: list[float] = []
    memory: list[float] = []
    for _ in range(ROUNDS):
        began = time.monotonic()
        with running_demo("--servos", "6") as (process, url):
            httpx.get(url + "api/v1/health").raise_for_status()
            http.append(time.monotonic() - began)
            cpu.append(cpu_s(process.pid))
            while sum(one["state"] == "ready" for one in httpx.get(url + "api/v1/servos").json()) < 6:
                time.sleep(0.05)
            ready.append(time.monotonic() - began)
            _look(url)
            memory.append(_resident_mib(process.pid))
    figures = {"s_median": round(statistics.median(http), 2), "cpu_s_median": round(statistics.median(cpu), 2)}
    yield line("demo responds over HTTP", figures, of="s_median", must=1.5)
    figures = {"s_median": round(statistics.median(ready), 2)}
    yield line("demo has six readable servos", figures, of="s_median", must=12.0)
    yield line("memory of the demo with the 3D view", {"mib_max": round(max(memory))}, of="mib_max", must=150)


@contextmanager
def _compiled() -> Generator[None]:
    """Let Python keep the byte code of what it imports, as for installed packages, also if the environment disables it.

    A start that compiles all of hornbill first takes 0.5 s longer and is no warm one.
    """
    disabled = {name: os.environ.pop(name, None) for name in ("PYTHONDONTWRITEBYTECODE", "PYTHONPYCACHEPREFIX")}
    with tempfile.TemporaryDirectory() as folder:
        os.environ["PYTHONPYCACHEPREFIX"] = folder
        try:
            with running_demo("--servos", "6") as (_, url):
                _look(url)
            yield
        finally:
            del os.environ["PYTHONPYCACHEPREFIX"]
            os.environ.update({name: value for name, value in disabled.items() if value is not None})


def _importing() -> dict[str, Any]:
    """Time of `import hornbill` minus that of an empty Python."""
    took = {
        script: statistics.median(_run(script) for _ in range(2 * ROUNDS + 1)) for script in ("pass", "import hornbill")
    }
    figures = {"s_median": round(took["import hornbill"] - took["pass"], 3), "python_s": round(took["pass"], 3)}
    return line("import hornbill", figures, of="s_median", must=0.15)


def _importing_client() -> dict[str, Any]:
    """Time of the import of the client minus that of httpx, in one environment."""
    scripts = ("import httpx", "from hornbill.client import Hornbill", "from hornbill.client import AsyncHornbill")
    took = [statistics.median(_run(script) for _ in range(2 * ROUNDS + 1)) for script in scripts]
    figures = {
        "s_beyond_httpx": round(took[1] - took[0], 3), "asyncio_s_beyond_httpx": round(took[2] - took[0], 3),
        "httpx_s": round(took[0], 3),
    }  # fmt: skip
    return line("import hornbill.client", figures, of="s_beyond_httpx", must=0.05)


def _run(script: str) -> float:
    began = time.monotonic()
    subprocess.run([sys.executable, "-c", script], check=True)
    return time.monotonic() - began


def _look(url: str) -> None:
    """Have the scene sent as to a browser, and watch it for a while."""
    page = f"viser/{'0' * 32}/"
    httpx.get(url + page, timeout=30).raise_for_status()
    with Onlooker(url.replace("http", "ws", 1) + page, origin=url.rstrip("/")) as onlooker:
        assert onlooker.read_for(SHOWN_S), "no scene was sent"


def _resident_mib(pid: int) -> float:
    """Resident memory of a process, as the kernel counts it."""
    (row,) = (line_ for line_ in Path(f"/proc/{pid}/status").read_text().splitlines() if line_.startswith("VmRSS:"))
    return int(row.split()[1]) / 1024
