"""Description of a transfer in one sentence, with names, units and choices from the parameter tables."""

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from hornbill.schema.catalog import Catalog
from hornbill.schema.fault import bits_of
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import to_text, with_unit
from hornbill.servo.device.servo import Servo
from hornbill.units import Raw
from hornbill.wire.datatype import Kind
from hornbill.wire.describe import Names, plain_number, printable, sentence
from hornbill.wire.messages import DEGREES_PER_UNITLESS, ActuatorCommand, CommandType
from hornbill.wire.services import GetSetRequest, GetSetResponse, Value, ValueKind
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import AnyStructure, decode

_REGISTER: Final = re.compile(r"0x[0-9A-Fa-f]{2}", re.ASCII)
_MAX_OPEN: Final = 1024
"""Limit of requests without a response yet. Beyond it, the oldest are dropped."""


@dataclass(frozen=True, slots=True)
class MatchedRequest:
    """Request of a response, and the response time, s."""

    request: Transfer
    took_s: float


class TableNames(Names):
    """Names from the catalogue, and from the servos known to the host."""

    def __init__(self, catalog: Catalog, servos: Callable[[], Iterable[Servo]]) -> None:
        self._catalog = catalog
        self._servos = servos
        self._bits = {
            (bit.parameter, bit.bit): bit.label for table in (catalog.overview, catalog.faults) for bit in table
        }

    def register(self, node: int, name: str) -> str:
        """The key of the row, "current_angle"."""
        row = self._row(name)
        return "" if row is None else row.key

    def value(self, node: int, name: str, raw: Raw) -> str:
        """As shown on the page: "60.0°", "Off", "inactive"; for a fault register, its set bits."""
        row = self._row(name)
        if row is None:
            return ""
        if row.kind == "bits":
            set_bits = sorted(bits_of(raw))
            return ", ".join(self._bits.get((row.key, bit), f"bit {bit}") for bit in set_bits) or "no fault"
        values: dict[str, Raw | None] = {}
        if row.unit_when is not None and (servo := self._on(node)) is not None:
            values = {row.unit_when.parameter: servo.raw(row.unit_when.parameter)}
        return to_text(row, raw, values)

    def position(self, node: int, position: float) -> str:
        """In degrees for a servo whose position unit is known."""
        servo = self._on(node)
        angle = None if servo is None or not math.isfinite(position) else servo.position_unit.shown(position)
        return super().position(node, position) if angle is None else _degrees(angle)

    def command(self, command: ActuatorCommand) -> str:
        """In the units of table 2-21 for a known servo."""
        value, kind = command.command_value, command.command_type
        servo = next((servo for servo in self._servos() if servo.servo_id == command.actuator_id), None)
        if servo is None or not math.isfinite(value):
            return super().command(command)
        match kind:
            case CommandType.UNITLESS:
                return f"to {_degrees(value * DEGREES_PER_UNITLESS)}"
            case CommandType.POSITION:
                angle = servo.position_unit.shown(value)
                return super().command(command) if angle is None else f"to {_degrees(angle)}"
            case CommandType.FORCE:
                return f"torque {with_unit(plain_number(value), self._catalog.by_key['command_torque'].unit)}"
            case CommandType.SPEED:
                return f"speed {with_unit(plain_number(value), self._catalog.by_key['command_speed'].unit)}"
            case _:
                return super().command(command)

    def _row(self, name: str) -> Parameter | None:
        return self._catalog.by_address.get(int(name, 16)) if _REGISTER.fullmatch(name) else None

    def _on(self, node: int) -> Servo | None:
        return next((servo for servo in self._servos() if servo.node_id == node), None)


class TransferText:
    """Describes transfers in order, and matches responses with their requests."""

    def __init__(self, catalog: Catalog, servos: Callable[[], Iterable[Servo]] = tuple) -> None:
        """`servos` returns the servos known to the host; none for a file."""
        self._names = TableNames(catalog, servos)
        self._open: dict[tuple[int, int, int, int], Transfer] = {}

    def follow(self, transfer: Transfer) -> MatchedRequest | None:
        """Process the next transfer, in bus order. For a response, returns its request."""
        kind, type_id, source, destination, _, transfer_id, _, at = transfer
        if kind is Kind.REQUEST:
            key = (destination, source, type_id, transfer_id)
            self._open.pop(key, None)  # re-insert it as the newest
            if len(self._open) >= _MAX_OPEN:
                del self._open[next(iter(self._open))]
            self._open[key] = transfer
        elif kind is Kind.RESPONSE:
            request = self._open.pop((source, destination, type_id, transfer_id), None)
            if request is not None:
                return MatchedRequest(request, at - request.at)
        return None

    def describe(
        self, transfer: Transfer, structure: AnyStructure | None, matched: MatchedRequest | None = None
    ) -> str:
        """Description; for a response, also whether the value is as requested, and the response time. Never raises."""
        text = sentence(transfer, structure, self._names)
        if matched is None:
            return text
        request = decode(matched.request)
        if isinstance(request, GetSetRequest) and isinstance(structure, GetSetResponse):
            text += _compared(request.value, structure.value)
        return f"{text}. {matched.took_s * 1000:.1f} ms"


def _compared(wanted: Value, held: Value) -> str:
    """Result of a write: the servo may have set another value than requested."""
    if ValueKind.EMPTY in (wanted.kind, held.kind):
        return ""
    return ", as requested" if wanted == held else f", requested {printable(str(wanted.value))}".replace("-", "−")


def _degrees(value: float) -> str:
    return with_unit(f"{round(value, 1) + 0.0:.1f}".replace("-", "−"), "°")  # + 0.0: no "−0.0"
