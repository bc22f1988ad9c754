"""Actor of the current task: the name of the token the request came with, for audit and leases."""

from contextvars import ContextVar
from typing import Final

SEPARATOR: Final = " · "
MAX_LENGTH: Final = 80
"""Length limit of a name in the audit, characters."""

_name: ContextVar[str | None] = ContextVar("hornbill_acting", default=None)


def act_as(name: str | None) -> None:
    """Set the actor for this task and the tasks it starts. None if no token is required."""
    _name.set(name)


def acting() -> str | None:
    """Token name of the current actor, or None."""
    return _name.get()


def signed(claimed: str) -> str:
    """The name a client claims, prefixed with its token name, so that no client can pose as another.

    A claimed name that already starts with the token name is not prefixed again.
    """
    name = _name.get()
    if name is None or claimed == name or claimed.startswith(name + SEPARATOR):
        return claimed[:MAX_LENGTH]
    return f"{name}{SEPARATOR}{claimed}"[:MAX_LENGTH] if claimed else name
