"""Owns Client: the REST API of a running server for the command line, with problems as exceptions."""

import time
from types import TracebackType
from typing import Any, Self

import httpx

STOP_S = 1.0
"""How long `stop` waits for the last servo; the server goes on after it."""


class Problem(Exception):
    """What the server answered instead: its code, and a sentence for people."""

    def __init__(self, code: str, detail: str, status: int) -> None:
        super().__init__(detail)
        self.code = code
        self.detail = detail
        self.status = status


class Client:
    """Calls one server. Every method raises Problem; `no_server` when nobody answers at its address."""

    def __init__(self, server: str) -> None:
        """`server` is its address, for example http://127.0.0.1:8000."""
        self._http = httpx.Client(base_url=server.rstrip("/") + "/api/v1", timeout=60.0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._http.close()

    def ask(self, verb: str, path: str, body: object = None, **query: str) -> Any:
        """One request; answers the decoded JSON."""
        try:
            response = self._http.request(verb, path, json=body, params=query)
        except httpx.TransportError as error:
            raise Problem(
                "no_server",
                f"No hornbill server answers at {self._http.base_url}: {error}. "
                "Start one with 'hornbill demo' or 'hornbill serve'.",
                0,
            ) from None
        if response.is_error:
            found: dict[str, Any] = response.json() if "json" in response.headers.get("content-type", "") else {}
            raise Problem(found.get("code", "internal"), found.get("detail", response.text[:200]), response.status_code)
        return response.json()

    def stop(self, mode: str) -> dict[str, Any]:
        """Stop every servo, `mode` off or brake; the state of the stop when all have confirmed, or after 1 s."""
        until = time.monotonic() + STOP_S
        state: dict[str, Any] = self.ask("POST", "/stop", {"mode": mode, "reason": ""}, by="command line")
        while unconfirmed(state) and time.monotonic() < until:
            time.sleep(0.05)
            found: dict[str, Any] = self.ask("GET", "/stop")
            if not found["latched"]:  # somebody cleared it meanwhile
                break
            state = found
        return state

    def servo(self, which: str) -> dict[str, Any]:
        """The one servo with this uid (or the start of it), label or serial; a Problem unless just one fits."""
        servos: list[dict[str, Any]] = self.ask("GET", "/servos")
        found = [
            one for one in servos if one["uid"].startswith(which.lower()) or which in (one["label"], one["serial"])
        ]
        if len(found) == 1:
            return found[0]
        text = "No servo is" if not found else f"{len(found)} servos are"
        raise Problem("unknown_servo", f"{text} known as {which!r}. 'hornbill list' shows them.", 404)


def unconfirmed(state: dict[str, Any]) -> list[str]:
    """Who has not confirmed a stop: servos by what they are called, and nodes that may be servos."""
    names = [str(one["label"]) for one in state["servos"] if not one["confirmed"]]
    return names + [f"node {one['node_id']}" for one in state["nodes"] if not one["confirmed"]]
