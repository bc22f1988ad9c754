"""Forwarding headers of a reverse proxy; applied only if the server is configured for one."""

from starlette.types import Scope


def apply_forwarded(scope: Scope) -> None:
    """Replace client, scheme and host in `scope` by those that the proxy received.

    Of several values the last counts: our proxy added it, whereas clients can forge the others.
    """
    headers: list[tuple[bytes, bytes]] = scope["headers"]
    forwarded = {name: value for name, value in headers if name.startswith(b"x-forwarded-")}
    if client := _last(forwarded.get(b"x-forwarded-for")):
        scope["client"] = (client, 0)
    proto = _last(forwarded.get(b"x-forwarded-proto"))
    if proto in ("http", "https"):
        socket = scope["type"] == "websocket"
        scope["scheme"] = {"http": "ws", "https": "wss"}[proto] if socket else proto
    if host := _last(forwarded.get(b"x-forwarded-host")):
        scope["headers"] = [pair for pair in headers if pair[0] != b"host"] + [(b"host", host.encode("latin-1"))]


def _last(value: bytes | None) -> str:
    return "" if value is None else value.decode("latin-1").rpartition(",")[2].strip()
