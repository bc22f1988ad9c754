"""What a server's problem becomes in a program: the exception of hornbill.errors whose code it carries."""

from collections.abc import Iterator, Mapping
from typing import Any

from hornbill import errors
from hornbill.errors import HornbillError

MEMBERS = frozenset(("type", "title", "status", "code", "detail", "summary", "params"))
"""What every problem has; whatever else it says are facts."""


class NoServer(HornbillError):
    """Nobody answers at the server's address, or the connection broke before an answer came.

    With the fact `sent` true nobody knows whether the server did what was asked.
    """

    code = "no_server"
    title = "No server"


class TookTooLong(HornbillError):
    """What was waited for did not come about in the time given; it may still."""

    code = "took_too_long"
    title = "It took too long"


def raised(status: int, body: Mapping[str, Any]) -> HornbillError:
    """The exception for a problem of this HTTP status, with its code, facts and status.

    A code this version has no class for is a HornbillError, so that a newer server does no harm.
    """
    code = str(body.get("code", "internal"))
    detail = str(body.get("detail", "")) or f"The server answered with status {status} and no reason."
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
    return error


def _kinds(root: type[HornbillError]) -> Iterator[type[HornbillError]]:
    for child in root.__subclasses__():
        if child.__module__ == errors.__name__:
            yield child
            yield from _kinds(child)


_BY_CODE = {kind.code: kind for kind in _kinds(HornbillError) if kind.code != HornbillError.code}
