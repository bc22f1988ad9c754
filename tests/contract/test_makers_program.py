"""Requests of the maker's program, byte for byte, and the bytes of the servo's responses.

Every frame, with its transfer CRC, was computed manually, not by hornbill. The program is node 127, requests index 0
with a four-character name in capitals, at priority 30, and leaves 3 ms between the frames of a transfer. It recognizes
a response with a value by the tag 1 in its first byte, an int64 after it, three empty values, and the name in capitals
from the 13th byte.
"""

import pytest

from hornbill.sim.behaviour import Behaviour
from hornbill.wire.frame import Frame
from unit.sim.desk import Desk

GAP_S = 0.003
TO_SERVO, FROM_SERVO = 0x1E0BAAFF, 0x1E0B7FAA
"""GetSet (11) from node 127 to node 42 and back, at priority 30."""

READS = {
    "0x2C reads 40": ("000030783243c5", ["6002012800000085", "0000000000000025", "3078324345"]),
    "0x52 reads 1300": ("000030783532c7", ["ec1c011405000087", "0000000000000027", "3078353247"]),
    "0x34 without the input reads 0": ("000030783334c8", ["7085010000000088", "0000000000000028", "3078333448"]),
    "0x39 reads -900": ("000030783339c9", ["fbc4017cfcffff89", "ffffffff00000029", "3078333949"]),
}
WRITE_45_INTO_0X2C = ["5f2f00012d000086", "0000000000307826", "324346"]
WRITE_RESPONSE = ["2e37012d00000086", "0000000000000026", "3078324346"]


def responses(desk: Desk, identifier: int, *frames: str) -> list[Frame]:
    """The frames that the servo sends in response to these frames, 3 ms apart; without its broadcasts."""
    sent: list[Frame] = []
    for data in frames:
        desk.wait(GAP_S)
        desk.servo.on_frames([Frame(identifier, bytes.fromhex(data), desk.now)], desk.now)
        sent += desk.servo.take_outbox()
    return sent


def servo(**rom: int) -> Desk:
    return Desk(rom={"soft_start": 0, "timeout_action": 0, "angle_limit_ccw": -900} | rom)


@pytest.mark.states("B09", "B11", "B12")
@pytest.mark.parametrize("read", READS)
def test_a_read(read: str) -> None:
    request, expected = READS[read]
    sent = responses(servo(), TO_SERVO, request)
    assert [frame.id for frame in sent] == [FROM_SERVO] * 3
    assert [frame.data.hex() for frame in sent] == expected


@pytest.mark.states("B09", "B11", "B12")
def test_a_write_of_three_frames_3_ms_apart() -> None:
    desk = servo()
    sent = responses(desk, TO_SERVO, *WRITE_45_INTO_0X2C)
    assert [frame.data.hex() for frame in sent] == WRITE_RESPONSE
    assert {frame.id for frame in sent} == {FROM_SERVO}
    assert desk.servo.register(0x2C) == 45


@pytest.mark.states("B12")
@pytest.mark.parametrize("at", [0x00, 0x08, 0x20, 0x2A, 0x35, 0x41, 0x53])
def test_value_and_name_are_where_the_program_expects_them(at: int) -> None:
    name = f"0x{at:02X}".encode()
    desk = servo()
    sent = responses(desk, TO_SERVO, (b"\0\0" + name + b"\xc1").hex())
    body = b"".join(frame.data[:-1] for frame in sent)[2:]  # without tails and the transfer CRC
    assert (len(body), body[0], body[9:12], body[12:]) == (16, 1, b"\0\0\0", name)
    assert int.from_bytes(body[1:9], "little", signed=True) == (desk.servo.register(at) or 0)


@pytest.mark.states("B83", "B101")
@pytest.mark.parametrize(("setting", "frames"), [("zero", 3), ("empty", 1), ("silent", 0)])
def test_the_response_for_a_row_without_a_value(setting: str, frames: int) -> None:
    desk = servo()
    desk.servo.behaviour = Behaviour(pwm_rows=setting)  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]
    assert len(responses(desk, TO_SERVO, READS["0x34 without the input reads 0"][0])) == frames


@pytest.mark.states("B06", "B07", "B48")
@pytest.mark.parametrize(
    ("identifier", "request_", "response_id", "response"),
    [
        pytest.param(0x100AAAFF, "00000000000000c3", 0x100A7FAA, "00000000000080c3", id="save"),
        pytest.param(0x1005AAFF, "1e1b55ceacc4", 0x10057FAA, "80c4", id="restart"),
    ],
)
def test_save_and_restart(identifier: int, request_: str, response_id: int, response: str) -> None:
    desk = servo()
    (sent,) = responses(desk, identifier, request_)
    assert (sent.id, sent.data.hex()) == (response_id, response)
    desk.wait(0.5)
    assert desk.servo.starts == 2


@pytest.mark.states("B21", "B22", "B23")
def test_a_position_of_90_degrees_moves_a_new_servo_with_id_0() -> None:
    desk = Desk(servo_id=0, rom={"soft_start": 0, "timeout_action": 0})
    responses(desk, 0x1003F27F, "0001333bc0")
    desk.settle()
    assert desk.read("0x00") == 900
    assert desk.servo.angle_deg == pytest.approx(90.0, abs=0.4)
