"""Replaying: the servos of a recording, as they were and as its frames go on to tell, without asking anybody."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from hornbill.domain.recording import About, RecordedServo
from hornbill.schema.catalog import Catalog
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.reading import LIVE_PERIOD_S
from hornbill.servo.device.requests import ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import NodeId, Uid
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import GetNodeInfoResponse, GetSetResponse
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import decode


@runtime_checkable
class RecordedPort(Protocol):
    """A port that plays a recording, and may know what it is of."""

    about: About | None


class Replaying:
    """Follows the frames of one recording. Servos are those of then, apart from the ones this host has met itself."""

    def __init__(self, fleet: Fleet, requests: ServoRequests, base: TimeBase, servos: Sequence[Servo]) -> None:
        """`servos` are shown until the fleet leaves this bus."""
        self._fleet = fleet
        self._requests = requests
        self._base = base
        self._reassembler = Reassembler()
        fleet.show_recorded(servos)

    @classmethod
    def of(cls, about: About, fleet: Fleet, requests: ServoRequests, base: TimeBase) -> "Replaying":
        """The servos that the recording is of."""
        return cls(fleet, requests, base, [servo_of(one, fleet.catalog, base) for one in about.servos])

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
                    self._requests.observe_response(servo, answer)
            case GetNodeInfoResponse(hardware_version=hardware):
                self._fleet.recorded_moved(Uid(hardware.unique_id.hex()), NodeId(transfer.source))
            case _:
                return


def servo_of(told: RecordedServo, catalog: Catalog, base: TimeBase) -> Servo:
    """A servo as a recording tells of it, not heard yet.

    Readings that change by themselves are those of the moment the recording was written for; they are left to the
    frames, which begin before it.
    """
    servo = Servo(Uid(told.uid), catalog, name=told.name, label=told.label, model_number=told.model_number or 0)
    servo.recorded = True
    servo.node_id = None if told.node_id is None else NodeId(told.node_id)
    servo.hardware_version, servo.serial_number = told.hardware_version, told.serial_number
    servo.production_date = told.production_date
    servo.identify_as(catalog.treated_as(servo.model_number or 0, told.hardware_version), told.firmware)
    for key, register in servo.registers.items():
        kept = told.readings.get(key)
        if kept is not None and register.parameter.group not in LIVE_PERIOD_S:
            servo.note(key, kept.raw, base.now())
        register.rom = told.rom.get(key)
    return servo
