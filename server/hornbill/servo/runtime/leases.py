"""Leases: each servo is under the motion control of at most one client, while it sends heartbeats."""

import math
import secrets
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass

from hornbill.errors import Busy, LeaseHeld, LeaseRequired, Unknown
from hornbill.servo.runtime.actor import acting, signed
from hornbill.units import Instant, Uid


@dataclass(slots=True)
class HeldLease:
    """The right to move servos: `uids`, or all if None. Expires `ttl_s` seconds after the last heartbeat."""

    id: str
    holder: str
    ttl_s: float
    expires_at: Instant
    uids: frozenset[Uid] | None = None

    def overlaps(self, uids: Collection[Uid] | None) -> bool:
        """Whether it covers any of these servos (None: all)."""
        return self.uids is None or uids is None or not self.uids.isdisjoint(uids)

    def covers(self, uids: Collection[Uid]) -> bool:
        """Whether it covers all of these servos."""
        return self.uids is None or self.uids.issuperset(uids)

    @property
    def shown_id(self) -> str:
        """First quarter of the ID, visible to all clients. Distinguishes leases but does not allow their use."""
        return self.id[:8]


class Leases:
    """The leases: who has them, and whether they may move and write. Depends on `now` only; has no timer.

    Leases that are valid at the same time cover different servos. Where `uids` is None, all servos are meant.

    Take and end leases through `servo/motion/motion_control.py`, which also switches torque off and audits.
    """

    def __init__(self) -> None:
        self._leases: dict[str, HeldLease] = {}
        """By ID. Expired leases remain until `expired` has returned them."""
        self.promised_to: str | None = None
        """Client that requested the next lease. Until it gets it, no other client does."""
        self.promised_uids: frozenset[Uid] | None = None
        """Servos of that lease. None: all."""
        self.counts: Counter[str] = Counter()
        """Leases taken, released, revoked or expired since the start."""

    def valid(self, now: Instant) -> list[HeldLease]:
        """All valid leases, oldest first."""
        return [lease for lease in self._leases.values() if lease.expires_at > now]

    def current(self, now: Instant, uids: Collection[Uid] | None = None) -> HeldLease | None:
        """The oldest valid lease that covers any of these servos, or None."""
        return next((lease for lease in self.valid(now) if lease.overlaps(uids)), None)

    def holders(self, now: Instant, uids: Collection[Uid] | None = None) -> str:
        """Names of the holders of the valid leases that cover any of these servos, oldest first. Empty if none."""
        return ", ".join(dict.fromkeys(lease.holder for lease in self.valid(now) if lease.overlaps(uids)))

    def find(self, lease_id: str | None, now: Instant) -> HeldLease | None:
        """The valid lease with this ID, or None."""
        return next((lease for lease in self.valid(now) if _is(lease, lease_id)), None)

    def grant(self, holder: str, ttl_s: float, now: Instant, uids: frozenset[Uid] | None = None) -> HeldLease:
        """A new lease. Raises LeaseHeld while a client has one of these servos, and Busy while one is promised."""
        self._check_free(now, uids)
        return self._new(holder, ttl_s, now, ttl_s, uids)

    def extend(self, lease_id: str, now: Instant, uids: Collection[Uid]) -> HeldLease:
        """Renew the lease and add servos to it. Raises Unknown(unknown_lease), and as `grant` if they are not free."""
        lease = self.find(lease_id, now)
        if lease is not None and not lease.covers(uids):
            self._check_free(now, uids, own=lease)
            lease.uids = frozenset(uids).union(lease.uids or ())
        return self.renew(lease_id, now)

    def hand_over(
        self, holder: str, ttl_s: float, now: Instant, *, grace_s: float, uids: frozenset[Uid] | None = None
    ) -> HeldLease:
        """A new lease for the client it was promised to, once the previous one has ended.

        Before its first renewal it lasts at least `grace_s`. Raises LeaseHeld.
        """
        self._check_others(now, uids)
        self.promised_to = self.promised_uids = None
        return self._new(holder, ttl_s, now, max(ttl_s, grace_s), uids)

    def revoke(self, now: Instant, uids: Collection[Uid] | None = None) -> HeldLease | None:
        """End a lease that covers any of these servos, and return it: torque must go off on everything commanded under
        it. None if there is none (any more).
        """
        lease = self.current(now, uids)
        if lease is not None:
            del self._leases[lease.id]
            self.counts["revoked"] += 1
        return lease

    def renew(self, lease_id: str, now: Instant) -> HeldLease:
        """Extend the lease to `ttl_s` from now. Raises Unknown(unknown_lease) once it has ended."""
        lease = self.find(lease_id, now)
        if lease is None:
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
        del self._leases[lease.id]
        self.counts["released"] += 1
        return lease

    def expired(self, now: Instant) -> HeldLease | None:
        """The next expired lease, each returned once, even if another has been granted since. None if there is none."""
        lease = next((lease for lease in self._leases.values() if lease.expires_at <= now), None)
        if lease is not None:
            del self._leases[lease.id]
            self.counts["expired"] += 1
        return lease

    def require(self, lease_id: str | None, now: Instant, *uids: Uid) -> HeldLease:
        """The valid lease with this ID, required for motion of these servos. Raises LeaseRequired or LeaseHeld."""
        lease = self.find(lease_id, now)
        if lease is not None and lease.covers(uids):
            return lease
        self._check_others(now, uids or None, own=lease)
        if lease is not None:
            missing = sorted(set(uids) - (lease.uids or set()))
            raise LeaseRequired(
                f"This lease does not cover {', '.join(missing)}. Take one that does.",
                cause="lease_does_not_cover",
                uids=missing,
            )
        if lease_id is None:
            raise LeaseRequired("Motion requires a valid lease.", cause="lease_missing")
        raise LeaseRequired(
            "This lease has ended, and torque is off on the servos it commanded. Take a new one.", cause="lease_ended"
        )

    def allow_write(self, lease_id: str | None, now: Instant, *uids: Uid) -> None:
        """Parameters can be written without a lease, except of servos under the lease of another client.

        Without `uids`: of any servo. Raises LeaseHeld.
        """
        self._check_others(now, uids or None, own=self.find(lease_id, now))

    def who(self, lease_id: str | None, now: Instant) -> str:
        """Name for the audit: the holder of this lease while valid, else the token, else "no lease"."""
        lease = self.find(lease_id, now)
        return signed(lease.holder) if lease is not None else acting() or "no lease"

    def _check_others(self, now: Instant, uids: Collection[Uid] | None, own: HeldLease | None = None) -> None:
        """Raises LeaseHeld if a valid lease other than `own` covers any of these servos (None: all)."""
        held = next((lease for lease in self.valid(now) if lease is not own and lease.overlaps(uids)), None)
        if held is not None:
            raise self._held(held, now)

    def _check_free(self, now: Instant, uids: Collection[Uid] | None, own: HeldLease | None = None) -> None:
        """As `_check_others`, and raises Busy if one of these servos is promised to a client."""
        self._check_others(now, uids, own)
        if self.promised_to is not None and (
            uids is None or self.promised_uids is None or not self.promised_uids.isdisjoint(uids)
        ):
            raise Busy(
                f"Motion control is being passed to {self.promised_to}, who requested it. Try again in 1 s.",
                cause="control_transfer_pending",
                by=self.promised_to,
            )

    def _new(self, holder: str, ttl_s: float, now: Instant, first_s: float, uids: frozenset[Uid] | None) -> HeldLease:
        self.counts["taken"] += 1
        lease = HeldLease(secrets.token_hex(16), holder, ttl_s, now + first_s, uids)
        self._leases[lease.id] = lease
        return lease

    @staticmethod
    def _held(lease: HeldLease, now: Instant) -> LeaseHeld:
        left = lease.expires_at - now
        return LeaseHeld(
            f"{lease.holder} has motion control{_of(lease)} for {max(1, math.ceil(left))} s more. Request it, or wait.",
            cause="lease_held_by_other",
            holder=lease.holder,
            expires_in_s=round(left, 3),
            **({} if lease.uids is None else {"uids": sorted(lease.uids)}),
        )


def _of(lease: HeldLease) -> str:
    return "" if lease.uids is None else f" of {', '.join(sorted(lease.uids))}"


def _is(lease: HeldLease, lease_id: str | None) -> bool:
    """Compared as bytes, because non-ASCII text would raise instead of matching no lease."""
    return lease_id is not None and secrets.compare_digest(lease.id.encode(), lease_id.encode(errors="replace"))
