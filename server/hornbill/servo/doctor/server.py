"""Findings on this server: database, free disk space, a busy computer, and the 3D view."""

from typing import Final

from hornbill.domain.bus import Finding
from hornbill.domain.fields import known
from hornbill.servo.doctor.finding import count, ok
from hornbill.servo.doctor.server_record import ServerRecord
from hornbill.servo.runtime.loop_lag import WINDOW_S

DISK_LOW: Final = 500_000_000
"""Below this, a recording or a migration may not fit, bytes."""

DISK_FULL: Final = 20_000_000
"""Below this, writes begin to fail, bytes."""

BUSY_S: Final = 0.25
"""A lag from here on delays a lease heartbeat or two tries of a request."""

OVERLOADED_S: Final = 1.0
"""A lag from here on lets a lease expire, or a servo appear offline."""


def database(server: ServerRecord) -> list[Finding]:
    """Whether changes are being stored."""
    pending, failing_s = server.store.pending, server.failing_s
    waiting = f"{count(pending, 'change')} not yet stored"
    if failing_s is None:
        return [ok("database", "Changes are being stored", f"{waiting}.", pending=pending)]
    return [
        Finding(
            "database",
            "failure",
            "Changes are not being stored",
            f"For {failing_s:.0f} s; {waiting}. {server.error or ''}".rstrip(),
            "Check that the database runs, and that its disk is writable and has free space.",
            advice="check_database",
            params=known(pending=pending, failing_s=round(failing_s), error=server.error),
        )
    ]


def disk_space(server: ServerRecord) -> list[Finding]:
    """Whether the disk of the data folder has free space."""
    if server.disk is None:
        return []
    free, total = server.disk
    evidence = f"{free / 1e6:.0f} MB free of {total / 1e6:.0f} MB."
    params = {"free_mb": round(free / 1e6), "total_mb": round(total / 1e6)}
    if free >= DISK_LOW:
        return [ok("disk_space", "The disk has free space", evidence, **params)]
    full = free < DISK_FULL
    return [
        Finding(
            "disk_space",
            "failure" if full else "warning",
            "The disk of the data folder is full" if full else "The disk of the data folder is almost full",
            evidence,
            "Delete logs and recordings that are no longer needed, or free space otherwise.",
            advice="free_disk",
            params={**params, "full": full},
        )
    ]


def computer_busy(server: ServerRecord) -> list[Finding]:
    """Whether this process runs in time. If not, servos appear to respond late or not at all."""
    lag_s = server.lag_s
    evidence = f"hornbill ran up to {lag_s:.2f} s late in the last {WINDOW_S:.0f} s."
    params = {"lag_s": round(lag_s, 3), "over_s": WINDOW_S}
    if lag_s < BUSY_S:
        return [ok("computer_busy", "This computer is fast enough", evidence, **params)]
    return [
        Finding(
            "computer_busy",
            "failure" if lag_s >= OVERLOADED_S else "warning",
            "This computer is busy: servos may falsely appear late or offline",
            evidence,
            "Reduce the load of this computer, or use an adapter with a larger buffer.",
            advice="reduce_computer_load",
            params={**params},
        )
    ]


def view(server: ServerRecord) -> list[Finding]:
    """Whether the 3D view runs, if it was started."""
    if server.view_error is None:
        return []
    error = server.view_error()
    if error is None:
        return [ok("view", "The 3D view works", "It starts when a page shows it.")]
    return [
        Finding(
            "view",
            "warning",
            "The 3D view does not run",
            error,
            "See the log of the server. Everything else works.",
            advice="see_server_log",
            params={"error": error},
        )
    ]


CHECKS: Final = (database, disk_space, computer_busy, view)
