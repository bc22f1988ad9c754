"""The lease: one client at a time has motion control, while it sends heartbeats."""

import math
import secrets
from collections import Counter
from dataclasses import dataclass

from hornbill.errors import Busy, LeaseHeld, LeaseRequired, Unknown
from hornbill.servo.runtime.actor import acting, signed
from hornbill.units import Instant


@dataclass(slots=True)
class HeldLease:
    """The right to move servos. Expires `ttl_s` seconds after the last heartbeat."""

    id: str
    holder: str
    ttl_s: float
    expires_at: Instant

    @property
    def shown_id(self) -> str:
        """First quarter of the ID, visible to all clients. Distinguishes leases but does not allow their use."""
        return self.id[:8]


class Leases:
    """The one lease: who has it, and whether they may move and write. Depends on `now` only; has no timer.

    Take and end leases through `servo/motion/motion_control.py`, which also switches torque off and audits.
    """

    def __init__(self) -> None:
        self._lease: HeldLease | None = None
        self._expired_unseen: list[HeldLease] = []
        self.promised_to: str | None = None
        """Client that requested the next lease. Until it gets it, no other client does."""
        self.counts: Counter[str] = Counter()
        """Leases taken, released, revoked or expired since the start."""

    def current(self, now: Instant) -> HeldLease | None:
        """The valid lease, or None."""
        lease = self._lease
        return lease if lease is not None and lease.expires_at > now else None

    def grant(self, holder: str, ttl_s: float, now: Instant) -> HeldLease:
        """A new lease. Raises LeaseHeld while a client has one, and Busy while it is promised to one."""
        held = self.current(now)
        if held is not None:
            raise self._held(held, now)
        if self.promised_to is not None:
            raise Busy(
                f"Motion control is being passed to {self.promised_to}, who requested it. Try again in 1 s.",
                cause="control_transfer_pending",
                by=self.promised_to,
            )
        return self._new(holder, ttl_s, now, ttl_s)

    def hand_over(self, holder: str, ttl_s: float, now: Instant, *, grace_s: float) -> HeldLease:
        """A new lease for the client it was promised to, once the previous one has ended.

        Before its first renewal it lasts at least `grace_s`. Raises LeaseHeld.
        """
        held = self.current(now)
        if held is not None:
            raise self._held(held, now)
        self.promised_to = None
        return self._new(holder, ttl_s, now, max(ttl_s, grace_s))

    def revoke(self, now: Instant) -> HeldLease | None:
        """End the current lease, if any, and return it: torque must go off on everything commanded under it."""
        lease = self.current(now)
        if lease is not None:
            self._lease = None
            self.counts["revoked"] += 1
        return lease

    def renew(self, lease_id: str, now: Instant) -> HeldLease:
        """Extend the lease to `ttl_s` from now. Raises Unknown(unknown_lease) once it has ended."""
        lease = self.current(now)
        if lease is None or not _is(lease, lease_id):
            raise Unknown(
                "unknown_lease",
                "This lease has ended. Take a new one.",
                cause="lease_ended",
            )
        lease.expires_at = now + lease.ttl_s
        return lease

    def release(self, lease_id: str, now: Instant) -> HeldLease:
        """End the lease. Raises Unknown(unknown_lease)."""
        lease = self.renew(lease_id, now)
        self._lease = None
        self.counts["released"] += 1
        return lease

    def expired(self, now: Instant) -> HeldLease | None:
        """The next expired lease, each returned once, even if another has been granted since. None if there is none."""
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
        """The valid lease with this ID, required for motion. Raises LeaseRequired or LeaseHeld."""
        lease = self.current(now)
        if lease is not None and _is(lease, lease_id):
            return lease
        if lease is not None:
            raise self._held(lease, now)
        if lease_id is None:
            raise LeaseRequired("Motion requires a valid lease.", cause="lease_missing")
        raise LeaseRequired(
            "This lease has ended, and torque is off on the servos it commanded. Take a new one.", cause="lease_ended"
        )

    def allow_write(self, lease_id: str | None, now: Instant) -> None:
        """Parameters can be written without a lease, except while another client has it. Raises LeaseHeld."""
        lease = self.current(now)
        if lease is not None and not _is(lease, lease_id):
            raise self._held(lease, now)

    def who(self, lease_id: str | None, now: Instant) -> str:
        """Name for the audit: the holder of this lease while valid, else the token, else "no lease"."""
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
            f"{lease.holder} has motion control for {max(1, math.ceil(left))} s more. Request it, or wait.",
            cause="lease_held_by_other",
            holder=lease.holder,
            expires_in_s=round(left, 3),
        )


def _is(lease: HeldLease, lease_id: str | None) -> bool:
    """Compared as bytes, because non-ASCII text would raise instead of matching no lease."""
    return lease_id is not None and secrets.compare_digest(lease.id.encode(), lease_id.encode(errors="replace"))
