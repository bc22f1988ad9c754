"""0x49 and unlisted writes never pass the guard, in any spelling and in any split into calls."""

import re
import struct

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hornbill.errors import BusDisconnected, BusReadOnly, ForbiddenParameter, OutOfRange
from hornbill.node.role import ConnectionRole
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorCommand, AllocationMessage, ArrayCommand, CommandType, NodeStatus
from hornbill.wire.port import CanPort, PortState
from hornbill.wire.services import EMPTY, GetNodeInfoRequest, GetSetRequest, GetSetResponse, Value, ValueKind, integer
from hornbill.wire.transfer import Transfer, split
from jumping_clock import run
from unit.node.recording import WRITABLE, port

SPELLINGS = (
    "0x49", "0X49", "0x049", "0x0049", "0x00000000000000000049", " 0x49", "0x49 ", "0x49\0", "0x49\0\0\0", "\0000x49",
    "\t0x49\n", "0x 49", "0 x49", "x49", "X49", "49", "49h", "49H", "$49", "#49", "h49", "+0x49", "-0x49", "0x+49",
    "73", "073", " 73", "73 ", "73\0", "73.0", "7.3e1", "0o111", "0111", "111", "0b1001001", "01001001b", "0x4_9",
    "0x4９", "０x49", "0x٤٩", "٧٣", "0х49", "0×49", "0x49;0x38", "0x49 0x38", "0x38\0000x49", "0x38,0x49", "0x149",
    "0xFF49", "329", "0x49abc", "0x49.0", "&H49", "\\x49", "I", "'I'", "boot_loader", "Boot Loader", "0x3873", "7_3",
    "\u200b0x49", "\ufeff0x49", "0x4\u00ad9", "0x49\u0301", "\u00a00x49", "0x49\u2028",
)  # fmt: skip


def raw_request(payload: bytes, *, priority: int = 24, transfer_id: int = 3, destination: int = 42) -> list[Frame]:
    transfer = Transfer(Kind.REQUEST, 11, 127, destination, priority, transfer_id, payload)
    return split(transfer, GetSetRequest.TYPE)


def payload(name: bytes, value: bytes = b"\0", index: int = 0) -> bytes:
    """A GetSet request as bytes; `value` begins with the tag."""
    return bytes((index & 0xFF, index >> 8 << 3 | value[0])) + value[1:] + name


WRITE_5 = b"\1" + struct.pack("<q", 5)


def assert_refused(frames: list[Frame], *, allow_broadcast: bool = False) -> OutOfRange | ForbiddenParameter:
    guarded, inner = port(allow_broadcast=allow_broadcast)
    with pytest.raises((ForbiddenParameter, OutOfRange)) as caught:
        guarded.send(frames)
    assert inner.sent == []
    return caught.value


def assert_passes(frames: list[Frame], *, allow_broadcast: bool = False) -> None:
    guarded, inner = port(allow_broadcast=allow_broadcast)
    guarded.send(frames)
    assert inner.sent == frames


def read(name: str, *, index: int = 0) -> list[Frame]:
    return raw_request(payload(name.encode(), index=index))


def write(name: str, number: int = 5) -> list[Frame]:
    return raw_request(GetSetRequest(0, integer(number), name).encode())


@pytest.mark.parametrize("name", SPELLINGS)
@pytest.mark.parametrize("value", [b"\0", WRITE_5], ids=["read", "write"])
def test_no_spelling_of_the_boot_loader_register_is_sent(name: str, value: bytes) -> None:
    assert_refused(raw_request(payload(name.encode(), value)))


@pytest.mark.parametrize("name", [b"0x38", b"", b"0x00", b"0x2A"])
@pytest.mark.parametrize("value", [b"\0", WRITE_5, b"\2\0\0\0\0", b"\3\1", b"\4\0011"], ids=list("eirbs"))
def test_an_index_whose_low_byte_is_73_is_refused_with_any_name(name: bytes, value: bytes) -> None:
    for high in range(32):
        assert_refused(raw_request(payload(name, value, index=high << 8 | 73)))


def reads_as_73(name: bytes) -> bool:
    """Whether a very lenient firmware could parse a name as register 73."""
    text = name.decode("utf-8", "ignore").replace("\0", " ").strip().lower()
    text = "".join(str(int(each)) if each.isdecimal() else each for each in text)
    for base in (0, 10, 16, 8, 2):
        for candidate in (text, text.split(" ")[0], text[:4], text.lstrip("0x"), text.removesuffix("h")):
            try:
                if int(candidate, base) & 0xFF == 73:
                    return True
            except ValueError:
                continue
    return False


names = st.one_of(
    st.binary(max_size=92),
    st.text(max_size=20).map(str.encode),
    st.sampled_from(SPELLINGS).map(str.encode),
    st.from_regex(r"\A[\s\x00]*[+-]?(0[xX])?0*(49|73|111)[\s\x00hH]*\Z").map(lambda s: s.encode()[:92]),
    st.integers(0, 255).map(lambda n: f"0x{n:02X}".encode()),
    st.integers(0, 255).map(lambda n: f"0x{n:02x}".encode()),
)
values = st.one_of(
    st.just(b"\0"),
    st.integers(-(2**63), 2**63 - 1).map(lambda n: b"\1" + struct.pack("<q", n)),
    st.binary(min_size=4, max_size=4).map(lambda b: b"\2" + b),
    st.binary(min_size=1, max_size=1).map(lambda b: b"\3" + b),
    st.binary(max_size=20).map(lambda b: b"\4" + bytes((len(b),)) + b),
)


@given(name=names, value=values, index=st.integers(0, 8191))
@example(name=b"0x49", value=b"\0", index=0)
@example(name=b"73", value=WRITE_5, index=0)
@example(name=b"0x73", value=b"\0", index=0)
@example(name=b"0x73", value=WRITE_5, index=0)
def test_a_request_that_passes_is_for_another_register(name: bytes, value: bytes, index: int) -> None:
    guarded, inner = port()
    frames = raw_request(payload(name, value, index))
    try:
        guarded.send(frames)
    except ForbiddenParameter:
        assert inner.sent == []
        return
    assert inner.sent == frames
    assert index != 73
    # A parser to which 0x73 is decimal would find no other register by its name.
    assert name == b"0x73" or not reads_as_73(name)
    assert name == b"" or re.fullmatch(rb"0x[0-9a-fA-F]{2}", name)
    if value != b"\0":
        assert name.decode() in WRITABLE


@given(data=st.binary(max_size=300))
def test_malformed_requests_never_pass(data: bytes) -> None:
    guarded, inner = port()
    try:
        guarded.send(raw_request(data))
    except ForbiddenParameter:
        assert inner.sent == []
        return
    request = GetSetRequest.decode(data)
    assert request is not None
    assert request.index != 73
    assert request.name == "" or request.name in WRITABLE or request.value == EMPTY


def test_every_other_register_can_be_read_by_its_name() -> None:
    for register in set(range(256)) - {0x49}:
        assert_passes(read(f"0x{register:02X}"))
        assert_passes(read(f"0x{register:02x}"))


@pytest.mark.parametrize("name", ["0x21", "0x03", "0x28", "0x4A", "0x2a", "0X20", "", "torque_mode", "gain", "0x200"])
def test_a_write_to_a_name_outside_the_list_is_refused(name: str) -> None:
    assert_refused(write(name))


@pytest.mark.parametrize(
    "value", [Value(ValueKind.REAL, 1.0), Value(ValueKind.BOOLEAN, 1), Value(ValueKind.STRING, "1"), integer(0)]
)
def test_every_kind_of_value_is_a_write_and_only_listed_names_are_written(value: Value) -> None:
    assert_refused(raw_request(GetSetRequest(0, value, "0x21").encode()))
    assert_passes(raw_request(GetSetRequest(0, value, "0x2A").encode()))


def test_the_boot_loader_cannot_be_made_writable() -> None:
    for name in ("0x49", "0x049", "73", "gain"):
        said = f"'{name}' cannot be made writable. Give registers as printed, 0x49 excepted."
        with pytest.raises(ValueError, match=f"^{said}$"):
            port(writable=frozenset({"0x20", name}))


@given(order=st.permutations(range(3)), repeat=st.integers(0, 2))
def test_frames_out_of_order_never_complete_a_forbidden_transfer(order: list[int], repeat: int) -> None:
    guarded, inner = port()
    frames = write("0x49")
    for position in [*order, repeat, 0, 1, 2]:
        try:
            guarded.send([frames[position]])
        except ForbiddenParameter:
            continue
    assert frames[2] not in inner.sent


MALFORMED = "An incomplete or malformed request is refused: its effect on a servo is unknown."
BOOT = "is refused: 0x49 is the boot loader register."
UNLISTED = "is refused: only registers of the parameter tables can be written."
UNNAMED = "is refused: a register name is 0x and two hex digits, except 0x49."
WHOLE = payload(b"", b"\1" + struct.pack("<q", 1))


@pytest.mark.parametrize(
    ("data", "refused"),
    [
        *((WHOLE[:kept], MALFORMED) for kept in (0, 1, 2, 5, 9)),
        (WHOLE, f"Writing '' {UNLISTED}"),
        (payload(b"", b"\4"), MALFORMED),
        (payload(b"", b"\4\0"), f"Writing '' {UNLISTED}"),
        (payload(b"", b"\4\2A"), MALFORMED),
        (payload(b"0x21", b"\4\2AB"), f"Writing '0x21' {UNLISTED}"),
        *((payload(b"0x38", bytes((tag,)) + bytes(8)), MALFORMED) for tag in (5, 6, 7)),
        (payload(b"", index=73), f"Index 73 {BOOT}"),
        (payload(b"", index=5 << 8 | 73), f"Index 1353 {BOOT}"),
        (payload(b"0x38", WRITE_5, index=31 << 8 | 73), f"Index 8009 {BOOT}"),
        (payload(b"gain"), f"Reading 'gain' {UNNAMED}"),
        (payload(b"\xe9"), f"Reading '\xe9' {UNNAMED}"),
    ],
)
def test_a_refusal_states_the_request_and_the_reason(data: bytes, refused: str) -> None:
    error = assert_refused(raw_request(data))
    assert (error.detail, error.facts) == (f"{refused} Nothing was sent.", {"cause": "write_forbidden"})


@pytest.mark.parametrize("data", [b"\0\0", payload(b"0x38"), payload(b"0x38", b"\4\2AB"), payload(b"0x38", b"\4\0")])
def test_the_shortest_complete_requests_pass(data: bytes) -> None:
    assert_passes(raw_request(data))


def test_after_the_port_failed_the_rest_of_the_transfer_is_refused() -> None:
    guarded, inner = port()
    first, second, last = write("0x38")
    inner.state = PortState.LOST
    with pytest.raises(BusDisconnected):
        guarded.send([first])
    inner.state = PortState.ACTIVE
    with pytest.raises(ForbiddenParameter):
        guarded.send([second, last])
    assert inner.sent == []


def test_everything_but_getset_requests_passes() -> None:
    response = GetSetResponse(integer(5), EMPTY, EMPTY, EMPTY, "0x49")
    frames = [
        *split(Transfer(Kind.RESPONSE, 11, 42, 127, 24, 1, response.encode()), GetSetResponse.TYPE),
        *split(Transfer(Kind.REQUEST, 1, 127, 42, 24, 1, b""), GetNodeInfoRequest.TYPE),
        *split(Transfer(Kind.MESSAGE, 341, 127, 0, 24, 1, bytes((73,) * 7)), NodeStatus.TYPE),
        Frame(0x00A6ED00, bytes.fromhex("011a6fe9f660cec0")),
        Frame(0x1803F37F, b"\xff\xff\xff\xff\xc0"),
        Frame(0x1803F200, b"\xff\xff\xff\xff\xc0"),  # anonymous: two bits of the type, and a number by chance
    ]
    assert_passes(frames)


def test_it_forwards_everything_else_to_its_port() -> None:
    guarded, inner = port()
    as_port: CanPort = guarded
    received: list[list[Frame]] = []
    as_port.listen(received.append)
    inner.deliver(write("0x49"))
    assert received == [write("0x49")]
    assert (as_port.address, as_port.bitrate, as_port.statistics) == (inner.address, inner.bitrate, inner.statistics)
    inner.state = PortState.PASSIVE
    assert as_port.state is PortState.PASSIVE
    run(as_port.close())
    assert inner.closed


def message(command: ArrayCommand) -> list[Frame]:
    return split(Transfer(Kind.MESSAGE, 1010, 127, 0, 17, 0, command.encode()), ArrayCommand.TYPE)


def commands(*actuators: int) -> ArrayCommand:
    return ArrayCommand([ActuatorCommand(each, CommandType.POSITION, 1.0) for each in actuators])


@pytest.mark.parametrize("actuators", [(255,), (1, 255), (*range(1, 15), 255), (255, 1, 2)])
def test_a_command_to_every_servo_is_refused(actuators: tuple[int, ...]) -> None:
    error = assert_refused(message(commands(*actuators)))
    assert error.facts == {"minimum": 1, "maximum": 254, "unit": "", "requested": 255, "cause": "broadcast_id"}
    assert error.detail == "Actuator ID 255 would move every servo on the bus. Use 1 to 254."


@pytest.mark.parametrize("actuators", [(0,), (1, 0), (*range(1, 15), 0), (0, 255)])
@pytest.mark.parametrize("allow_broadcast", [False, True])
def test_a_command_to_id_0_is_always_refused(actuators: tuple[int, ...], allow_broadcast: bool) -> None:
    error = assert_refused(message(commands(*actuators)), allow_broadcast=allow_broadcast)
    assert error.facts == {"minimum": 1, "maximum": 254, "unit": "", "requested": 0, "cause": "unassigned_id"}
    assert error.detail == (
        "Actuator ID 0 addresses every servo without a servo ID: all of them may move together. "
        "Set a servo ID of 1 to 254 (parameter 0x45) and use that."
    )


def toggled(frame: Frame, toggle: int) -> Frame:
    """A frame with another toggle bit."""
    return frame._replace(data=frame.data[:-1] + bytes((frame.data[-1] & ~0x20 | toggle << 5,)))


A, B, C = write("0x38")
X, Y, Z = write("0x49")
OTHER = raw_request(GetSetRequest(0, integer(1), "0x20").encode(), destination=43)
URGENT = raw_request(GetSetRequest(0, integer(1), "0x38").encode(), priority=16)
BY_INDEX = raw_request(payload(b"0x38", WRITE_5, index=73))
"""The first frames contain the index, the last one the name: a receiver may combine unchecked transfers."""
FIVE = raw_request(payload(b"0x38", WRITE_5), transfer_id=1)
BROADCAST = message(commands(1, 2, 3, 255))
EACH = message(ArrayCommand([ActuatorCommand(n, 255, float("nan")) for n in range(1, 16)]))
NEXT = [toggled(B, number & 1) for number in range(1, 38)]
CAN_FD = split(Transfer(Kind.MESSAGE, 1010, 127, 0, 17, 0, bytes.fromhex("1ff1003c00")), ArrayCommand.TYPE)


@pytest.mark.parametrize(
    ("passing", "refused"),
    [
        pytest.param([[A], [B], [C]], [], id="frame by frame"),
        pytest.param([[frame] for frame in EACH], [], id="commands frame by frame"),
        pytest.param([[A, OTHER[0]], [B, OTHER[1]], [C, OTHER[2]]], [], id="two nodes interleaved"),
        pytest.param([], [[*read("0x38"), X, Y, Z, *read("0x39")]], id="one forbidden transfer among others"),
        pytest.param([[X], [Y]], [[Z], [Z]], id="the frame that completes a forbidden transfer, and repeated"),
        pytest.param([BROADCAST[:-1]], [BROADCAST[-1:]], id="the frame that completes a broadcast"),
        # Receivers that separate sessions by priority and others must both receive only checked transfers.
        pytest.param([[X, Y], URGENT[:2]], [[Z], URGENT[2:]], id="a mixture of two transfers"),
        pytest.param([BY_INDEX[:2], URGENT[:2]], [BY_INDEX[2:]], id="continued at another priority"),
        pytest.param([], [[toggled(read("0x38")[0], 1)]], id="wrong toggle at the beginning"),
        pytest.param([], [[read("0x38")[0]._replace(data=b"")]], id="no tail byte"),
        pytest.param([FIVE[:2]], [[FIVE[2]._replace(data=b"")]], id="no tail byte at the end"),
        pytest.param([[A._replace(data=A.data[-5:])], NEXT[:36]], [NEXT[36:]], id="more than 256 bytes"),
        pytest.param([], [raw_request(payload(b"0x38" * 100))], id="more than 256 bytes in one call"),
        # Its leading count shifts the actuator IDs by four bits.
        pytest.param([], [CAN_FD], id="a command in CAN FD format"),
    ],
)
def test_a_transfer_sent_in_parts_is_checked_as_a_whole(passing: list[list[Frame]], refused: list[list[Frame]]) -> None:
    guarded, inner = port()
    for frames in passing:
        guarded.send(frames)
    for frames in refused:
        with pytest.raises((ForbiddenParameter, OutOfRange)):
            guarded.send(frames)
    assert inner.sent == [frame for frames in passing for frame in frames]
    guarded.send(read("0x38"))
    assert inner.sent[-1:] == read("0x38")


def test_a_command_to_every_servo_passes_if_allowed() -> None:
    assert_passes(message(commands(255)), allow_broadcast=True)


ALLOCATION = split(
    Transfer(Kind.MESSAGE, 1, 127, 0, 30, 0, AllocationMessage(5, False, b"unique").encode()), AllocationMessage.TYPE
)
STATUS = split(Transfer(Kind.MESSAGE, 341, 127, 0, 16, 0, bytes(7)), NodeStatus.TYPE)


@pytest.mark.parametrize(
    ("role", "frames", "cause"),
    [
        (ConnectionRole.OBSERVER, STATUS, "observer_sends_nothing"),
        (ConnectionRole.OBSERVER, read("0x38"), "observer_sends_nothing"),
        (ConnectionRole.GUEST, ALLOCATION, "guest_allocates_nothing"),
        (ConnectionRole.GUEST, [*STATUS, *ALLOCATION, *STATUS], "guest_allocates_nothing"),
        (ConnectionRole.GUEST, [*STATUS, *read("0x38")], None),
        (ConnectionRole.HOST, ALLOCATION, None),
    ],
)
def test_an_observer_sends_nothing_and_a_guest_allocates_nothing(
    role: ConnectionRole, frames: list[Frame], cause: str | None
) -> None:
    guarded, inner = port(role=role)
    if cause is None:
        guarded.send(frames)
        assert inner.sent == frames
        return
    with pytest.raises(BusReadOnly) as caught:
        guarded.send(frames)
    assert caught.value.facts["cause"] == cause
    assert inner.sent == []
