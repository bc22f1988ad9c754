"""The tests of the bus `hornbill demo` puts its servos on: embedded unless told, and never a real one."""

from typing import Any

import pytest
from typer.testing import CliRunner

from hornbill.bus.adapters import virtual
from hornbill.cli import app
from hornbill.cli.server import starting


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str | None, str]]:
    """The bus and the announcement of every demo that would have been served."""
    found: list[tuple[str | None, str]] = []

    def serve(settings: Any, *, demo: bool, announce: str) -> None:
        assert demo
        found.append((settings.bus, announce))

    monkeypatch.setattr(starting, "_serve", serve)
    monkeypatch.setattr(virtual, "find_vcan", lambda: ("socketcan:vcan7", "vcan7 is up"))
    return found


def test_it_is_the_embedded_one_unless_told(started: list[tuple[str | None, str]]) -> None:
    for words in (["demo"], ["demo", "--bus", "embedded"]):
        assert CliRunner().invoke(app, words).exit_code == 0
    assert [(bus, announce.count("\n")) for bus, announce in started] == [(None, 0), (None, 0)]


def test_auto_takes_a_virtual_one_and_says_why(started: list[tuple[str | None, str]]) -> None:
    assert CliRunner().invoke(app, ["demo", "--bus", "auto"]).exit_code == 0
    ((bus, announce),) = started
    assert bus == "socketcan:vcan7"
    assert announce.endswith("\nbus: socketcan:vcan7, because vcan7 is up")


def test_auto_says_why_it_took_the_embedded_one(
    started: list[tuple[str | None, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(virtual, "find_vcan", lambda: (None, "there is none"))
    monkeypatch.setenv("HORNBILL_BUS", "auto")
    assert CliRunner().invoke(app, ["demo"]).exit_code == 0
    ((bus, announce),) = started
    assert bus is None
    assert announce.endswith("\nbus: embedded, because there is none")


@pytest.mark.parametrize("address", ["socketcan:can0", "slcan:/dev/ttyACM0"])
def test_no_simulated_servo_gets_onto_an_adapter(
    started: list[tuple[str | None, str]], monkeypatch: pytest.MonkeyPatch, address: str
) -> None:
    monkeypatch.setenv("HORNBILL_BUS", address)
    assert CliRunner().invoke(app, ["demo"]).exit_code == 0
    assert started[0][0] is None, "HORNBILL_BUS names what 'hornbill serve' opens"
    assert CliRunner().invoke(app, ["demo", "--bus", address]).exit_code == 2
