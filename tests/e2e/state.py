"""State of a server under test, read over its API, and waiting for it."""

import time
from collections.abc import Callable
from itertools import cycle
from typing import Any, Protocol

import httpx

WAIT_S = 60
"""Time limit of everything a test waits for, also on a busy machine; speed is measured elsewhere."""
NODE_IDS = cycle(range(40, 100))
"""Node IDs of added servos: allocation takes a second."""


class Reachable(Protocol):
    """A server with a client."""

    @property
    def api(self) -> httpx.Client: ...


def wait_for(what: Callable[[], bool], message: str) -> None:
    """Wait until `what` is true."""
    until = time.monotonic() + WAIT_S
    while not what():
        assert time.monotonic() < until, message
        time.sleep(0.1)


def uids_of(server: Reachable) -> list[str]:
    """UIDs of all servos."""
    return [str(one["uid"]) for one in server.api.get("/servos").json()]


def servo_of(server: Reachable, model: str) -> str:
    """UID of the first servo of this model."""
    return next(str(one["uid"]) for one in server.api.get("/servos").json() if one["model"] == model)


def servo(server: Reachable, uid: str) -> dict[str, Any]:
    """A servo; without a state if it is unknown."""
    found = server.api.get(f"/servos/{uid}")
    return found.json() if found.is_success else {"state": None}


def ready(server: Reachable, *uids: str) -> None:
    """Wait until these servos are ready."""
    wait_for(lambda: all(servo(server, uid)["state"] == "ready" for uid in uids), "a servo is not ready")


def add(server: Reachable, number: int = 1, **body: Any) -> list[str]:
    """Add ready servos of one model with firmware 1.300. Returns their UIDs."""
    bodies = [{"model": "BLA21-06U-A0", "firmware": "1.300", "node_id": next(NODE_IDS), **body} for _ in range(number)]
    made = [str(server.api.post("/sim/servos", json=one).raise_for_status().json()["uid"]) for one in bodies]
    ready(server, *made)
    return made


def sim(server: Reachable, uid: str, **change: Any) -> None:
    """Change a simulated servo."""
    server.api.patch(f"/sim/servos/{uid}", json=change).raise_for_status()


def rows_of(server: Reachable, uid: str) -> dict[str, dict[str, Any]]:
    """The last known readings of all rows: value, rom, default."""
    return server.api.get(f"/servos/{uid}/parameters").json()["parameters"]


def row(server: Reachable, uid: str, key: str) -> dict[str, Any]:
    """The last known reading of a row."""
    return rows_of(server, uid)[key]


def read(server: Reachable, uid: str, key: str) -> Any:
    """Value of a row, read now."""
    return server.api.get(f"/servos/{uid}/parameters/{key}").json()["value"]


def write(server: Reachable, uid: str, key: str, value: Any, **more: Any) -> None:
    """Write a row to RAM."""
    server.api.put(f"/servos/{uid}/parameters/{key}", json={"value": value, **more}).raise_for_status()


def turn(server: Reachable, uid: str, degrees: float) -> None:
    """Turn a horn manually, with its torque off."""
    server.api.post(f"/servos/{uid}/torque", json={"mode": "off"}).raise_for_status()
    sim(server, uid, external_angle_deg=degrees)
    wait_for(lambda: abs((servo(server, uid)["angle_deg"] or 0) - degrees) < 1, "the horn is not turned")


def no_lease(server: Reachable) -> None:
    """Wait until no client has motion control."""
    wait_for(lambda: server.api.get("/leases").json() == [], "motion control is not given back")


def torque_off(server: Reachable, *uids: str) -> None:
    """Wait until the torque of these servos is off."""
    wait_for(lambda: all(read(server, uid, "torque_mode") == "off" for uid in uids), "torque stays on")


def latched(server: Reachable) -> bool:
    """Whether the stop is latched."""
    return server.api.get("/stop").json()["latched"]
