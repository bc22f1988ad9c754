"""Starting: imports, commands and the first HTTP response beside bare Python and libraries; and memory of the demo."""

import os
import resource
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
from unit.view.onlooker import CAMERA, Onlooker

ROUNDS = 3
LIBRARIES = "fastapi, uvicorn, sqlalchemy, numpy"
"""What the demo cannot do without."""
SHOWN_S = 2.0
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
    libraries: list[float] = []
    libraries_s: list[float] = []
    memory: list[float] = []
    memory_3d = 0.0
    for _ in range(ROUNDS):
        began = time.monotonic()
        libraries.append(_cpu_s("-c", f"import {LIBRARIES}"))
        libraries_s.append(time.monotonic() - began)
        began = time.monotonic()
        with running_demo("--servos", "6") as (process, url):
            httpx.get(url + "api/v1/health").raise_for_status()
            http.append(time.monotonic() - began)
            cpu.append(cpu_s(process.pid))
            while sum(one["state"] == "ready" for one in httpx.get(url + "api/v1/servos").json()) < 6:
                time.sleep(0.05)
            ready.append(time.monotonic() - began)
            memory.append(_resident_mib(process.pid))
            if len(memory) == 1:
                yield from _commands(url)
                _look(url)
                memory_3d = _resident_mib(process.pid)
    figures = {
        "times": round(min(cpu) / min(libraries), 2), "cpu_s": round(min(cpu), 2), "libraries_cpu_s": min(libraries),
        "s_median": round(statistics.median(http), 2),
    }  # fmt: skip
    yield line("demo responds over HTTP", figures, of="times", must=2.0, aim=1.5, peer=f"import {LIBRARIES}")
    theirs = min(libraries_s)
    figures = {"times": round(min(ready) / theirs, 1), "s": round(min(ready), 2), "libraries_s": round(theirs, 2)}
    yield line("demo has six readable servos", figures, of="times", must=9.0, peer=f"import {LIBRARIES}")
    yield line("memory of the demo", {"mib_max": round(max(memory))}, of="mib_max", must=100, aim=75)
    yield line("memory of the demo with the 3D view", {"mib_max": round(memory_3d)}, of="mib_max", must=135, aim=120)


def _commands(url: str) -> Iterator[dict[str, Any]]:
    """CPU time of commands beside that of an empty Python."""
    for words in ("--version", "--help", f"list --server {url}"):
        took: list[float] = []
        empty: list[float] = []
        for _ in range(2 * ROUNDS + 1):
            empty.append(_cpu_s("-c", "pass"))
            took.append(_cpu_s("-m", "hornbill", *words.split()))
        mine, python = statistics.median(took), statistics.median(empty)
        figures = {"times": round(mine / python, 1), "cpu_s": round(mine, 3), "python_cpu_s": round(python, 4)}
        name = f"hornbill {words.partition(' ')[0]}"
        yield line(name, figures, of="times", must=14.0, peer="an empty Python")


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
    return line("import hornbill", figures, of="s_median", must=0.15, limit="what a person takes for immediate")


def _importing_client() -> dict[str, Any]:
    """Import of the client beside that of httpx, in one environment."""
    scripts = ("import httpx", "from hornbill.client import Hornbill", "from hornbill.client import AsyncHornbill")
    rounds = [[_cpu_s("-c", script) for script in scripts] for _ in range(2 * ROUNDS + 1)]
    alone, ours, asyncio = (statistics.median(took) for took in zip(*rounds, strict=True))
    figures = {
        "times": round(ours / alone, 2), "asyncio_times": round(asyncio / alone, 2), "httpx_cpu_s": round(alone, 3),
    }  # fmt: skip
    return line("import hornbill.client", figures, of="times", must=1.15, peer="import httpx")


def _cpu_s(*arguments: str) -> float:
    """CPU seconds of `python ARGUMENTS`."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 4)


def _run(script: str) -> float:
    began = time.monotonic()
    subprocess.run([sys.executable, "-c", script], check=True)
    return time.monotonic() - began


def _look(url: str) -> None:
    """Have the scene sent as to a browser, and watch it for a while."""
    page = f"viser/{'0' * 32}/"
    httpx.get(url + page, timeout=30).raise_for_status()
    with Onlooker(url.replace("http", "ws", 1) + page, origin=url.rstrip("/")) as onlooker:
        onlooker.send(CAMERA)  # else viser sends no scene
        assert onlooker.read_for(SHOWN_S), "no scene was sent"


def _resident_mib(pid: int) -> float:
    """Resident memory of a process, as the kernel counts it."""
    (row,) = (line_ for line_ in Path(f"/proc/{pid}/status").read_text().splitlines() if line_.startswith("VmRSS:"))
    return int(row.split()[1]) / 1024
