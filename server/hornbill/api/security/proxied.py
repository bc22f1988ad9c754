"""What a reverse proxy says of the request it passes on: believed only when the server was told of one."""

from starlette.types import Scope


def as_the_proxy_saw_it(scope: Scope) -> None:
    """Put client, scheme and host of the request at the proxy in the place of those of the proxy's own.

    Of several values the last counts: that is the one our proxy added, the others anybody could have sent.
    """
    headers: list[tuple[bytes, bytes]] = scope["headers"]
    told = {name: value for name, value in headers if name.startswith(b"x-forwarded-")}
    if client := _last(told.get(b"x-forwarded-for")):
        scope["client"] = (client, 0)
    proto = _last(told.get(b"x-forwarded-proto"))
    if proto in ("http", "https"):
        socket = scope["type"] == "websocket"
        scope["scheme"] = {"http": "ws", "https": "wss"}[proto] if socket else proto
    if host := _last(told.get(b"x-forwarded-host")):
        scope["headers"] = [pair for pair in headers if pair[0] != b"host"] + [(b"host", host.encode("latin-1"))]


def _last(value: bytes | None) -> str:
    return "" if value is None else value.decode("latin-1").rpartition(",")[2].strip()
