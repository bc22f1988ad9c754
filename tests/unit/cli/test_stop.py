"""The tests of `hornbill stop`: what it asks the server for, what it prints, and its exit code."""

import json
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from hornbill.cli import app
from hornbill.client.sync import hornbill as client_module
from hornbill.client.sync.connection import Connection

FRONT = {"uid": "1" * 32, "label": "front", "confirmed": True, "ms": 3.1}
DEAF = {"uid": "2" * 32, "label": "rear", "confirmed": False, "ms": None}


def state(*servos: dict[str, Any], mode: str | None = "off", nodes: list[dict[str, Any]] | None = None) -> Any:
    return {
        "latched": mode is not None, "mode": mode, "at": 1.0, "by": "x", "reason": "", "servos": list(servos),
        "nodes": nodes or [],
    }  # fmt: skip


def _at_once(_seconds: float) -> None:
    """A sleep that takes no time."""


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str, object, dict[str, str]]]:
    """What the server was asked, and a clock on which nobody waits."""
    now = iter(range(10_000))
    clock = SimpleNamespace(monotonic=lambda: next(now) / 10, sleep=_at_once)
    monkeypatch.setattr(client_module, "time", clock)
    return []


def stop(answers: list[Any], asked: list[Any], monkeypatch: pytest.MonkeyPatch, *flags: str) -> tuple[int, str, str]:
    coming: Iterator[Any] = iter(answers)
    last: list[Any] = [None]

    def ask(
        _self: Connection, verb: str, path: str, body: object = None, keyed: bool = True, **query: object
    ) -> object:
        asked.append((verb, path, body, query))
        last[0] = next(coming, last[0])
        return last[0]

    monkeypatch.setattr(Connection, "request", ask)
    result = CliRunner().invoke(app, ["stop", *flags])
    return result.exit_code, result.stdout, result.stderr


def test_it_stops_with_one_request_and_says_how_many_confirmed(
    asked: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    code, out, err = stop([state(FRONT)], asked, monkeypatch)
    assert (code, out, err) == (0, "Stopped: 1 of 1 servos confirmed torque off.\n", "")
    assert asked == [("POST", "/stop", {"mode": "off", "reason": ""}, {"by": "command line"})]


def test_a_servo_that_does_not_confirm_within_a_second_is_named_and_the_exit_code_is_1(
    asked: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    deaf_node = {"node_id": 40, "confirmed": False, "ms": None}
    code, out, err = stop([state(FRONT, DEAF, nodes=[deaf_node])], asked, monkeypatch)
    assert code == 1
    assert "1 of 3" in out
    assert err.startswith("Not confirmed: rear, node 40. ")
    assert asked[-1][:2] == ("GET", "/stop")
    assert len(asked) > 3, "it looked again"


def test_a_servo_that_confirms_a_little_later_counts(asked: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    late = {**DEAF, "confirmed": True, "ms": 400.0}
    code, out, _ = stop([state(FRONT, DEAF), state(FRONT, DEAF), state(FRONT, late)], asked, monkeypatch)
    assert (code, out) == (0, "Stopped: 2 of 2 servos confirmed torque off.\n")
    assert len(asked) == 3


def test_brake_is_asked_for_by_its_flag(asked: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    code, out, _ = stop([state(FRONT, mode="brake")], asked, monkeypatch, "--brake")
    assert code == 0
    assert "torque brake" in out
    assert asked[0][2] == {"mode": "brake", "reason": ""}


def test_clear_clears_and_stops_nothing(asked: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    code, out, _ = stop([state(mode=None)], asked, monkeypatch, "--clear")
    assert (code, out) == (0, "Stop cleared. Torque stays off until it is turned on.\n")
    assert [one[:2] for one in asked] == [("DELETE", "/stop")]


def test_clear_and_brake_together_do_neither(asked: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    assert stop([state()], asked, monkeypatch, "--clear", "--brake")[0] == 2
    assert asked == []


def test_json_is_the_state_of_the_stop_with_the_same_exit_code(
    asked: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    code, out, _ = stop([state(FRONT, DEAF)], asked, monkeypatch, "--json")
    assert code == 1
    assert json.loads(out) == state(FRONT, DEAF)
