"""Requests, output and exit code of `hornbill stop`."""

import json
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

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


class Command(NamedTuple):
    """How a command ended, and the requests it sent."""

    code: int
    out: str
    err: str
    requests: list[tuple[str, str, object, dict[str, object]]]


@pytest.fixture
def stop(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Command]:
    """Runs `hornbill stop` with these flags; the server responds with each of these states in turn, and then with the
    last one. Waiting takes no time.
    """

    def run(*flags: str, states: Sequence[object]) -> Command:
        coming, now = list(states), iter(range(10_000))
        requests: list[tuple[str, str, object, dict[str, object]]] = []

        def request(
            _self: Connection, verb: str, path: str, body: object = None, keyed: bool = True, **query: object
        ) -> object:
            requests.append((verb, path, body, query))
            return coming.pop(0) if len(coming) > 1 else coming[0]

        def sleep(_seconds: float) -> None: ...

        monkeypatch.setattr(client_module, "time", SimpleNamespace(monotonic=lambda: next(now) / 10, sleep=sleep))
        monkeypatch.setattr(Connection, "request", request)
        result = CliRunner().invoke(app, ["stop", *flags])
        return Command(result.exit_code, result.stdout, result.stderr, requests)

    return run


Stop = Callable[..., Command]


def test_it_sends_one_request_and_prints_how_many_confirmed(stop: Stop) -> None:
    assert stop(states=[state(FRONT)]) == (
        0, "Stopped: 1 of 1 servos confirmed torque off.\n", "",
        [("POST", "/stop", {"mode": "off", "reason": ""}, {"by": "command line"})],
    )  # fmt: skip


def test_a_servo_that_does_not_confirm_is_named_and_the_exit_code_is_1(stop: Stop) -> None:
    silent_node = {"node_id": 40, "confirmed": False, "ms": None}
    done = stop(states=[state(FRONT, SILENT, nodes=[silent_node])])
    assert (done.code, "1 of 3" in done.out) == (1, True)
    assert done.err.startswith("Not confirmed: rear, node 40. ")
    assert done.requests[-1][:2] == ("GET", "/stop")
    assert len(done.requests) > 3, "it checked again"


def test_a_late_confirmation_counts(stop: Stop) -> None:
    late = {**SILENT, "confirmed": True, "ms": 400.0}
    done = stop(states=[state(FRONT, SILENT), state(FRONT, SILENT), state(FRONT, late)])
    assert (done.code, done.out) == (0, "Stopped: 2 of 2 servos confirmed torque off.\n")
    assert len(done.requests) == 3


def test_brake_is_requested_with_its_flag(stop: Stop) -> None:
    done = stop("--brake", states=[state(FRONT, mode="brake")])
    assert (done.code, "torque brake" in done.out) == (0, True)
    assert done.requests[0][2] == {"mode": "brake", "reason": ""}


def test_clear_clears_without_stopping_and_excludes_brake(stop: Stop) -> None:
    done = stop("--clear", states=[state(mode=None)])
    assert (done.code, done.out) == (0, "Stop cleared. Torque stays off until it is turned on.\n")
    assert [one[:2] for one in done.requests] == [("DELETE", "/stop")]
    both = stop("--clear", "--brake", states=[state()])
    assert (both.code, both.requests) == (2, [])


def test_json_is_the_state_of_the_stop(stop: Stop) -> None:
    done = stop("--json", states=[state(FRONT, SILENT)])
    assert (done.code, json.loads(done.out)) == (1, state(FRONT, SILENT))
