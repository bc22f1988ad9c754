"""The bus of `hornbill demo`: embedded by default, and never a real one."""

from typing import Any

import pytest
from typer.testing import CliRunner

from hornbill.bus.adapters import virtual
from hornbill.cli import app
from hornbill.cli.server import starting


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str | None, str]]:
    """The bus and the announcement of every started demo."""
    found: list[tuple[str | None, str]] = []

    def serve(settings: Any, *, demo: bool, announce: str) -> None:
        assert demo
        found.append((settings.bus, announce))

    monkeypatch.setattr(starting, "_serve", serve)
    monkeypatch.setattr(virtual, "find_vcan", lambda: ("socketcan:vcan7", "vcan7 is up"))
    return found


def test_it_is_embedded_by_default(started: list[tuple[str | None, str]]) -> None:
    for words in (["demo"], ["demo", "--bus", "embedded"]):
        assert CliRunner().invoke(app, words).exit_code == 0
    assert [(bus, announce.count("\n")) for bus, announce in started] == [(None, 0), (None, 0)]


def test_auto_uses_a_virtual_bus_if_there_is_one_and_prints_why(
    started: list[tuple[str | None, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert CliRunner().invoke(app, ["demo", "--bus", "auto"]).exit_code == 0
    monkeypatch.setattr(virtual, "find_vcan", lambda: (None, "there is none"))
    monkeypatch.setenv("HORNBILL_BUS", "auto")
    assert CliRunner().invoke(app, ["demo"]).exit_code == 0
    assert [(bus, announce.rpartition("\n")[2]) for bus, announce in started] == [
        ("socketcan:vcan7", "bus: socketcan:vcan7, because vcan7 is up"),
        (None, "bus: embedded, because there is none"),
    ]


@pytest.mark.parametrize("address", ["socketcan:can0", "slcan:/dev/ttyACM0"])
def test_simulated_servos_never_use_an_adapter(
    started: list[tuple[str | None, str]], monkeypatch: pytest.MonkeyPatch, address: str
) -> None:
    monkeypatch.setenv("HORNBILL_BUS", address)
    assert CliRunner().invoke(app, ["demo"]).exit_code == 0
    assert started[0][0] is None, "HORNBILL_BUS is for hornbill serve"
    assert CliRunner().invoke(app, ["demo", "--bus", address]).exit_code == 2


@pytest.mark.parametrize("speed", ["0.5", "100", "max"])
def test_virtual_time_needs_the_embedded_bus(started: list[tuple[str | None, str]], speed: str) -> None:
    assert CliRunner().invoke(app, ["demo", "--speed", speed]).exit_code == 0
    refused = CliRunner().invoke(app, ["demo", "--bus", "auto", "--speed", speed])
    assert refused.exit_code != 0
    assert "socketcan:vcan7 cannot be used with --speed" in refused.stderr
    assert [bus for bus, _ in started] == [None]


@pytest.mark.parametrize(("speed", "text"), [("fast", "not a speed"), ("0", "outside"), ("-1", "outside"),
                                             ("nan", "outside"), ("1001", "outside")])  # fmt: skip
def test_an_impossible_speed_is_refused(started: list[tuple[str | None, str]], speed: str, text: str) -> None:
    refused = CliRunner().invoke(app, ["demo", "--speed", speed])
    assert refused.exit_code == 2
    assert text in refused.stderr
    assert started == []
