"""Output of one servo's motor: on or off, why, since when; and which 0x20 is configuration, not session state.

Stop, the end of a lease and whoever switches a servo by hand write RAM's 0x20. None of that is a change of its
configuration: ROM has what it is configured to, unless a client staged another value.
"""

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, TypeAlias

from hornbill.units import Instant, Raw

KEY: Final = "torque_mode"
"""Parameter 0x20 (section 4.13)."""

ON: Final[Raw] = 0
MODES: Final[dict[str, Raw]] = {"off": 1, "brake": 2}
"""Values of 0x20 that take the output away (section 4.13): 0 is ON and is not here."""

State: TypeAlias = Literal["on", "off", "brake", "unknown"]
Reason: TypeAlias = Literal["configured", "stop", "lease", "command", "timeout", "protection"]

STATES: Final[dict[Raw, State]] = {0: "on", 1: "off", 2: "brake"}
"""States by the value of 0x20, and by that of 0x26, which is the same."""

SESSION: Final = frozenset[Reason](("stop", "lease", "command"))
"""Reasons for which a session, and not the servo or its configuration, switched an output."""

LATE_S: Final = 0.1
"""A time-out is taken to have struck this long after its time: the last command may have arrived late."""


def off_mode(raw: Raw | None) -> str:
    """The word of a value of 0x20 that takes the output away; "off" for any other."""
    return next((word for word, number in MODES.items() if number == raw), "off")


class OutputState(NamedTuple):
    """What the motor gets, why, who did it (None: nobody known), and since when (None: not known)."""

    state: State
    reason: Reason
    by: str | None
    since: Instant | None


@dataclass(slots=True)
class OutputRecord:
    """What 0x20 of one servo was seen to hold is in its register; this is who made it so.

    `staged` is the 0x20 a client asked for as configuration in this life of the servo, None if none did;
    `last_configured` the value last seen or known while nobody had switched it, also before a restart.
    """

    reason: Reason = "configured"
    by: str | None = None
    since: Instant | None = None
    staged: Raw | None = None
    last_configured: Raw | None = None
    commanded_at: Instant | None = None
    """When it was last commanded in this life: the time of 0x27 runs from then (section 4.19)."""
    timed_out_at: Instant | None = None
    protected_at: Instant | None = None
    disable_count: int = 0
    """How often somebody here took it away, or began to: what waits to give it must not, when that happened since."""
    _pending: tuple[Raw, Reason, str | None] | None = None

    def switch(self, raw: Raw, reason: Reason, by: str | None) -> None:
        """Say who is about to write 0x20 and why; it counts once the servo is seen to hold it."""
        self._pending = raw, reason, by
        self.disable_count += raw != ON

    def seen(self, raw: Raw, at: Instant, *, changed: bool) -> None:
        """0x20 was read or answered. What nobody here asked for was switched by another tool."""
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
        """Take a value of 0x20 for configuration, because a client asked for it as such."""
        self.staged = self.last_configured = raw
        self.reason, self.by, self.since = "configured", by, at

    def restore_reason(self, found: "OutputRecord") -> None:
        """Be switched for the reason of `found`, a copy of before: what was done since has been undone."""
        self.reason, self.by, self.since = found.reason, found.by, found.since

    def commanded(self, at: Instant) -> None:
        """The servo was commanded, or may have been: its time-out runs from now, and what it took is given back."""
        self.commanded_at, self.timed_out_at = at, None

    def check_timeout(self, now: Instant, after_s: float) -> bool:
        """Whether its own time-out (0x27, seconds) has just taken its output; call it often."""
        at = self.commanded_at
        if at is None or self.timed_out_at is not None or now < at + after_s + LATE_S:
            return False
        self.timed_out_at = at + after_s
        return True

    def set_protected(self, on: bool, at: Instant) -> None:
        """The servo itself has its output off, or has it no longer off, for what its fault words tell."""
        if on != (self.protected_at is not None):
            self.protected_at = at if on else None

    def restarted(self) -> None:
        """The servo started anew: its output is as it is configured, unless it is switched before it is read."""
        self.reason, self.by, self.since, self.staged = "configured", None, None, None
        self.commanded_at = self.timed_out_at = self.protected_at = None
