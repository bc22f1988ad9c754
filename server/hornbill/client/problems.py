"""Mapping of problems to the exceptions of hornbill.errors."""

from collections.abc import Iterator, Mapping
from typing import Any

from hornbill import errors
from hornbill.errors import HornbillError

MEMBERS = frozenset(("type", "title", "status", "code", "detail", "summary", "params"))
"""Members of every problem; all others are facts."""


class ServerUnreachable(HornbillError):
    """The server does not respond, or the connection was lost before its response.

    If the fact `sent` is true, it is unknown whether the request was carried out.
    """

    code = "server_unreachable"
    title = "Server unreachable"


class WaitTimeout(HornbillError):
    """The awaited event did not occur within the timeout. It may still occur."""

    code = "wait_timeout"
    title = "Timeout"


def raised(status: int, body: Mapping[str, Any]) -> HornbillError:
    """Exception for a problem with this HTTP status, with its code, facts and status.

    A code unknown to this version becomes a HornbillError, for compatibility with newer servers.
    """
    code = str(body.get("code", "internal"))
    detail = str(body.get("detail", "")) or f"The server responded with status {status} and no details."
    facts = {"cause": None, **{key: value for key, value in body.items() if key not in MEMBERS}}
    kind = _BY_CODE.get(code)
    if kind is not None:
        error = kind(detail, **facts)
    elif code.startswith("unknown_") or status == 404:
        error = errors.Unknown(code, detail, **facts)
    else:
        error = HornbillError(detail, **facts)
        error.code = code
    error.status = status
    error.summary = str(body.get("summary") or detail)
    return error


def _kinds(root: type[HornbillError]) -> Iterator[type[HornbillError]]:
    for child in root.__subclasses__():
        if child.__module__ == errors.__name__:
            yield child
            yield from _kinds(child)


_BY_CODE = {kind.code: kind for kind in _kinds(HornbillError) if kind.code != HornbillError.code}
