"""Use of can-utils: candump as an independent witness of the bus, cansend and cangen as other nodes."""

import re
import shutil
import subprocess
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest

TIMEOUT_S = 120.0
MARK = "1FF00F00"
"""Anonymous, lowest priority, with a type ID whose low bits are 3: used by no node."""

_LINE = re.compile(r"\((?P<at>[0-9.]+)\) (?P<channel>\S+) (?P<id>[0-9A-F]+)#(?P<data>[0-9A-F]*)( [RT])?")


class Line(NamedTuple):
    """One extended data frame of a log: seconds since 1970, identifier in hex, data in hex."""

    at: float
    can_id: str
    data: str


def needed() -> None:
    """Skip the test where there is no can-utils."""
    if shutil.which("candump") is None:
        pytest.skip("no can-utils here: sudo apt-get install can-utils")


def cansend(*frames: str) -> None:
    """Send frames on vcan0 in sequence, in the format of cansend."""
    command = ["xargs", "-n1", "cansend", "vcan0"]
    subprocess.run(command, input="\n".join(frames), text=True, check=True, timeout=TIMEOUT_S)


def mark(what: str) -> None:
    """Send a complete transfer of 1 to 7 characters that no node handles, as a mark in the log."""
    cansend(f"{MARK}#{_marking(what)}")


def _marking(what: str) -> str:
    return what.encode().hex().upper() + "C0"


@contextmanager
def candump(log: Path) -> Generator[None]:
    """Record all frames on vcan0 into `log` with candump."""
    with log.open("w") as file, subprocess.Popen(["stdbuf", "-oL", "candump", "-L", "vcan0"], stdout=file) as process:
        try:
            end = time.monotonic() + TIMEOUT_S
            while not log.read_text():
                assert time.monotonic() < end, "candump receives nothing"
                mark("begin")
            yield
            mark("end")
            while _marking("end") not in log.read_text():
                assert time.monotonic() < end, "candump did not reach the end"
                time.sleep(0.05)
        finally:
            process.terminate()
            process.wait(timeout=TIMEOUT_S)


def lines(log: str) -> list[Line]:
    """The extended data frames of a log in candump format, in order."""
    found = (_LINE.fullmatch(each) for each in log.splitlines())
    return [Line(float(each["at"]), each["id"], each["data"]) for each in found if each and len(each["id"]) == 8]


def between(frames: list[Line], first: str, last: str) -> list[Line]:
    """The frames after the mark `first` and before the mark `last`."""
    marks = [(frame.can_id, frame.data) for frame in frames]
    return frames[marks.index((MARK, _marking(first))) + 1 : marks.index((MARK, _marking(last)))]
