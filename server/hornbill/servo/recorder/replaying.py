"""Servos of a replayed recording: their recorded state, updated from its frames. Sends nothing."""

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
    """A port that replays a file. `about` describes a recording, and is None for a log."""

    about: About | None


class Replaying:
    """Updates the servos of one recording from its frames. They are separate from servos that this host has seen."""

    def __init__(self, fleet: Fleet, requests: ServoRequests, base: TimeBase, servos: Sequence[Servo]) -> None:
        """Show `servos` until the fleet leaves this bus."""
        self._fleet = fleet
        self._requests = requests
        self._base = base
        self._reassembler = Reassembler()
        fleet.show_recorded(servos)

    @classmethod
    def of(cls, about: About, fleet: Fleet, requests: ServoRequests, base: TimeBase) -> "Replaying":
        """Show the servos described by `about`."""
        return cls(fleet, requests, base, [servo_of(one, fleet.catalog, base) for one in about.servos])

    def receive(self, frames: Sequence[Frame], _sent: bool) -> None:
        """Update registers from recorded responses."""
        for transfer in self._reassembler.feed(frames):
            if transfer.kind is Kind.RESPONSE:
                self._on_response(transfer)

    def _on_response(self, transfer: Transfer) -> None:
        match decode(transfer):
            case GetSetResponse() as response:
                servo = self._fleet.recorded_on(transfer.source)
                if servo is not None:
                    self._requests.observe_response(servo, response)
            case GetNodeInfoResponse(hardware_version=hardware):
                self._fleet.recorded_moved(Uid(hardware.unique_id.hex()), NodeId(transfer.source))
            case _:
                return


def servo_of(one: RecordedServo, catalog: Catalog, base: TimeBase) -> Servo:
    """A servo from a recording, not yet seen in its frames.

    Live readings were taken at the trigger, but the frames begin before it, so live readings come from the frames.
    """
    servo = Servo(Uid(one.uid), catalog, name=one.name, label=one.label, model_number=one.model_number or 0)
    servo.recorded = True
    servo.node_id = None if one.node_id is None else NodeId(one.node_id)
    servo.hardware_version, servo.serial_number = one.hardware_version, one.serial_number
    servo.production_date = one.production_date
    servo.identify_as(catalog.treated_as(servo.model_number or 0, one.hardware_version), one.firmware)
    for key, register in servo.registers.items():
        reading = one.readings.get(key)
        if reading is not None and register.parameter.group not in LIVE_PERIOD_S:
            servo.note(key, reading.raw, base.now())
        register.rom = one.rom.get(key)
    return servo
