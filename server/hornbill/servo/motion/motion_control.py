"""Motion control: taking, releasing, requesting, refusing and forcing it, and its expiry."""

import asyncio
import secrets
from collections import OrderedDict
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal

from hornbill.domain.event import LeaseEnd, LeaseEndCode, because
from hornbill.domain.fields import known
from hornbill.domain.note import Note
from hornbill.errors import Busy, InvalidValue, Unknown
from hornbill.servo.device.services import HostServices
from hornbill.servo.motion.motion import Motion
from hornbill.servo.runtime.audit import AUDITED_S
from hornbill.servo.runtime.hub import LeaseChanged, LogEvent
from hornbill.servo.runtime.leases import HeldLease
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Instant, Uid

PASS_S = 0.25
"""A lease passes once all servos of the previous holder have acknowledged torque off, or after this time. Torque off
has been written by then and is repeated until acknowledged."""

GRACE_S = 5.0
"""Minimum time before a requested lease must first be renewed, so that the requester can learn of it."""

REQUESTER_TIMEOUT_S = 5.0
"""A requester that does not poll its request for this time, or for a shorter timeout, is considered gone."""

MAX_STORED = 16
"""Ended requests that can still be polled."""

Outcome = Literal["waiting", "granted", "refused", "withdrawn"]
_Ended = Literal["lease_withdrawn", "lease_refused"]
_STATES: Final[Mapping[_Ended, Outcome]] = {"lease_withdrawn": "withdrawn", "lease_refused": "refused"}


@dataclass(slots=True)
class TakeOverRequest:
    """A request for motion control. Only the requester knows `id`; `shown_id` is visible to all clients."""

    by: str
    ttl_s: float
    reason: str
    timeout_s: float
    uids: frozenset[Uid] | None
    """Servos. None: all."""
    at: Instant
    seen_at: Instant
    state: Outcome = "waiting"
    lease: HeldLease | None = None
    id: str = field(default_factory=lambda: secrets.token_hex(16))
    shown_id: str = field(default_factory=lambda: secrets.token_hex(4))

    @property
    def due(self) -> Instant:
        """When the lease passes unless the holder refuses."""
        return self.at + self.timeout_s


class MotionControl:
    """Starts, ends and audits every lease (motion control, for users). `Leases` stores it and decides who may move and
    write.

    However a lease ends, torque goes off on everything commanded under it. Before a lease passes, torque off has been
    written.

    Nothing here delays Stop, which needs no lease.
    """

    def __init__(self, services: HostServices, motion: Motion) -> None:
        self._leases = services.leases
        self._hub = services.hub
        self._base = services.base
        self._audit = services.audit
        self._motion = motion
        self._requests: OrderedDict[str, TakeOverRequest] = OrderedDict()
        self._waiting: TakeOverRequest | None = None
        self._passing: asyncio.Task[Any] | None = None

    @property
    def waiting(self) -> TakeOverRequest | None:
        """The pending request, or None."""
        return self._waiting

    def take(self, holder: str, ttl_s: float, uids: frozenset[Uid] | None = None) -> HeldLease:
        """Take a lease of these servos (None: all) if they are free. Raises LeaseHeld, Busy."""
        lease = self._leases.grant(holder, ttl_s, self._base.now(), uids)
        self._hub.publish(LeaseChanged())
        self._audit_taken(lease)
        return lease

    def extend(self, lease_id: str, uids: Collection[Uid]) -> HeldLease:
        """Renew a lease and add servos to it if they are free. Raises Unknown, LeaseHeld, Busy."""
        before = self._leases.find(lease_id, self._base.now())
        covered = before is not None and before.covers(uids)
        lease = self._leases.extend(lease_id, self._base.now(), uids)
        self._hub.publish(LeaseChanged())
        if not covered:
            self._audit_taken(lease)
        return lease

    def release(self, lease_id: str, why: LeaseEndCode) -> HeldLease:
        """Release a lease: torque goes off on everything commanded under it. Raises Unknown once it has ended."""
        lease = self._leases.release(lease_id, self._base.now())
        self._ended(lease, LeaseEnd(why, lease.holder))
        return lease

    async def force(self, holder: str, ttl_s: float, reason: str, uids: frozenset[Uid] | None = None) -> HeldLease:
        """Take it by force. Raises InvalidValue without a reason, and Busy while it is being passed on."""
        if not reason.strip():
            raise InvalidValue(
                'Taking motion control by force requires a "reason", which is stored in the audit.',
                cause="force_without_reason",
            )
        if self._passing is not None:
            raise Busy(
                "Motion control is being passed on. Try again in 1 s.",
                cause="control_transfer_in_progress",
            )
        if self._leases.current(self._base.now(), uids) is None and self._waiting is None:
            return self.take(holder, ttl_s, uids)
        # A separate task: if cancelled halfway, no client would have control and nothing would be audited.
        task = self._passing = asyncio.get_running_loop().create_task(self._force(holder, ttl_s, reason.strip(), uids))
        return await asyncio.shield(task)

    async def request(
        self, by: str, ttl_s: float, reason: str, timeout_s: float, uids: frozenset[Uid] | None = None
    ) -> TakeOverRequest:
        """Request motion control from its holder. Granted immediately if there is none.

        Raises Busy while another request is pending.
        """
        if self._waiting is not None or self._passing is not None:
            who = "Another client" if self._waiting is None else self._waiting.by
            raise Busy(
                f"{who} has already requested motion control. Wait for the decision.",
                cause="already_requested",
                by=who,
            )
        now = self._base.now()
        request = TakeOverRequest(by, ttl_s, reason, timeout_s, uids, now, now)
        self._requests[request.id] = request
        while len(self._requests) > MAX_STORED:
            self._requests.popitem(last=False)
        held = self._leases.holders(now, uids)
        self._leases.promised_to, self._leases.promised_uids, self._waiting = by, uids, request
        if held:
            text = f"{by} requests motion control from {held}{because(reason)} "
            text += f"It passes in {timeout_s:g} s unless {held} refuses."
            params: dict[str, object] = {"by": by, "holder": held, "reason": reason, "timeout_s": timeout_s}
            self._hub.publish(LogEvent("notice", "lease_requested", text, params=params))
            self._hub.publish(LeaseChanged())
        await self.settle()
        return request

    async def settle(self) -> None:
        """Pass the lease on now if possible, and wait for it."""
        self.tick()
        if self._passing is not None:
            await asyncio.shield(self._passing)

    def get_request(self, request_id: str) -> TakeOverRequest:
        """State of a request, for the requester; also counts as its heartbeat. Raises Unknown."""
        request = self._requests.get(request_id)
        if request is None:
            raise Unknown(
                "unknown_lease",
                "This request no longer exists. Request again.",
                cause="control_request_not_found",
            )
        request.seen_at = self._base.now()
        return request

    def withdraw(self, request_id: str) -> TakeOverRequest:
        """Cancel a pending request. No effect if it was granted or refused. Raises Unknown."""
        request = self.get_request(request_id)
        self._end(request, "lease_withdrawn", f"{request.by} withdrew the request for motion control.")
        return request

    def refuse(self, shown_id: str, lease_id: str | None) -> TakeOverRequest:
        """Refuse a request as the holder. Raises LeaseRequired, LeaseHeld, Unknown."""
        lease = self._leases.require(lease_id, self._base.now())
        request = self._waiting
        if request is None or shown_id not in (request.shown_id, request.id) or not lease.overlaps(request.uids):
            raise Unknown("unknown_lease", "There is no pending request with this ID.", cause="no_pending_request")
        text = f"{lease.holder} refused the request of {request.by} for motion control."
        self._end(request, "lease_refused", text, holder=lease.holder)
        return request

    def tick(self) -> None:
        """Process expired leases and pending requests. Call at least every 50 ms."""
        self._end_expired()
        request = self._waiting
        if request is None or self._passing is not None:
            return
        now = self._base.now()
        if now - request.seen_at >= min(REQUESTER_TIMEOUT_S, request.timeout_s):
            self._end(
                request, "lease_withdrawn", f"{request.by} requested motion control but stopped responding.", gone=True
            )
        elif now >= request.due or self._leases.current(now, request.uids) is None:
            self._passing = asyncio.get_running_loop().create_task(self._pass(request))

    async def close(self) -> None:
        """Cancel a lease being passed on."""
        if self._passing is not None:
            self._passing.cancel()
            await asyncio.gather(self._passing, return_exceptions=True)

    async def _pass(self, request: TakeOverRequest) -> None:
        try:
            old = self._leases.holders(self._base.now(), request.uids)
            await self._end_current(LeaseEnd("passed", request.by), request.uids)
            if request.state != "waiting":
                return  # withdrawn meanwhile
            request.lease = self._leases.hand_over(
                request.by, request.ttl_s, self._base.now(), grace_s=GRACE_S, uids=request.uids
            )
            request.state, self._waiting = "granted", None
            self._publish_passed(request.lease, old, "passed", request.reason)
        finally:
            self._passing = None

    async def _force(self, holder: str, ttl_s: float, reason: str, uids: frozenset[Uid] | None) -> HeldLease:
        try:
            if self._waiting is not None:
                text = f"{holder} took motion control by force."
                self._end(self._waiting, "lease_refused", text, holder=holder, forced=True)
            old = self._leases.holders(self._base.now(), uids)
            await self._end_current(LeaseEnd("forced", holder, reason), uids)
            lease = self._leases.hand_over(holder, ttl_s, self._base.now(), grace_s=0.0, uids=uids)
            self._publish_passed(lease, old, "forced", reason)
            return lease
        finally:
            self._passing = None

    async def _end_current(self, why: LeaseEnd, uids: frozenset[Uid] | None) -> None:
        """End the leases of these servos, if any, and wait for torque off on everything commanded under them."""
        self._leases.promised_to, self._leases.promised_uids = why.holder, uids
        self._end_expired()
        while (old := self._leases.revoke(self._base.now(), uids)) is not None:
            self._ended(old, why)
        await self._motion.torque_off.acknowledged(PASS_S)

    def _end_expired(self) -> None:
        while (lease := self._leases.expired(self._base.now())) is not None:
            self._ended(lease, LeaseEnd("expired", lease.holder))

    def _ended(self, lease: HeldLease, why: LeaseEnd) -> None:
        """After a lease has ended, switch torque off on everything commanded under it, then publish and audit."""
        servos = self._motion.end_lease(lease)
        self._hub.publish(LeaseChanged())
        if servos:
            titles = [servo.title for servo in servos]
            text = f"{why.text} Torque goes off on {', '.join(titles)}."
            self._hub.publish(LogEvent("notice", "lease_ended", text, params={**why.params, "servos": titles}))
        outcome = "expired" if lease.expires_at <= self._base.now() else "released"
        note = Note(why.text, "lease_ended", why.params)
        self._audit_later(NewAuditEntry(lease.holder, "lease", outcome, notes=(note,)))

    def _end(self, request: TakeOverRequest, code: _Ended, text: str, **params: object) -> None:
        if request.state != "waiting":
            return
        request.state, self._waiting = _STATES[code], None
        self._leases.promised_to = self._leases.promised_uids = None
        self._hub.publish(LogEvent("notice", code, text, params={"by": request.by, **params}))
        self._hub.publish(LeaseChanged())

    def _publish_passed(self, lease: HeldLease, old: str, how: Literal["passed", "forced"], reason: str) -> None:
        """`old`: previous holders, empty if there was none."""
        self._hub.publish(LeaseChanged())
        verb = "took motion control by force" if how == "forced" else "took over motion control"
        whose = f" from {old}" if old else ""
        before = old or None
        text = f"{lease.holder} {verb}{whose}{because(reason)}"
        params: dict[str, object] = {**known(by=lease.holder, reason=reason or None, holder=before)}
        if how == "forced":
            self._hub.publish(LogEvent("warning", "lease_forced", text, params=params))
        else:
            self._hub.publish(LogEvent("notice", "lease_passed", text, params=params))
        notes = Note.words(reason)
        self._audit_later(NewAuditEntry(lease.holder, "lease", how, before=before, after=lease.holder, notes=notes))

    def _audit_taken(self, lease: HeldLease) -> None:
        names = [f"{uid[:8]}…" for uid in sorted(lease.uids or ())]
        servos: list[str | int | float] = [*names]
        of = f" of {', '.join(names)}" if names else ""
        text = f"Motion control{of} expires {lease.ttl_s:g} s after the last heartbeat."
        note = Note(text, "lease_taken", {"ttl_s": lease.ttl_s, **known(servos=servos or None)})
        self._audit.note(NewAuditEntry(lease.holder, "lease", "taken", notes=(note,)))

    def _audit_later(self, entry: NewAuditEntry) -> None:
        self._audit.later(asyncio.sleep(AUDITED_S), lambda: entry)
