"""One writer at a time, for as long as it keeps saying that it is there."""

import math
import secrets
from collections import Counter
from dataclasses import dataclass

from hornbill.errors import Busy, LeaseHeld, LeaseRequired, Unknown
from hornbill.servo.runtime.actor import acting, signed
from hornbill.units import Instant


@dataclass(slots=True)
class HeldLease:
    """The right to move servos. It lasts `ttl_s` seconds from the last sign of life."""

    id: str
    holder: str
    ttl_s: float
    expires_at: Instant

    @property
    def shown_id(self) -> str:
        """A quarter of the id, for everybody: it tells leases apart and lets nobody use one."""
        return self.id[:8]


class Leases:
    """The one lease: who has it, and whether they may move and write. A function of what is asked and `now`; no timer.

    Programs take and end leases through `servo/motion/motion_control.py`, which takes torque off and audits.
    """

    def __init__(self) -> None:
        self._lease: HeldLease | None = None
        self._expired_unseen: list[HeldLease] = []
        self.promised_to: str | None = None
        """Who gets the next lease, because it was asked for: nobody else does meanwhile."""
        self.counts: Counter[str] = Counter()
        """Leases that were taken, released, taken away, or lapsed, since the start."""

    def current(self, now: Instant) -> HeldLease | None:
        """The live lease, or None."""
        lease = self._lease
        return lease if lease is not None and lease.expires_at > now else None

    def grant(self, holder: str, ttl_s: float, now: Instant) -> HeldLease:
        """A new lease. Raises LeaseHeld while somebody has one, and Busy while it is promised to somebody."""
        held = self.current(now)
        if held is not None:
            raise self._held(held, now)
        if self.promised_to is not None:
            raise Busy(
                f"Motion control is passing to {self.promised_to}, who asked for it. Try again in a second.",
                cause="control_transfer_pending",
                by=self.promised_to,
            )
        return self._new(holder, ttl_s, now, ttl_s)

    def hand_over(self, holder: str, ttl_s: float, now: Instant, *, grace_s: float) -> HeldLease:
        """A new lease for whom it was promised to, when nobody has one any more.

        It lasts `grace_s` at least until it is renewed for the first time. Raises LeaseHeld.
        """
        held = self.current(now)
        if held is not None:
            raise self._held(held, now)
        self.promised_to = None
        return self._new(holder, ttl_s, now, max(ttl_s, grace_s))

    def revoke(self, now: Instant) -> HeldLease | None:
        """End whatever lease there is. The answer is who had it: what it commanded must be let go."""
        lease = self.current(now)
        if lease is not None:
            self._lease = None
            self.counts["revoked"] += 1
        return lease

    def renew(self, lease_id: str, now: Instant) -> HeldLease:
        """Another `ttl_s` from now. Raises Unknown(unknown_lease) once it has ended: ask for a new one."""
        lease = self.current(now)
        if lease is None or not _is(lease, lease_id):
            raise Unknown(
                "unknown_lease",
                "This lease has ended. Ask for a new one.",
                cause="lease_ended",
            )
        lease.expires_at = now + lease.ttl_s
        return lease

    def release(self, lease_id: str, now: Instant) -> HeldLease:
        """Give it back. Raises Unknown(unknown_lease)."""
        lease = self.renew(lease_id, now)
        self._lease = None
        self.counts["released"] += 1
        return lease

    def expired(self, now: Instant) -> HeldLease | None:
        """A lease that has run out unseen, each one once, also when another has been granted since."""
        if self._expired_unseen:
            self.counts["expired"] += 1
            return self._expired_unseen.pop(0)
        lease = self._lease
        if lease is None or lease.expires_at > now:
            return None
        self._lease = None
        self.counts["expired"] += 1
        return lease

    def require(self, lease_id: str | None, now: Instant) -> HeldLease:
        """The live lease of whoever wants to move something. Raises LeaseRequired or LeaseHeld."""
        lease = self.current(now)
        if lease is not None and _is(lease, lease_id):
            return lease
        if lease is not None:
            raise self._held(lease, now)
        if lease_id is None:
            raise LeaseRequired("Motion needs a live lease.", cause="lease_missing")
        raise LeaseRequired(
            "This lease has ended, and torque is off on what it commanded. Ask for a new one.", cause="lease_ended"
        )

    def allow_write(self, lease_id: str | None, now: Instant) -> None:
        """Parameters need the lease only while somebody else holds it. Raises LeaseHeld."""
        lease = self.current(now)
        if lease is not None and not _is(lease, lease_id):
            raise self._held(lease, now)

    def who(self, lease_id: str | None, now: Instant) -> str:
        """Who does it, for the audit: the holder of that lease while it lives, else the token, else "no lease"."""
        lease = self.current(now)
        return signed(lease.holder) if lease is not None and _is(lease, lease_id) else acting() or "no lease"

    def _new(self, holder: str, ttl_s: float, now: Instant, first_s: float) -> HeldLease:
        if self._lease is not None:
            self._expired_unseen.append(self._lease)
        self.counts["taken"] += 1
        self._lease = HeldLease(secrets.token_hex(16), holder, ttl_s, now + first_s)
        return self._lease

    @staticmethod
    def _held(lease: HeldLease, now: Instant) -> LeaseHeld:
        left = lease.expires_at - now
        return LeaseHeld(
            f"{lease.holder} has motion control for {max(1, math.ceil(left))} s more. Ask for it, or wait.",
            cause="lease_held_by_other",
            holder=lease.holder,
            expires_in_s=round(left, 3),
        )


def _is(lease: HeldLease, lease_id: str | None) -> bool:
    """Compared as bytes: texts other than ASCII would raise instead of being no lease."""
    return lease_id is not None and secrets.compare_digest(lease.id.encode(), lease_id.encode(errors="replace"))
