"""Conditions of a run, recorded by every procedure: identity, supply, all stored rows, and limits that were reached."""

from dataclasses import asdict
from typing import Final, cast

from hornbill.domain.note import Note
from hornbill.domain.set_up import SetUp
from hornbill.errors import HornbillError
from hornbill.schema.scale import Value
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.reading import readings
from hornbill.servo.device.requests import POLL, ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.servos import StoredServo
from hornbill.store.tables import Json

MEASURED: Final = ("current_voltage", "current_temperature")


async def record(
    requests: ServoRequests, base: TimeBase, servo: Servo, set_up: SetUp, procedure: str
) -> dict[str, Json]:
    """Conditions as the beginning of a run's document. Raises Refused, NoResponse, BusDisconnected."""
    unknown = [key for key, one in servo.registers.items() if one.parameter.rom and one.at is None]
    await read_rows(requests, servo, [*unknown, *(key for key in MEASURED if key in servo.registers)])
    shown = readings(servo, base)
    stored: dict[str, Value] = {key: one.value for key, one in shown.items() if servo.registers[key].parameter.rom}
    return {
        "procedure": procedure,
        "set_up": stated(set_up),
        "model": None if servo.model is None else servo.model.name,
        "firmware": servo.firmware_text,
        "voltage_v": shown["current_voltage"].value,
        "nominal_v": None if servo.model is None else servo.model.nominal_v,
        "temperature_c": shown["current_temperature"].value,
        "parameters": cast("dict[str, Json]", stored),
    }


async def warnings(requests: ServoRequests, servo: Servo) -> Json:
    """Warnings after a run, as stored: smoothing, and limits of the servo that were reached."""
    return cast("Json", [asdict(one) for one in await _warnings(requests, servo)])


async def _warnings(requests: ServoRequests, servo: Servo) -> list[Note]:
    found: list[Note] = []
    if servo.raw("smoothing") == 1:
        text = "Smoothing (0x22) is on: the test measures the smoothing (section 4.15)."
        found.append(Note(text, "smoothing_on"))
    try:
        bits = await requests.read(servo, servo.registers["fault_notification"].parameter, POLL)
    except HornbillError:
        text = "The notifications could not be read, so it is unknown whether a limit was reached."
        return [*found, Note(text, "limit_unknown")]
    rows = [
        bit.limit
        for bit in servo.catalog.faults_of(pwm=False)
        if bit.level == "notification" and bit.limit and bits & bit.mask
    ]
    if rows:
        text = "A limit of the servo was reached: the metrics are those of the limit, not of the loop."
        found.append(Note(text, "limit_reached", {"keys": [*rows]}))
    return found


def stated(set_up: SetUp) -> dict[str, Json]:
    """The stated values of a set-up, as stored."""
    return cast("dict[str, Json]", set_up.model_dump(exclude_none=True))


def set_up_of(stored: StoredServo | None) -> SetUp:
    """Stored set-up of a servo."""
    return SetUp() if stored is None else SetUp.model_validate(stored.set_up)
