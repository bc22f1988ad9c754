"""Motor output of one servo: on or off, why and since when; and which 0x20 is configuration, not session state.

Stop, the end of a lease and manual switching write 0x20 in RAM. None of these changes the configuration, which is the
value in ROM unless a client staged another one.
"""

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, TypeAlias

from hornbill.units import Instant, Raw

KEY: Final = "torque_mode"
"""Parameter 0x20 (section 4.13)."""

TIMEOUT_ACTION: Final = "timeout_action"
TIMEOUT_TIME: Final = "timeout_time"
ROWS: Final = frozenset((KEY, TIMEOUT_ACTION, TIMEOUT_TIME))
"""Rows that decide the state of the output: 0x20, and the timeout of 0x26 and 0x27."""

ON: Final[Raw] = 0
MODES: Final[dict[str, Raw]] = {"off": 1, "brake": 2}
"""Values of 0x20 that disable torque (section 4.13). ON (0) is not among them."""

State: TypeAlias = Literal["on", "off", "brake", "unknown"]
Reason: TypeAlias = Literal["configured", "stop", "lease", "command", "timeout", "protection"]

STATES: Final[dict[Raw, State]] = {0: "on", 1: "off", 2: "brake"}
"""States by the value of 0x20, which 0x26 shares."""

SESSION: Final = frozenset[Reason](("stop", "lease", "command"))
"""Reasons for which a session, not the servo or its configuration, switched an output."""

LATE_S: Final = 0.1
"""A timeout is assumed to have occurred this long after its time, because the last command may have arrived late."""


def off_mode(raw: Raw | None) -> str:
    """Name of a value of 0x20 that disables torque; "off" for any other value."""
    return next((word for word, number in MODES.items() if number == raw), "off")


def mode_text(mode: str) -> str:
    """Name of a mode in text: "torque off" or "brake"."""
    return "torque off" if mode == "off" else "brake"


class OutputState(NamedTuple):
    """State of the motor output, its reason, who switched it and since when (each None if unknown)."""

    state: State
    reason: Reason
    by: str | None
    since: Instant | None


@dataclass(slots=True)
class OutputRecord:
    """Who last switched the output of one servo, and why. Its register has the value of 0x20.

    `staged`: the 0x20 that a client set as configuration since the servo started, None if none did.
    `last_configured`: the last value while no session had switched it, also from before a restart.
    """

    reason: Reason = "configured"
    by: str | None = None
    since: Instant | None = None
    staged: Raw | None = None
    last_configured: Raw | None = None
    commanded_at: Instant | None = None
    """Time of the last command since the servo started. The timeout (0x27) runs from then (section 4.19)."""
    timed_out_at: Instant | None = None
    protected_at: Instant | None = None
    disable_count: int = 0
    """Times this server disabled the output or began to. Pending work that would enable it checks this first."""
    _pending: tuple[Raw, Reason, str | None] | None = None

    def switch(self, raw: Raw, reason: Reason, by: str | None) -> None:
        """Announce a write of 0x20, its reason and author. They apply once the servo reports the value."""
        self._pending = raw, reason, by
        self.disable_count += raw != ON

    def seen(self, raw: Raw, at: Instant, *, changed: bool) -> None:
        """Process a reported value of 0x20. An unannounced change was made by another tool."""
        new, meant = changed or self.since is None, self._pending
        if meant is not None and meant[0] == raw:
            self._pending = None
            if new:
                _, self.reason, self.by = meant
        elif changed and self.since is not None:
            self.reason, self.by = "command", None
        if new:
            self.since = at
        if self.reason == "configured":
            self.last_configured = raw

    def stage(self, raw: Raw, by: str | None, at: Instant) -> None:
        """Record a value of 0x20 that a client set as configuration."""
        self.staged = self.last_configured = raw
        self.reason, self.by, self.since = "configured", by, at

    def restore_reason(self, found: "OutputRecord") -> None:
        """Restore the reason from `found`, a copy from before, because the changes since were undone."""
        self.reason, self.by, self.since = found.reason, found.by, found.since

    def commanded(self, at: Instant) -> None:
        """Note that the servo was, or may have been, commanded: its timeout restarts, and the output comes back."""
        self.commanded_at, self.timed_out_at = at, None

    def check_timeout(self, now: Instant, after_s: float) -> bool:
        """Whether its timeout (0x27, seconds) has just disabled the output. Call often."""
        at = self.commanded_at
        if at is None or self.timed_out_at is not None or now < at + after_s + LATE_S:
            return False
        self.timed_out_at = at + after_s
        return True

    def set_protected(self, on: bool, at: Instant) -> None:
        """Note whether the servo itself has its output off, according to its fault words."""
        if on != (self.protected_at is not None):
            self.protected_at = at if on else None

    def restarted(self) -> None:
        """Reset after a restart of the servo: its output is as configured, unless it is switched before it is read."""
        self.reason, self.by, self.since, self.staged = "configured", None, None, None
        self.commanded_at = self.timed_out_at = self.protected_at = None
