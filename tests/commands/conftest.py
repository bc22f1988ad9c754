"""Shared by tests of commands: one server with simulated servos per process, put back after each test."""

from collections.abc import Iterator

import pytest

from commands.command_line import CommandLine
from e2e.servers import Server, as_in_rom, running

COUNT = 3


@pytest.fixture(scope="session")
def shared() -> Iterator[Server]:
    """A demo whose servos and records tests may change: what is in ROM, too."""
    with running("demo", "--servos", str(COUNT), "--seed", "3") as server:
        server.ready(COUNT)
        yield server


@pytest.fixture
def bench(shared: Server) -> Iterator[Server]:
    """The demo, ready, without stop, leases, or values of a previous test that differ from ROM."""
    shared.ready(COUNT)
    for one in shared.servos():
        as_in_rom(shared.api, str(one["uid"]))
    yield shared
    shared.api.delete("/stop").raise_for_status()
    for lease in shared.api.get("/leases").json():
        shared.api.delete(f"/leases/{lease['id']}")


@pytest.fixture
def command(bench: Server) -> CommandLine:
    """The command line with that demo."""
    return CommandLine(bench.url)


@pytest.fixture
def uids(bench: Server) -> list[str]:
    """Its servos with a normal load: one with a stored node ID, and one that requested it."""
    by_model = {one["model"]: str(one["uid"]) for one in bench.servos()}
    return [by_model["BLA21-06U-A0"], by_model["BLA15-06U-A0"]]


@pytest.fixture
def serials(bench: Server, uids: list[str]) -> list[str]:
    """Their serials."""
    return [bench.api.get(f"/servos/{uid}").json()["serial"] for uid in uids]


@pytest.fixture
def serial(serials: list[str]) -> str:
    """The serial of the first."""
    return serials[0]
