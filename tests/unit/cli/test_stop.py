"""Requests, output and exit code of `hornbill stop`."""

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
SILENT = {"uid": "2" * 32, "label": "rear", "confirmed": False, "ms": None}


def state(*servos: dict[str, Any], mode: str | None = "off", nodes: list[dict[str, Any]] | None = None) -> Any:
    return {
        "latched": mode is not None, "mode": mode, "at": 1.0, "by": "x", "reason": "", "servos": list(servos),
        "nodes": nodes or [],
    }  # fmt: skip


def _no_sleep(_seconds: float) -> None:
    """Does not sleep."""


@pytest.fixture
def requests(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str, object, dict[str, str]]]:
    """The requests sent; waiting takes no time."""
    now = iter(range(10_000))
    clock = SimpleNamespace(monotonic=lambda: next(now) / 10, sleep=_no_sleep)
    monkeypatch.setattr(client_module, "time", clock)
    return []


def stop(
    responses: list[Any], requests: list[Any], monkeypatch: pytest.MonkeyPatch, *flags: str
) -> tuple[int, str, str]:
    coming: Iterator[Any] = iter(responses)
    last: list[Any] = [None]

    def request(
        _self: Connection, verb: str, path: str, body: object = None, keyed: bool = True, **query: object
    ) -> object:
        requests.append((verb, path, body, query))
        last[0] = next(coming, last[0])
        return last[0]

    monkeypatch.setattr(Connection, "request", request)
    result = CliRunner().invoke(app, ["stop", *flags])
    return result.exit_code, result.stdout, result.stderr


def test_it_sends_one_request_and_prints_how_many_confirmed(
    requests: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    code, out, err = stop([state(FRONT)], requests, monkeypatch)
    assert (code, out, err) == (0, "Stopped: 1 of 1 servos confirmed torque off.\n", "")
    assert requests == [("POST", "/stop", {"mode": "off", "reason": ""}, {"by": "command line"})]


def test_a_servo_that_does_not_confirm_is_named_and_the_exit_code_is_1(
    requests: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    silent_node = {"node_id": 40, "confirmed": False, "ms": None}
    code, out, err = stop([state(FRONT, SILENT, nodes=[silent_node])], requests, monkeypatch)
    assert code == 1
    assert "1 of 3" in out
    assert err.startswith("Not confirmed: rear, node 40. ")
    assert requests[-1][:2] == ("GET", "/stop")
    assert len(requests) > 3, "it checked again"


def test_a_late_confirmation_counts(requests: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    late = {**SILENT, "confirmed": True, "ms": 400.0}
    code, out, _ = stop([state(FRONT, SILENT), state(FRONT, SILENT), state(FRONT, late)], requests, monkeypatch)
    assert (code, out) == (0, "Stopped: 2 of 2 servos confirmed torque off.\n")
    assert len(requests) == 3


def test_brake_is_requested_with_its_flag(requests: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    code, out, _ = stop([state(FRONT, mode="brake")], requests, monkeypatch, "--brake")
    assert code == 0
    assert "torque brake" in out
    assert requests[0][2] == {"mode": "brake", "reason": ""}


def test_clear_clears_without_stopping(requests: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    code, out, _ = stop([state(mode=None)], requests, monkeypatch, "--clear")
    assert (code, out) == (0, "Stop cleared. Torque stays off until it is turned on.\n")
    assert [one[:2] for one in requests] == [("DELETE", "/stop")]


def test_clear_and_brake_exclude_each_other(requests: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    assert stop([state()], requests, monkeypatch, "--clear", "--brake")[0] == 2
    assert requests == []


def test_json_is_the_state_of_the_stop(requests: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    code, out, _ = stop([state(FRONT, SILENT)], requests, monkeypatch, "--json")
    assert code == 1
    assert json.loads(out) == state(FRONT, SILENT)
