"""CAN interfaces of Linux, and USB CAN adapters without a loaded driver."""

from pathlib import Path

from hornbill.bus.adapters import socketcan
from hornbill.bus.adapters.adapter import FoundAdapter
from hornbill.bus.adapters.socketcan import Interface

USB = Path("/sys/bus/usb/devices")
"""Where the kernel lists USB devices."""

DRIVERS: dict[tuple[str, str], tuple[str, str]] = {
    ("04d8", "0a30"): ("Microchip CAN BUS Analyzer", "mcba_usb"),
    ("0483", "1234"): ("8devices USB2CAN", "usb_8dev"),
    ("0ab4", ""): ("esd CAN-USB", "esd_usb"),
    ("0bfd", ""): ("Kvaser", "kvaser_usb"),
    ("0c72", ""): ("PEAK PCAN-USB", "peak_usb"),
    ("1209", "2323"): ("candleLight", "gs_usb"),
    ("16d0", "10b8"): ("CANdebugger FD", "gs_usb"),
    ("1cd2", "606f"): ("CANext FD", "gs_usb"),
    ("1d50", "606f"): ("candleLight / CANable", "gs_usb"),
}
"""Name and kernel module of CAN adapters by USB vendor and product ID. An empty product ID matches any."""

BITRATE = 1_000_000
"""Factory setting of the servos, bit/s."""


def kernel_adapters() -> list[FoundAdapter]:
    """CAN interfaces, up or down, then adapters without a driver. Takes up to a second: call it in a thread."""
    found = [_adapter(one) for one in socketcan.interfaces()]
    return found + _without_driver({one.channel for one in found})


def _adapter(one: Interface) -> FoundAdapter:
    address, name = f"socketcan:{one.name}", _name(one.name)
    fault = socketcan.fault_of(one, BITRATE)
    if fault is not None:
        return FoundAdapter(
            address, name, fault.state, fault.reason, fault.remedy, one.bitrate, one.sample_point,
            cause=fault.cause, params=fault.params,
        )  # fmt: skip
    reason = remedy = None
    if one.sample_point is not None and abs(one.sample_point - socketcan.SAMPLE_POINT) > socketcan.NEAR:
        reason = (
            f"Its sample point is {one.sample_point:.1%}, that of the servos {socketcan.SAMPLE_POINT:.1%}. "
            "This works on a short bus."
        )
        remedy = socketcan.set_command(one.name, BITRATE)
    return FoundAdapter(address, name, "ready", reason, remedy, one.bitrate, one.sample_point)


def _name(interface: str) -> str:
    """Product and serial number of a USB adapter, the driver of others, or "virtual CAN interface"."""
    device = socketcan.NET / interface / "device"
    if not device.exists():
        return "virtual CAN interface"
    product = _product(device.resolve().parent)
    driver = device / "driver"
    return product or (driver.resolve().name if driver.exists() else "CAN interface")


def _without_driver(taken: set[str]) -> list[FoundAdapter]:
    if not USB.is_dir():
        return []
    found: list[FoundAdapter] = []
    for device in sorted(USB.iterdir()):
        ids = (_read(device / "idVendor"), _read(device / "idProduct"))
        known = DRIVERS.get(ids) or DRIVERS.get((ids[0], ""))
        if known is None:
            continue
        parts = list(USB.glob(f"{device.name}:*"))
        if any((part / "net").is_dir() for part in parts):
            continue  # it is listed as an interface
        name, module = known
        free = next(f"can{number}" for number in range(len(taken) + 1) if f"can{number}" not in taken)
        taken.add(free)
        if any((part / "driver").exists() for part in parts):
            cause, params = "interface_not_visible", dict[str, str]()
            why = "Its driver is loaded, but its CAN interface is not visible here."
            remedy = "In a container, run it with --network host."
        else:
            why, remedy = "No driver is loaded for it.", f"sudo modprobe {module}"
            cause, params = "driver_not_loaded", {"command": remedy}
        found.append(
            FoundAdapter(
                f"socketcan:{free}", _product(device) or name, "no_driver", why, remedy, cause=cause, params=params
            )
        )
    return found


def _product(device: Path) -> str:
    return " ".join(filter(None, (_read(device / name) for name in ("manufacturer", "product", "serial"))))


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip()
    except OSError:
        return ""
