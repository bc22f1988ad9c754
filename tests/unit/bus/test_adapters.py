"""Adapters: detection of every kind, in time even if a driver hangs, and without opening any."""

import asyncio
import gc
import os
import pty
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
import pytest

from behaviour.rig import Rig, json
from behaviour.scene import scene
from hornbill.bus import listing as adapters_module
from hornbill.bus.adapters import diagnosis, kernel_adapters, socketcan
from hornbill.bus.adapters.adapter import FoundAdapter
from hornbill.bus.adapters.serial_ports import UNKNOWN_ADAPTER, UsbAdapter, serial_adapters, usb_of
from hornbill.bus.listing import DETECT_S, OWN_DETECTION, Adapters, detect
from unit.bus.sysfs import interface

pytestmark = pytest.mark.real_time


@dataclass
class Port:
    """A serial port as pyserial lists it."""

    device: str
    vid: int | None = None
    pid: int | None = None
    serial_number: str | None = None
    manufacturer: str | None = None
    product: str | None = None
    location: str | None = None


def listed(*looks: Callable[[], list[FoundAdapter]], connected: str | None = None) -> list[FoundAdapter]:
    return asyncio.run(Adapters(detectors={f"x{n}": look for n, look in enumerate(looks)}).plugged_in(connected))


def one(address: str, **more: Any) -> Callable[[], list[FoundAdapter]]:
    return lambda: [FoundAdapter(address, "adapter", **more)]


async def found_by(adapters: Adapters, count: int) -> list[FoundAdapter]:
    """The adapters as soon as `count` are listed: a busy machine may need several looks."""
    while len(found := await adapters.plugged_in()) < count:
        pass
    return found


# Looking everywhere at once.


def test_adapters_are_listed_in_order_and_a_failing_driver_hides_only_its_own() -> None:
    def fail() -> list[FoundAdapter]:
        raise RuntimeError("a defect in a driver")

    found = listed(fail, one("socketcan:can0"), list[FoundAdapter], one("slcan:/dev/ttyACM0"))
    assert [(each.interface, each.channel, each.usable) for each in found] == [
        ("socketcan", "can0", True), ("slcan", "/dev/ttyACM0", True),
    ]  # fmt: skip


async def test_the_error_of_a_driver_is_not_logged_as_never_retrieved_if_its_search_was_cancelled() -> None:
    reported: list[dict[str, Any]] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: reported.append(context))
    go_on = threading.Event()

    def fail() -> list[FoundAdapter]:
        go_on.wait(60)
        raise ImportError("no such driver")

    adapters = Adapters(detectors={"missing": fail})
    search = asyncio.create_task(adapters.plugged_in())
    await asyncio.sleep(0)
    search.cancel()
    await asyncio.wait([search])
    go_on.set()
    while any(thread.name == "detect missing" for thread in threading.enumerate()):
        await asyncio.sleep(0)
    for _ in range(3):  # its result arrives, and whoever waits for it is called
        await asyncio.sleep(0)
    del adapters, search
    gc.collect()
    assert reported == []


async def test_a_hanging_driver_hides_only_its_own_adapters_and_is_called_once(monkeypatch: pytest.MonkeyPatch) -> None:
    assert DETECT_S <= 1.5
    monkeypatch.setattr(adapters_module, "DETECT_S", 0.2)
    go_on = threading.Event()
    calls: list[bool] = []

    def hang() -> list[FoundAdapter]:
        calls.append(go_on.wait(60))
        return [FoundAdapter("slow:0", "slow")]

    adapters = Adapters(detectors={"slow": hang, "quick": one("quick:0")})
    for _ in range(2):  # what may just be slow is not listed: perhaps nothing of its kind is plugged in
        for found in await asyncio.gather(*(found_by(adapters, 1) for _ in range(2))):
            assert [(each.address, each.usable) for each in found] == [("quick:0", True)]
    monkeypatch.setattr(adapters_module, "HANGS_S", 0.1)
    hung, quick = await found_by(adapters, 2)
    assert (hung.state, hung.usable, hung.address, quick.usable) == ("no_driver", False, "slow:", True)
    assert "It has not responded for 0.1 s" in (hung.reason or "")
    assert calls == [], "neither the loop nor the other drivers waited for it"
    go_on.set()
    while (await found_by(adapters, 2))[0].address == "slow:":
        pass
    assert calls[0], "simultaneous and later calls shared one detection"
    adapters.close()


async def test_an_adapter_whose_driver_stops_responding_is_listed_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adapters_module, "DETECT_S", 0.1)
    go_on = threading.Event()
    go_on.set()

    def look() -> list[FoundAdapter]:
        go_on.wait(60)
        return [FoundAdapter("pcan:PCAN_USBBUS1", "PCAN-USB")]

    adapters = Adapters(detectors={"pcan": look})
    assert [each.usable for each in await found_by(adapters, 1)] == [True]
    go_on.clear()
    (hung,) = await adapters.plugged_in()
    assert (hung.address, hung.state, hung.reason) == (
        "pcan:PCAN_USBBUS1", "no_driver", "Its driver does not respond.",
    )  # fmt: skip
    go_on.set()
    adapters.close()


async def test_the_last_baud_rate_of_a_serial_adapter_is_listed() -> None:
    class Memory:
        def baud(self, serial_number: str) -> int | None:
            return {"A1": 1_000_000}.get(serial_number)

        def remember_baud(self, serial_number: str, baud: int) -> None:
            raise AssertionError("looking remembers nothing")

    found = [FoundAdapter(f"slcan:/dev/{n}", "x", serial_number=n) for n in ("A1", "B2")]
    found = await Adapters(detectors={"slcan": lambda: found}, memory=Memory()).plugged_in()
    assert [one.baud for one in found] == [1_000_000, None]


def test_equal_adapters_are_distinguished_by_their_usb_ports() -> None:
    ports = [Port(f"COM{n}", 0x0403, 0x6015, "A1", "FTDI", "USB-CAN", f"1-{n}") for n in (3, 4)]
    assert [one.name for one in serial_adapters(ports)] == ["USB-CAN A1 (USB 1-3)", "USB-CAN A1 (USB 1-4)"]
    assert serial_adapters(ports[:1])[0].name == "USB-CAN A1"


@pytest.mark.parametrize(
    ("ids", "native"), [((0xAD50, 0x60C4), True), ((0x0403, 0x6015), False), ((None, None), False)]
)
def test_usb_properties_of_an_adapter(ids: tuple[int | None, int | None], native: bool, tmp_path: Path) -> None:
    device, link = tmp_path / "ttyUSB7", tmp_path / "by-id"
    link.symlink_to(device)
    ports = [Port("/dev/ttyS0"), Port(str(device), *ids, serial_number="A1")]
    for name in (device, link):
        assert usb_of(str(name), ports) == UsbAdapter("A1", native)
    assert usb_of("COM9", ports) == UNKNOWN_ADAPTER


async def test_the_driver_of_the_open_bus_is_not_called_and_its_last_result_is_listed() -> None:
    calls: list[str] = []

    def look(name: str) -> Callable[[], list[FoundAdapter]]:
        return lambda: calls.append(name) or [FoundAdapter(f"{name}:0", name), FoundAdapter(f"{name}:1", name)]

    adapters = Adapters(detectors={name: look(name) for name in ("pcan", "kvaser", "slcan")})
    await adapters.plugged_in()
    calls.clear()
    found = await adapters.plugged_in("pcan:1")
    assert calls == ["kvaser", "slcan"]
    assert [each.address for each in found] == [f"{name}:{n}" for name in ("pcan", "kvaser", "slcan") for n in (0, 1)]
    assert [each.address for each in found if each.state == "connected"] == ["pcan:1"]
    await adapters.plugged_in("slcan:0")
    assert "slcan" in calls, "detection does not open serial ports"


def test_the_connected_bus_is_listed_even_if_not_detected(tmp_path: Path) -> None:
    found = listed(one("slcan:/dev/ttyACM9"), connected="kvaser:7")
    assert (found[0].address, found[0].state, found[0].usable) == ("kvaser:7", "connected", True)
    device, link = tmp_path / "ttyACM0", tmp_path / "by-id"
    device.touch()
    link.symlink_to(device)
    found = listed(one(f"slcan:{device}", state="in_use", reason="we use it"), connected=f"slcan:{link}@2000000")
    assert [(each.state, each.reason) for each in found] == [("connected", None)]


def test_every_python_can_interface_has_a_detector() -> None:
    looks = adapters_module._all_detectors()  # pyright: ignore[reportPrivateUsage]
    assert set(looks) | OWN_DETECTION == set(can.VALID_INTERFACES)
    assert {"socketcan", "slcan", "pcan", "kvaser", "vector", "gs_usb"} <= set(looks)


async def test_detection_on_this_machine_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    adapters = Adapters()
    for _ in range(2):
        await adapters.plugged_in()
    assert capfd.readouterr() == ("", "")


# python-can's detection.


def detecting(monkeypatch: pytest.MonkeyPatch, *configs: dict[str, Any]) -> None:
    class Bus:
        @staticmethod
        def _detect_available_configs() -> tuple[dict[str, Any], ...]:
            return configs

    def load(_name: str) -> object:
        return type("module", (), {"KvaserBus": Bus})

    monkeypatch.setattr(adapters_module, "import_module", load)


def test_adapters_detected_by_python_can_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    config = {"interface": "kvaser", "channel": 1, "device_name": "Kvaser Leaf Light v2", "serial": 1234}
    detecting(monkeypatch, config, {"channel": 2}, {"serial": 7})
    leaf, plain, unnamed = detect("kvaser")
    assert (leaf.address, leaf.name, leaf.state) == ("kvaser:1", "Kvaser Leaf Light v2 1234", "ready")
    assert (plain.address, plain.name) == ("kvaser:2", "kvaser")
    assert unnamed.usable is False
    assert unnamed.remedy is not None
    assert "kvaser:CHANNEL" in unnamed.remedy


# Serial ports.


def test_serial_adapters_are_sorted_known_then_named_then_possible_without_other_devices() -> None:
    found = serial_adapters(
        [
            Port("COM9", 0x0403, 0x6001, "A1", "FTDI", "FT232R"),
            Port("COM1"),
            *(
                Port("COM1", 1, 2, None, None, it)
                for it in ("Scanner", "American Serial", "Mechanical Keyboard", "Candle")
            ),
            Port("COM8", 0x1234, 0x5678, None, "Somebody", "USB-CAN Plus"),
            Port("COM7", 0x16D0, 0x117E, "S7", "Openlight Labs", "CANable2 b158aa7"),
            Port("COM6", 0x1D50, 0x60C7, "S6", "Zubax Robotics", None),
            Port("COM5", 0x2341, 0x0043, "S5", "Arduino", "Uno"),
            Port("COM4", 0x0403, 0xFFA8, "S4", "LAWICEL", None),
            Port("COM3", 0x04D8, 0x000A, None, "Microchip", "USBtin"),
            Port("COM2", 0xAD50, 0x60C4, "S2", None, None),
        ]
    )
    assert [(each.address, each.name) for each in found] == [
        ("slcan:COM2", "CANable S2"),
        ("slcan:COM3", "USBtin"),
        ("slcan:COM4", "LAWICEL CANUSB S4"),
        ("slcan:COM6", "Zubax Babel S6"),
        ("slcan:COM7", "CANable2 b158aa7 S7"),
        ("slcan:COM8", "USB-CAN Plus"),
        ("slcan:COM9", "FT232R A1"),
    ]
    assert [each.usable for each in found] == [True] * 7
    assert [each.reason is not None for each in found] == [False] * 6 + [True], "only the last may be another device"


@pytest.fixture
def device() -> Iterator[str]:
    ours, theirs = pty.openpty()
    yield os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


def test_a_serial_port_without_permission(device: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_access(_path: str, _mode: int) -> bool:
        return False

    monkeypatch.setattr(os, "access", no_access)
    (found,) = serial_adapters([Port(device, 0xAD50, 0x60C4)])
    assert (found.state, found.usable) == ("no_permission", False)
    assert found.remedy is not None
    assert found.remedy.startswith(f"Run: sudo usermod -aG {Path(device).group()} $USER")


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="who has a file open is found by Linux alone")
def test_a_serial_port_in_use_names_the_program(device: str) -> None:
    (found,) = serial_adapters([Port(device, 0xAD50, 0x60C4)])  # the fixture has it open
    assert (found.state, found.usable) == ("in_use", False)
    assert found.reason is not None
    assert f"(process {os.getpid()})" in found.reason
    assert diagnosis.users_of("/dev/no-such-device") == []
    (found,) = serial_adapters([Port("/dev/no-such-port", 0xAD50, 0x60C4)])
    assert (found.state, found.usable) == ("no_driver", False), "just removed"


# The kernel's.


def timing(bitrate: int, sample_point: str) -> dict[str, Any]:
    return {"bittiming": {"bitrate": bitrate, "sample_point": sample_point}}


DETAILS = {"can0": timing(1_000_000, "0.875"), "can1": timing(500_000, "0.875"), "can2": timing(1_000_000, "0.750")}


@pytest.fixture
def kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(socketcan, "NET", tmp_path / "net")
    monkeypatch.setattr(kernel_adapters, "USB", tmp_path / "usb")
    monkeypatch.setattr(socketcan, "_details", lambda: DETAILS)
    (tmp_path / "net").mkdir()
    (tmp_path / "usb").mkdir()
    return tmp_path


def plugged(kernel: Path, name: str, ids: str, *, driver: str = "", net: str = "", **found: str) -> Path:
    device, part = kernel / "usb" / name, kernel / "usb" / f"{name}:1.0"
    device.mkdir()
    vendor, product = ids.split(":")
    for key, text in ({"idVendor": vendor, "idProduct": product} | found).items():
        (device / key).write_text(f"{text}\n")
    real = device / f"{name}:1.0"
    real.mkdir()
    part.symlink_to(real)
    if driver:
        (kernel / driver).mkdir(exist_ok=True)
        (real / "driver").symlink_to(kernel / driver)
    if net:
        (real / "net" / net).mkdir(parents=True)
    return real


def test_an_interface_is_listed_with_its_product_and_timing(kernel: Path) -> None:
    real = plugged(
        kernel, "1-1", "1d50:606f", driver="gs_usb", net="can0",
        manufacturer="bytewerk", product="candleLight USB to CAN adapter", serial="0044",
    )  # fmt: skip
    interface(kernel / "net", "can0")
    (kernel / "net" / "can0" / "device").symlink_to(real)
    interface(kernel / "net", "vcan0")
    usb, virtual = kernel_adapters.kernel_adapters()
    assert usb == FoundAdapter(
        "socketcan:can0", "bytewerk candleLight USB to CAN adapter 0044", bitrate=1_000_000, sample_point=0.875
    )
    assert (virtual.name, virtual.state, virtual.bitrate) == ("virtual CAN interface", "ready", None)


def test_an_unusable_interface_is_listed_with_the_remedy(kernel: Path) -> None:
    interface(kernel / "net", "can0", up=False)
    interface(kernel / "net", "can1")
    interface(kernel / "net", "can2")
    down, wrong, odd = kernel_adapters.kernel_adapters()
    assert (down.state, down.usable) == ("down", False)
    assert down.remedy == "sudo ip link set can0 up type can bitrate 1000000 sample-point 0.875"
    assert (wrong.state, wrong.usable, wrong.bitrate) == ("wrong_bitrate", False, 500_000)
    assert wrong.remedy == (
        "sudo ip link set can1 down && sudo ip link set can1 up type can bitrate 1000000 sample-point 0.875"
    )
    assert (odd.state, odd.usable, odd.sample_point) == ("ready", True, 0.75)
    assert odd.reason is not None
    assert "75.0%" in odd.reason


def test_an_adapter_without_a_driver_is_listed_with_the_kernel_module(kernel: Path) -> None:
    interface(kernel / "net", "can0")
    plugged(kernel, "1-1", "0c72:000c", product="PCAN-USB")
    plugged(kernel, "1-2", "1209:2323")
    plugged(kernel, "1-3", "0bfd:0120", driver="kvaser_usb")
    plugged(kernel, "1-4", "046d:c077", product="Mouse")
    _, pcan, candle, hidden = kernel_adapters.kernel_adapters()
    assert (pcan.address, pcan.name, pcan.state, pcan.usable) == ("socketcan:can1", "PCAN-USB", "no_driver", False)
    assert pcan.remedy == "sudo modprobe peak_usb"
    assert (candle.address, candle.name, candle.remedy) == ("socketcan:can2", "candleLight", "sudo modprobe gs_usb")
    assert hidden.remedy is not None
    assert "--network host" in hidden.remedy


# Over REST.


@scene()
async def test_the_route_lists_adapters_and_marks_the_connected_one(rig: Rig) -> None:
    rig.app.state.adapters = Adapters(
        [FoundAdapter("memory:host", "Simulated servos", bitrate=1_000_000)],
        {"slcan": one("slcan:/dev/x", state="no_permission", reason="Not yours.", remedy="Ask.")},
    )
    found = json(await rig.call("GET", "/bus/adapters"))
    assert found[0] == {
        "address": "memory:host", "interface": "memory", "channel": "host", "name": "Simulated servos",
        "state": "connected", "usable": True, "reason": None, "remedy": None, "cause": None, "params": {},
        "bitrate": 1_000_000, "sample_point": None, "serial_number": None, "baud": None,
    }  # fmt: skip
    assert (found[1]["state"], found[1]["remedy"]) == ("no_permission", "Ask.")
    json(await rig.call("DELETE", "/bus"))
    assert json(await rig.call("GET", "/bus/adapters"))[0]["state"] == "ready"


@scene()
async def test_a_lost_adapter_is_not_listed_as_connected(rig: Rig) -> None:
    await rig.ready()
    rig.cable.bus_off()
    assert json(await rig.call("GET", "/bus/adapters"))[0]["state"] == "connected"
    await rig.cable.unplug()
    await asyncio.sleep(1)
    assert json(await rig.call("GET", "/bus/adapters")) == []
