"""CAN interfaces as the kernel lists them in sysfs, in a folder of a test."""

from pathlib import Path


def interface(
    net: Path, name: str, *, kind: int = 280, up: bool = True, carrier: bool = True, device: str = ""
) -> None:
    """An interface in `net`. `device`: where sysfs has it, below devices/."""
    real = net.parent / "devices" / device / name
    real.mkdir(parents=True)
    (real / "type").write_text(f"{kind}\n")
    (real / "flags").write_text("0x40081\n" if up else "0x40080\n")
    if up:  # unreadable while the interface is down
        (real / "carrier").write_text(f"{carrier:d}\n")
    (net / name).symlink_to(real)
