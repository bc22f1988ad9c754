"""Addresses of MAVLink CAN forwarding, its line, and its default role."""

import pytest

from hornbill.bus.address import check
from hornbill.bus.ports.mavcan import Channel, parse_mavcan
from hornbill.errors import PortOpenFailed
from hornbill.node.role import ConnectionRole
from hornbill.servo.runtime.stored_roles import StoredRoles
from hornbill.store.store import Store
from hornbill.wire.port import SerialLineInfo


@pytest.mark.parametrize(
    ("channel", "parsed"),
    [
        ("/dev/ttyACM0@57600", Channel("/dev/ttyACM0", 57_600, "", 0, 1)),
        ("/dev/ttyACM0", Channel("/dev/ttyACM0", None, "", 0, 1)),
        ("COM3@921600?bus=2", Channel("COM3", 921_600, "", 0, 2)),
        ("udp:192.168.1.20:14550", Channel("", None, "192.168.1.20", 14_550, 1)),
        ("udp:[fe80::1]:14550?bus=3", Channel("", None, "fe80::1", 14_550, 3)),
        ("udp:autopilot.local:14550", Channel("", None, "autopilot.local", 14_550, 1)),
    ],
)
def test_an_address_is_parsed(channel: str, parsed: Channel) -> None:
    assert parse_mavcan(channel) == parsed
    assert check(f"mavcan:{channel}", 1_000_000) == f"mavcan:{channel}"


@pytest.mark.parametrize(
    ("channel", "names"),
    [
        ("udp:host", "host and UDP port"),
        ("udp:host:0", "host and UDP port"),
        ("udp:host:70000", "host and UDP port"),
        ("udp::14550", "host and UDP port"),
        ("/dev/ttyACM0@fast", "baud rate"),
        ("/dev/ttyACM0@", "baud rate"),
        ("@57600", "baud rate"),
        ("/dev/ttyACM0@57600?bus=0", "1 to 8"),
        ("/dev/ttyACM0@57600?bus=9", "1 to 8"),
        ("/dev/ttyACM0@57600?speed=3", "1 to 8"),
    ],
)
def test_an_invalid_address_is_refused_with_examples(channel: str, names: str) -> None:
    with pytest.raises(PortOpenFailed, match=names) as refused:
        check(f"mavcan:{channel}", 1_000_000)
    assert refused.value.facts["cause"] == "mavcan_address_invalid"
    assert "mavcan:udp:192.168.1.20:14550" in refused.value.detail


@pytest.mark.parametrize("options", ["key=secret-words", "bus=1&key=secret-words"])
def test_a_key_in_an_address_is_refused_and_not_repeated(options: str) -> None:
    with pytest.raises(PortOpenFailed, match="HORNBILL_MAVLINK_KEY") as refused:
        check(f"mavcan:udp:192.168.1.20:14550?{options}", 1_000_000)
    assert refused.value.facts["cause"] == "mavcan_key_in_address"
    assert "secret" not in f"{refused.value.detail} {refused.value.facts}"


def test_a_line_carries_fewer_signed_frames() -> None:
    assert SerialLineInfo(57_600, frame_bytes=28).budget == 205
    signed = SerialLineInfo(57_600, frame_bytes=41)
    assert signed.budget == 140
    assert signed.slcan_bytes_per_s == pytest.approx(5760 * 27 / 41)
    assert SerialLineInfo(57_600).slcan_bytes_per_s == 5760
    assert SerialLineInfo(57_600, native_usb=True).slcan_bytes_per_s is None


@pytest.mark.parametrize("address", ["mavcan:/dev/ttyACM0@57600", "mavcan:udp:192.168.1.20:14550", "mcast:0"])
def test_on_the_bus_of_an_autopilot_hornbill_is_a_guest_by_default(address: str) -> None:
    with Store("sqlite://") as store:
        roles = StoredRoles(store.settings)
        assert roles.choose(address, None) is ConnectionRole.GUEST
        assert roles.choose(address, "auto") is ConnectionRole.GUEST
        assert roles.choose(address, "host") is ConnectionRole.HOST
