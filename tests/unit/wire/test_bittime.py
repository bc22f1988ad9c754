"""frame_bits, against a bit-by-bit reference and the limits of an extended data frame."""

from itertools import groupby

from hypothesis import example, given
from hypothesis import strategies as st

from hornbill.wire.bittime import frame_bits
from hornbill.wire.frame import Frame


def crc15(bits: str) -> int:
    crc = 0
    for bit in bits:
        crc = (crc << 1 ^ (0x4599 if int(bit) ^ crc >> 14 else 0)) & 0x7FFF
    return crc


def stuffed(bits: str) -> str:
    out = ""
    run = ""
    for bit in bits:
        out += bit
        run = run + bit if run.endswith(bit) else bit
        if len(run) == 5:
            run = "01"[bit == "0"]
            out += run
    return out


def reference_bits(frame: Frame) -> int:
    header = f"0{frame.id >> 18:011b}11{frame.id & 0x3FFFF:018b}000{len(frame.data):04b}"
    body = header + "".join(f"{byte:08b}" for byte in frame.data)
    return len(stuffed(body + f"{crc15(body):015b}")) + 1 + 2 + 7 + 3


def test_the_reference_knows_the_check_value_and_the_rule() -> None:
    assert crc15("".join(f"{byte:08b}" for byte in b"123456789")) == 0x059E
    assert stuffed("00000000001") == "0000010000011"
    assert max(len(list(run)) for _, run in groupby(stuffed("0" * 5 + "1" * 4 + "0" * 8))) == 5


@given(st.integers(0, 0x1FFF_FFFF), st.binary(max_size=8))
@example(0, bytes(8))
@example(0x1FFF_FFFF, b"\xff" * 8)
def test_frame_bits_equal_counting_bit_by_bit(identifier: int, data: bytes) -> None:
    frame = Frame(identifier, data)
    assert frame_bits(frame) == reference_bits(frame)
