"""Copy of the known state of all servos and the bus at one instant. Cheap to take; converted to values later."""

from collections.abc import Iterable
from dataclasses import dataclass

from hornbill.domain.recording import RecordedCommander, RecordedReading, RecordedServo
from hornbill.schema import scale
from hornbill.schema.parameter import Parameter
from hornbill.servo.device.servo import Servo
from hornbill.servo.monitoring.commanders import Commanders
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Raw, Uid


@dataclass(frozen=True, slots=True)
class ServoCopy:
    """State of one servo. `rows`: parameter, last RAM value, its time, and known ROM value.

    `commanded_by`: node ID, angle in ° and rate in Hz of the commands of other nodes.
    """

    uid: Uid
    node_id: int | None
    name: str
    label: str
    title: str
    model_number: int | None
    hardware_version: int | None
    firmware: int | None
    serial_number: int | None
    production_date: str | None
    state: str
    rows: tuple[tuple[Parameter, Raw | None, Instant | None, Raw | None], ...]
    commanded_by: tuple[tuple[int, float | None, float | None], ...] = ()

    @classmethod
    def of(cls, servo: Servo, commanders: Commanders) -> "ServoCopy":
        """Copy the current state of a servo."""
        return cls(
            servo.uid, servo.node_id, servo.name, servo.label, servo.title, servo.model_number,
            servo.hardware_version, servo.firmware, servo.serial_number, servo.production_date, servo.state.value,
            tuple((one.parameter, one.raw, one.at, one.rom) for one in servo.registers.values()),
            tuple((one.node_id, one.degrees, one.rate_hz) for one in commanders.of(servo.uid)),
        )  # fmt: skip

    def recorded(self, base: TimeBase) -> RecordedServo:
        """The entry of about.json, with engineering values."""
        raws = {row.key: raw for row, raw, _, _ in self.rows}
        return RecordedServo(
            uid=self.uid, node_id=self.node_id, name=self.name[:120], label=self.label[:120], title=self.title[:120],
            model_number=self.model_number, hardware_version=self.hardware_version, firmware=self.firmware,
            serial_number=self.serial_number, production_date=self.production_date, state=self.state,
            commanded_by=[
                RecordedCommander(node_id=node, command_deg=deg, rate_hz=None if hz is None else round(hz, 1))
                for node, deg, hz in self.commanded_by
            ],
            readings={
                row.key: RecordedReading(
                    raw=raw, value=scale.to_value(row, raw, raws), unit=scale.unit_of(row, raws)[0],
                    at=None if at is None else base.utc(at),
                )
                for row, raw, at, _ in self.rows
                if raw is not None
            },
            rom={row.key: rom for row, _, _, rom in self.rows if rom is not None},
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class KnownState:
    """All servos seen, and address and bit rate of the bus. `bus` is None without a bus."""

    servos: tuple[ServoCopy, ...]
    bus: tuple[str, int] | None

    @classmethod
    def of(cls, servos: Iterable[Servo], commanders: Commanders, bus: tuple[str, int] | None) -> "KnownState":
        """Copy the current state."""
        return cls(tuple(ServoCopy.of(servo, commanders) for servo in servos), bus)

    def joined(self, later: "KnownState") -> "KnownState":
        """Add servos first seen in a later copy."""
        known = {servo.uid for servo in self.servos}
        return KnownState((*self.servos, *(servo for servo in later.servos if servo.uid not in known)), self.bus)

    def uids(self) -> dict[int, str]:
        """Unique ID of the servo on each node ID."""
        return {servo.node_id: servo.uid for servo in self.servos if servo.node_id is not None}
