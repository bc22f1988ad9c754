"""Owns Replaying: the servos of a bundle, as they were and as its frames go on to tell, without asking anybody."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from hornbill.schema.catalog import Catalog
from hornbill.servo.asking import Asker
from hornbill.servo.bundle import BundleServo, read_about
from hornbill.servo.fleet import Fleet
from hornbill.servo.reading import LIVE_PERIOD_S
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase
from hornbill.units import NodeId, Uid
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import GetNodeInfoResponse, GetSetResponse
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import decode


@runtime_checkable
class Bundled(Protocol):
    """A port that plays a recording, and may know whose: about.json of its bundle."""

    about: bytes | None


class Replaying:
    """Follows the frames of one bundle. Servos are those of then, apart from the ones this host has met itself."""

    def __init__(self, fleet: Fleet, asker: Asker, base: TimeBase, servos: Sequence[Servo]) -> None:
        """`servos` are shown until the fleet leaves this bus."""
        self._fleet = fleet
        self._asker = asker
        self._base = base
        self._reassembler = Reassembler()
        fleet.show_recorded(servos)

    @classmethod
    def of(cls, about: bytes, fleet: Fleet, asker: Asker, base: TimeBase) -> "Replaying":
        """The servos that about.json tells of. Raises LogFailed."""
        told = read_about(about, "The recording").servos
        return cls(fleet, asker, base, [servo_of(one, fleet.catalog, base) for one in told])

    def hear(self, frames: Sequence[Frame], _sent: bool) -> None:
        """Answers to questions of then say what registers held then."""
        for transfer in self._reassembler.feed(frames):
            if transfer.kind is Kind.RESPONSE:
                self._answered(transfer)

    def _answered(self, transfer: Transfer) -> None:
        match decode(transfer):
            case GetSetResponse() as answer:
                servo = self._fleet.recorded_on(transfer.source)
                if servo is not None:
                    self._asker.overhear(servo, answer)
            case GetNodeInfoResponse(hardware_version=hardware):
                self._fleet.recorded_moved(Uid(hardware.unique_id.hex()), NodeId(transfer.source))
            case _:
                return


def servo_of(told: BundleServo, catalog: Catalog, base: TimeBase) -> Servo:
    """A servo as a bundle tells of it, not heard yet.

    Readings that change by themselves are those of the moment the bundle was written for; they are left to the
    frames, which begin before it.
    """
    servo = Servo(Uid(told.uid), catalog, name=told.name, label=told.label, model_number=told.model_number or 0)
    servo.recorded = True
    servo.node_id = None if told.node_id is None else NodeId(told.node_id)
    servo.hardware_version, servo.serial_number = told.hardware_version, told.serial_number
    servo.production_date = told.production_date
    known = told.model_number is not None and told.hardware_version is not None
    model = catalog.model(told.model_number or 0, told.hardware_version or 0) if known else None
    servo.identify_as(model, told.firmware)
    for key, register in servo.registers.items():
        kept = told.readings.get(key)
        if kept is not None and register.parameter.group not in LIVE_PERIOD_S:
            servo.note(key, kept.raw, base.now())
        register.rom = told.rom.get(key)
    return servo
