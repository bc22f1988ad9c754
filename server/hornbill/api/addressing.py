"""Addressing of servos in requests: unique ID, serial number or label. Responses always contain unique IDs.

The types are used in paths, queries and bodies. They resolve names during validation, with the host that the
dependency `TheHost` of the route has set before.
"""

import re
from collections.abc import Callable
from contextvars import ContextVar
from typing import Annotated, Any, Final

from pydantic import AfterValidator, Field, ValidatorFunctionWrapHandler, WrapValidator

from hornbill.errors import Conflict, Unknown
from hornbill.servo.host import Host
from hornbill.units import Uid

UNIQUE_ID: Final = re.compile(r"[0-9a-f]{32}")
_HOST: Final[ContextVar[Host]] = ContextVar("host")

NAMES: Final = "Unique ID (32 hex digits), serial number such as `61-466861`, or label"


def address_by(host: Host) -> None:
    """Resolve the names of the current request with this host."""
    _HOST.set(host)


def resolve(host: Host, name: str) -> Uid:
    """Unique ID of the servo with this unique ID, serial number or label.

    A unique ID need not be known. Servos seen since the start precede those that are only in the inventory. Raises
    Unknown(unknown_servo), and Conflict if several servos have this serial number or label.
    """
    if UNIQUE_ID.fullmatch(name):
        return Uid(name)
    found = {servo.uid for servo in host.fleet.all() if name in (servo.label, servo.serial)} if name else set[Uid]()
    if name and not found:
        found = {one.uid for one in host.store.servos.all() if name in (one.label, one.serial_text)}
    if len(found) > 1:
        raise Conflict(
            f"{len(found)} servos are known as {name[:64]!r}. Give the unique ID of one of them: "
            f"{', '.join(sorted(found))}.",
            cause="servo_ambiguous",
            name=name[:64],
            candidates=sorted(found),
        )
    if not found:
        raise servo_never_seen(name)
    return found.pop()


def servo_never_seen(name: str) -> Unknown:
    """Error for a servo that was never seen."""
    return Unknown(
        "unknown_servo",
        f"Unknown servo {name[:64]!r}: no servo with this unique ID, serial number or label was ever seen.",
        uid=name[:64],
        cause="servo_never_seen",
    )


def _resolved(name: str) -> Uid:
    return Uid(name) if UNIQUE_ID.fullmatch(name) else resolve(_HOST.get(), name)  # unique IDs need no host


def _if_known(name: str) -> str:
    try:
        return _resolved(name)
    except Unknown:
        return name


def _each(resolved: Callable[[str], str]) -> AfterValidator:
    return AfterValidator(lambda text: ",".join(resolved(name.strip()) for name in text.split(",") if name.strip()))


def _distinct(given: Any, validate: ValidatorFunctionWrapHandler) -> Any:
    found = validate(given)
    if len(found) < len(given):
        raise ValueError("a servo is given twice, under different names")
    return found


ServoText = Annotated[str, Field(min_length=1, max_length=64, description=f"{NAMES}.")]
"""A servo in a request, as given. Its user resolves it."""

ServoRef = Annotated[ServoText, AfterValidator(_resolved)]
"""A servo in a request. Its value is the unique ID."""

ServoName = Annotated[str, Field(min_length=1, max_length=64), AfterValidator(_if_known)]
"""The same; an unknown servo keeps its name, for operations that respond with a problem per servo."""

ServoRefs = Annotated[str, Field(min_length=1, max_length=65 * 250), _each(_resolved)]
"""Servos separated by commas."""

ServoNames = Annotated[str, Field(max_length=65 * 250), _each(_if_known)]
"""The same; unknown servos keep their names."""

Distinct: Final = WrapValidator(_distinct)
"""For objects by servo: refuses two names of one servo."""
