"""hornbill beside an autopilot of the public Python stack, on a kernel's CAN; candump is the witness."""

import json
import os
import re
import signal
import statistics
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from e2e.preloaded import Forked
from socketcan import can_utils
from socketcan.peer import Peer, read, uavcan, write
from socketcan.pilot import AUTOPILOT
from socketcan.processes import TIMEOUT_S, hornbill, line, until

pytestmark = pytest.mark.release

OURS = 127
ALLOCATION = 1
BUDGET_FPS = 200
READING = 101
"""Node ID of a peer that reads the servo for the test."""

LATE_S = 2.0
"""Maximum delay of the event on a busy machine; `test_roles.py` proves one command period in virtual time."""

OBSERVED_S = "HORNBILL_OBSERVED_S"
"""Environment variable: how long the observer is used, s."""

PAGES = ("/servos", "/nodes", "/bus", "/bus/doctor", "/stop", "/leases", "/inventory", "/allocations", "/recorder")


class Pilot:
    """The autopilot in its own process."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def tell(self, *lines: str) -> None:
        """Give it lines as described in `pilot.py`."""
        assert self._process.stdin is not None
        self._process.stdin.write("\n".join(lines) + "\n")
        self._process.stdin.flush()


@contextmanager
def piloting(folder: Path) -> Generator[Pilot]:
    """The autopilot, silent until its safety switch is off."""
    command = [sys.executable, "-m", "socketcan.pilot", str(folder / "table.db")]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[1]
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().strip() == "ready"
            yield Pilot(process)
        finally:
            process.kill()


@contextmanager
def serving(role: str, data: Path) -> Generator[tuple[httpx.Client, Forked]]:
    """`hornbill serve` in a role, with a client of its API."""
    words = ("serve", "--bus", "socketcan:vcan0", "--role", role, "--port", "0", "--data-dir", str(data))
    with hornbill(*words) as server:
        found = re.search(r"http://\S+/", line(server))
        assert found is not None
        limits = httpx.Limits(max_keepalive_connections=0)
        with httpx.Client(base_url=found[0] + "api/v1", timeout=TIMEOUT_S, limits=limits) as api:
            yield api, server


@contextmanager
def listening(api: httpx.Client) -> Generator[Connection]:
    """A WebSocket that receives events."""
    with connect(str(api.base_url).replace("http", "ws") + "ws", open_timeout=TIMEOUT_S) as socket:
        socket.send(json.dumps({"type": "subscribe", "topics": ["events"]}))
        yield socket


def socket_event(socket: Connection, code: str) -> dict[str, Any]:
    """The next event of a code."""
    while True:
        message: dict[str, Any] = json.loads(socket.recv(timeout=TIMEOUT_S))
        if message["type"] == "event" and message["code"] == code:
            return message


def sources(log: Path) -> Counter[int]:
    """Frames by the node that sent them."""
    return Counter(int(one.can_id, 16) & 0x7F for one in can_utils.lines(log.read_text()))


def visit(api: httpx.Client) -> None:
    """Load what the page loads, and press Stop."""
    for path in PAGES:
        response = api.get(path)
        assert response.is_success, f"{path}: {response.text}"
    for each in api.get("/servos").json():
        api.get(f"/servos/{each['uid']}/parameters?refresh=true")
    api.post("/stop", json={"mode": "off"}).raise_for_status()
    api.delete("/stop").raise_for_status()


def observe(folder: Path, log: Path, seconds: float) -> Counter[int]:
    """Frames by sender while an observer is used, killed and started again, for about this time."""
    with can_utils.candump(log), hornbill("sim", "--bus", "socketcan:vcan0", "--servos", "3") as sim:
        for _ in range(3):
            line(sim)
        with piloting(folder) as pilot:
            pilot.tell("value 0.25", "safety off")
            end = time.monotonic() + seconds
            with serving("observer", folder / "data") as (api, server):
                until(lambda: [one for one in nodes(api).values() if one["commanded_by"]], "who commands")
                while time.monotonic() < end - seconds / 2:
                    visit(api)
                    time.sleep(0.5)
                server.send_signal(signal.SIGKILL)
                server.wait(timeout=TIMEOUT_S)
            with serving("observer", folder / "data") as (api, _):
                visit(api)
                while time.monotonic() < end:
                    visit(api)
                    time.sleep(0.5)
                bus = api.get("/bus").json()
                assert (bus["role"], bus["tx_frames"]) == ("observer", 0)
    return sources(log)


def nodes(api: httpx.Client) -> dict[int, dict[str, Any]]:
    return {each["node_id"]: each for each in api.get("/nodes").json()}


@pytest.fixture
def witness(vcan0: str) -> str:
    can_utils.needed()
    return vcan0


def test_an_observer_sends_no_frame(witness: str, tmp_path: Path) -> None:
    assert witness
    counted = observe(tmp_path, tmp_path / "log", float(os.environ.get(OBSERVED_S, "4")))
    assert counted[OURS] == 0
    assert counted[AUTOPILOT] > 100, "candump received the others"


def test_a_guest_keeps_its_budget_and_shows_who_commands(witness: str, tmp_path: Path) -> None:
    log = tmp_path / "log"
    with (
        can_utils.candump(log),
        hornbill("sim", "--bus", witness, "--servos", "2", "--node-id", "20") as sim,
        hornbill("sim", "--bus", witness, "--servos", "1", "--node-id", "none", "--seed", "9") as requesting,
        piloting(tmp_path) as pilot,
    ):
        uid = line(sim).split()[0]
        line(sim)
        line(requesting)
        # a slow servo, so that its timeout ends a motion half-way
        with Peer(READING) as peer:
            heard = peer.listen(uavcan.protocol.NodeStatus)
            peer.run_until(lambda: 20 in {one.source for one in heard}, "the servo")
            peer.registers((20, write("0x45", 1)), (20, write("0x25", 1)), (20, write("0x3A", 5)))
        with serving("guest", tmp_path / "data") as (api, _), listening(api) as events:
            until(lambda: [one for one in api.get("/servos").json() if one["uid"] == uid and one["state"] == "ready"],
                  "the servo is ready")  # fmt: skip
            assert api.get("/bus").json()["allocator"]["state"] == "off"
            pilot.tell("value 0", "safety off")
            lease = api.post("/leases", json={"holder": "test", "ttl_s": 60}).json()["id"]
            began = socket_event(events, "commanded_elsewhere")
            refused = api.post(
                f"/servos/{uid}/command", json={"type": "angle", "value": 5}, headers={"Lease": lease}
            )  # fmt: skip
            assert (refused.status_code, refused.json()["code"]) == (409, "commanded_elsewhere")
            assert refused.json()["node_id"] == AUTOPILOT
            (by,) = api.get(f"/servos/{uid}").json()["commanded_by"]
            since = by["since"]
            rates = [measured(api, pilot, uid, rate_hz) for rate_hz in (50, 200, 400)]
            pilot.tell("rate 50", "value 0.0")
            time.sleep(1.5)
            pilot.tell("value 0.9")
            time.sleep(0.5)
            pilot.tell("safety on")
            socket_event(events, "command_lost")
            until(lambda: api.get(f"/servos/{uid}").json()["output"]["reason"] == "timeout", "the output is off")
            with Peer(READING) as peer:
                stopped = [one.value for one in peer.registers((20, read("0x09")), (20, read("0x08")))]
        assert stopped[0] == 0
        assert isinstance(stopped[1], int)
        assert stopped[1] < 1500, "the horn stopped before its target of 162°: its output is off"
    frames = can_utils.lines(log.read_text())
    first = next(one.at for one in frames if one.can_id.endswith(f"03F2{AUTOPILOT:02X}"))
    assert abs(since - first) <= 1 / 50, "the first command on the bus"
    assert began["at"] - first <= LATE_S
    assert not [one for one in frames if int(one.can_id, 16) & 0x00FF_FFFF == ALLOCATION << 8 | OURS]
    seconds = Counter(int(one.at) for one in frames if _ours(int(one.can_id, 16)))
    assert max(seconds.values()) <= BUDGET_FPS * 1.1, "its requests and their responses, in any second"
    assert statistics.mean(seconds.values()) <= BUDGET_FPS
    commands = [one.at for one in frames if one.can_id.endswith(f"03F2{AUTOPILOT:02X}")]
    for shown in rates:
        ratios = [found / sent_hz(commands, at) for at, found in shown]
        assert statistics.median(ratios) == pytest.approx(1, abs=0.02)


def sent_hz(commands: list[float], at: float) -> float:
    """The rate of the last 100 commands before a time, by the clock of the kernel."""
    last = [one for one in commands if one <= at][-101:]
    return (len(last) - 1) / (last[-1] - last[0])


def measured(api: httpx.Client, pilot: Pilot, uid: str, rate_hz: int) -> list[tuple[float, float]]:
    """Times and rates shown while the autopilot commands at this rate, and a check of the angle."""
    value = rate_hz / 4000
    pilot.tell(f"rate {rate_hz}", f"value {value}")
    time.sleep(100 / rate_hz + 0.5)
    shown: list[tuple[float, float]] = []
    command_deg = 0.0
    for _ in range(9):
        (by,) = until(lambda: api.get(f"/servos/{uid}").json()["commanded_by"], "commands")
        command_deg = by["command_deg"]
        assert (by["node_id"], by["type"]) == (AUTOPILOT, "unitless")
        assert by["command_deg"] == pytest.approx(value * 180, abs=0.05)
        if by["rate_hz"] is not None:
            shown.append((time.time() - by["age_s"], by["rate_hz"]))
        time.sleep(0.1)
    with Peer(READING) as peer:
        (held,) = peer.registers((20, read("0x00")))
    assert isinstance(held.value, int)
    assert command_deg == pytest.approx(held.value / 10, abs=0.05)
    return shown


def _ours(can_id: int) -> bool:
    """Whether a frame is sent by us, or is a response to us."""
    return can_id & 0x7F == OURS or (can_id & 0x80 != 0 and can_id >> 8 & 0x7F == OURS)
