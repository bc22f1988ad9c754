"""Who acts in what is being done now: the name of the token a request came with, for audit and leases."""

from contextvars import ContextVar
from typing import Final

SEPARATOR: Final = " · "
LONGEST: Final = 80
"""Characters of a name in the audit."""

_name: ContextVar[str | None] = ContextVar("hornbill_acting", default=None)


def act_as(name: str | None) -> None:
    """From here on, in this task and those it starts, `name` acts; None where nobody had to say who they are."""
    _name.set(name)


def acting() -> str | None:
    """The name of the token that acts, or None."""
    return _name.get()


def signed(said: str) -> str:
    """What somebody calls themselves, after the name that was proved: nobody can pass for somebody else.

    A page that knows its token's name says it itself; it is not said twice.
    """
    name = _name.get()
    if name is None or said == name or said.startswith(name + SEPARATOR):
        return said[:LONGEST]
    return f"{name}{SEPARATOR}{said}"[:LONGEST] if said else name
