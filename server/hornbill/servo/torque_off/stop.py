"""Stop: immediate torque off or brake on all known servos, repeated until acknowledged, and latched."""

import asyncio
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import Literal

from hornbill.domain.fields import known
from hornbill.domain.note import Note
from hornbill.errors import Stopped
from hornbill.node.role import ConnectionRole
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.output import KEY, ON, mode_text
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.audit import AUDITED_S
from hornbill.servo.runtime.histogram import Histogram
from hornbill.servo.runtime.hub import BusUsable, LogEvent, NodeSuspected, ReadingChanged, StopChanged, StopPressed
from hornbill.servo.torque_off.retries import TorqueOffRetries
from hornbill.store.audit import NewAuditEntry
from hornbill.units import Instant, Uid

_REASONS = {"stop_button": "Stop button", "esc_key": "Esc key", "space_key": "Space key"}

SAME_PRESS_S = 1.0
"""The page sends each press by WebSocket and by REST. Within this time, both count as one stop."""

RESPONSE_BOUNDS_S = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 1.0, 5.0)

REPORT_S = 1.0
"""Servos that have not acknowledged after this time are reported in an event."""


@dataclass(slots=True)
class Confirmation:
    """Stop on one servo, started at `begun`. `ms`: time from the request to the acknowledgement, None until then.

    `reported`: whether the missing acknowledgement was reported.
    """

    uid: Uid
    label: str
    begun: Instant
    ms: float | None = None
    reported: bool = False

    @property
    def confirmed(self) -> bool:
        """Whether the servo has acknowledged."""
        return self.ms is not None


@dataclass(slots=True)
class NodeConfirmation:
    """The same for an unidentified node that may be a servo."""

    node_id: int
    begun: Instant
    ms: float | None = None
    reported: bool = False

    @property
    def confirmed(self) -> bool:
        """Whether the node has acknowledged."""
        return self.ms is not None

    @property
    def label(self) -> str:
        """Name in text."""
        return f"node {self.node_id}"


@dataclass(slots=True)
class Latch:
    """A stop, from its request until it is cleared. `everyone`: also servos that a guest does not command."""

    mode: str
    at: Instant
    by: str
    reason: str
    everyone: bool = False
    servos: dict[Uid, Confirmation] = field(default_factory=dict[Uid, Confirmation])
    nodes: dict[int, NodeConfirmation] = field(default_factory=dict[int, NodeConfirmation])

    def unconfirmed(self) -> list[Confirmation | NodeConfirmation]:
        """Servos and nodes that have not acknowledged yet."""
        return [one for one in (*self.servos.values(), *self.nodes.values()) if not one.confirmed]


Reach = Literal["all", "own", "none"]
"""Servos that Stop reaches: all as host, those that hornbill commands as guest, none as observer."""


class StopControl:
    """The stop latch and its torque-off orders. Needs no lease and waits for nothing.

    As host, writes to every servo that may be on the bus, and to every node that may be a servo, until it acknowledges
    or is identified. As guest, only to servos that hornbill commands, unless all were requested: switching off the
    others would take them from the autopilot. As observer, to none. Never writes to foreign nodes.
    """

    def __init__(
        self,
        services: HostServices,
        fleet: Fleet,
        retries: TorqueOffRetries,
        role: Callable[[], ConnectionRole],
        own: Callable[[], Collection[Uid]],
    ) -> None:
        """`role` returns the role on the connected bus; `own`, the servos under command of this server."""
        self._hub = services.hub
        self._base = services.base
        self._audit = services.audit
        self._fleet = fleet
        self._retries = retries
        self._role = role
        self._own = own
        self.latch: Latch | None = None
        self.presses = 0
        """Number of stops since the start. One press received by both WebSocket and REST counts once."""
        self.response_times = Histogram(RESPONSE_BOUNDS_S)
        """Time from the first write of a stop to the acknowledgement of each servo."""
        self._bus_gone = False
        self._hub.subscribe(self._on_reading, ReadingChanged)
        self._hub.subscribe(self._on_suspect, NodeSuspected)
        self._hub.subscribe(self._on_bus, BusUsable)

    @property
    def latched(self) -> bool:
        """Whether motion is blocked until the stop is cleared."""
        return self.latch is not None

    def check(self) -> None:
        """Raises Stopped while the latch is set."""
        if self.latch is not None:
            raise Stopped(
                f"Stopped by {self.latch.by}. Motion is blocked until the stop is cleared.",
                mode=self.latch.mode,
                cause="stopped",
                by=self.latch.by,
            )

    @property
    def reach(self) -> Reach:
        """The servos that Stop reaches now."""
        match self._role():
            case ConnectionRole.HOST:
                return "all"
            case ConnectionRole.GUEST:
                return "all" if self.latch is not None and self.latch.everyone else "own"
            case ConnectionRole.OBSERVER:
                return "none"

    def own(self) -> set[Uid]:
        """Servos that Stop reaches as guest: those under command, and those that have not acknowledged yet."""
        return {*self._own(), *self._retries.pending_servos()}

    def reached(self) -> list[Uid]:
        """Online servos that a stop reaches now."""
        reach, own = self.reach, self.own()
        online = [one.uid for one in self._fleet.all() if one.online and not one.recorded]
        return [uid for uid in online if reach == "all" or (reach == "own" and uid in own)]

    def _reaches(self, uid: Uid) -> bool:
        """Whether the latched stop includes a servo that arrives or switches on."""
        return self.reach == "all" or (self.reach == "own" and self.latch is not None and uid in self.latch.servos)

    def restore(self, mode: str, by: str, reason: str, at: Instant, *, everyone: bool) -> None:
        """Restore a stop from before a restart of the server. Call before joining a bus.

        Sends nothing: servos are stopped as they arrive.
        """
        text = "Pressed before the server restarted."
        reason = f"{reason.rstrip('.')}. {text}" if reason else text
        self.latch = Latch(mode, at, by, reason, everyone)
        text = f"Still stopped by {by}, since before the server restarted. Every servo found is sent {mode_text(mode)}."
        self._hub.publish(LogEvent("warning", "stopped", text, params={"by": by, "mode": mode, "before_start": True}))

    def now(self, mode: str, by: str, reason: str, *, everyone: bool = False) -> Latch:
        """Stop with `mode` "off" or "brake". The first frames leave on the next turn of the event loop.

        Another press sends again. `everyone`: as guest, all servos on the bus.
        """
        latch = self.latch
        waiting = {servo.uid for servo in self._retries.servos()}
        own = self.own()
        self._hub.publish(StopPressed())
        same = latch is not None and (latch.mode, latch.by, latch.everyone) == (mode, by, everyone)
        if latch is not None and same and self._base.now() - latch.at < SAME_PRESS_S:
            self._order(latch, waiting, own | set(latch.servos), restart=False)
            return latch
        if latch is not None:
            own |= set(latch.servos)
        self.latch = latch = Latch(mode, self._base.now(), by, reason, everyone)
        self.presses += 1
        # a servo that has not acknowledged an earlier stop stays included, even without a node ID now
        waiting |= self._retries.pending_servos()
        self._retries.cancel_all()
        self._order(latch, waiting, own)
        self._hub.publish(StopChanged())
        text = f"Stopped by {by}. {self._sent(latch)}"
        if self._bus_gone and self.reach == "all":
            text = (
                f"Stopped by {by}, but the bus is lost. All servos are sent {mode_text(mode)} once it is back. "
                "Until then, cut the supply of servos that can move."
            )
        params: dict[str, object] = {"by": by, "mode": mode, "bus_lost": self._bus_gone}
        if self.reach != "all":
            params |= {"reach": self.reach, "servos": [one.label for one in latch.servos.values()]}
        self._hub.publish(LogEvent("failure", "stopped", text, params=params))
        self._audit.later(self._retries.acknowledged(AUDITED_S), lambda: _pressed(latch))
        return latch

    def _order(self, latch: Latch, waiting: Collection[Uid], own: Collection[Uid], *, restart: bool = True) -> None:
        """Order torque off for all servos in reach. Not `restart`: this is the same press, whose times are kept."""
        reach = self.reach
        for servo in self._fleet.seen() if reach != "none" else ():
            if (servo.node_id is not None or servo.uid in waiting) and (reach == "all" or servo.uid in own):
                self._begin(servo, latch, restart=restart)
        for node in self._fleet.suspects() if reach == "all" else ():
            self._begin_node(node, latch)

    def _sent(self, latch: Latch) -> str:
        """Text of what was sent to which servos."""
        mode = mode_text(latch.mode)
        match self.reach:
            case "all":
                return f"All servos are sent {mode}."
            case "own":
                names = ", ".join(one.label for one in latch.servos.values()) or "none, because it commands none"
                return f"As guest, hornbill sends {mode} only to servos that it commands: {names}."
            case "none":
                return "As observer, hornbill sends nothing. Cut the supply of servos that must not move."

    def on_arrival(self, servo: Servo) -> None:
        """Stop a servo that arrives while the latch is set: it may have started with torque on."""
        self._retries.retry_now()
        if self.latch is not None and self._reaches(servo.uid):
            self._begin(servo, self.latch)
            if servo.node_id is not None:
                self.latch.nodes.pop(servo.node_id, None)
            self._hub.publish(StopChanged())

    def _on_suspect(self, suspected: NodeSuspected) -> None:
        """Stop a node that may be a servo before it is identified, while the latch is set."""
        if self.latch is not None and self.reach == "all" and suspected.node_id not in self.latch.nodes:
            self._begin_node(suspected.node_id, self.latch)
            self._hub.publish(StopChanged())

    def _on_reading(self, change: ReadingChanged) -> None:
        """Stop a servo again if another tool or an unnoticed restart turned torque on while the latch is set."""
        if self.latch is None or change.key != KEY or self._retries.pending(change.uid):
            return
        if not self._reaches(change.uid):
            return
        servo = next((one for one in self._fleet.seen() if one.uid == change.uid), None)
        if servo is not None and servo.raw(KEY) == ON:
            self._begin(servo, self.latch)
            self._hub.publish(StopChanged())

    def _on_bus(self, change: BusUsable) -> None:
        self._bus_gone = not change.usable

    def clear(self, by: str) -> None:
        """Clear the latch. Moves nothing and turns nothing on. Pending orders continue until acknowledged."""
        if self.latch is None:
            return
        unconfirmed = [one.label for one in self.latch.unconfirmed()]
        open_ones = ", ".join(unconfirmed)
        latch, self.latch = self.latch, None
        self._hub.publish(StopChanged())
        text = f"Stop cleared by {by}. Torque stays off until turned on."
        if open_ones:
            text += f" Not acknowledged: {open_ones}. Torque may still be on; the stop is repeated until acknowledged."
        params: dict[str, object] = {"by": by, "unconfirmed": unconfirmed}
        self._hub.publish(LogEvent("warning" if open_ones else "notice", "stop_cleared", text, params=params))
        notes = (Note(f"Stop of {latch.by} cleared.", "stop_of", {"by": latch.by}), _confirmed(latch))
        self._audit.later(
            self._retries.acknowledged(AUDITED_S), lambda: NewAuditEntry(by, "stop", "cleared", notes=notes)
        )

    def _begin(self, servo: Servo, latch: Latch, *, restart: bool = True) -> None:
        if restart or servo.uid not in latch.servos:
            latch.servos[servo.uid] = one = Confirmation(servo.uid, servo.title, self._base.now())
            self._report_later(latch, one)
        one = latch.servos[servo.uid]
        self._retries.order(
            servo, latch.mode, "stop", latch.by,
            on_acknowledged=lambda: self._confirm(latch, one), persistent=lambda: latch is self.latch,
        )  # fmt: skip

    def _begin_node(self, node: int, latch: Latch) -> None:
        one = latch.nodes.get(node)
        if one is None:
            one = latch.nodes[node] = NodeConfirmation(node, self._base.now())
            self._report_later(latch, one)
        self._retries.order(
            node, latch.mode, "stop", latch.by,
            on_acknowledged=lambda: self._confirm(latch, one), persistent=lambda: latch is self.latch,
            on_gone=lambda: self._node_gone(latch, node),
        )  # fmt: skip

    def _node_gone(self, latch: Latch, node: int) -> None:
        """Remove a node that was identified (as a servo it is stopped separately) or has gone offline."""
        latch.nodes.pop(node, None)
        if latch is self.latch:
            self._hub.publish(StopChanged())

    def _report_later(self, latch: Latch, one: Confirmation | NodeConfirmation) -> None:
        asyncio.get_running_loop().call_at(one.begun + REPORT_S, self._report_silent, latch)

    def _report_silent(self, latch: Latch) -> None:
        """Report all servos and nodes with an overdue acknowledgement, in one event."""
        due = self._base.now() - REPORT_S + 0.001
        silent = [one for one in latch.unconfirmed() if one.begun <= due and not one.reported]
        if latch is not self.latch or not silent:
            return
        for one in silent:
            one.reported = True
        text = f"Stop not acknowledged by {', '.join(one.label for one in silent)}. Torque may still be on. "
        text += "The stop is repeated until acknowledged. If they can move, cut their supply."
        only = silent[0] if len(silent) == 1 else None
        params: dict[str, object] = {"servos": [one.label for one in silent], "stop": True}
        uid = only.uid if isinstance(only, Confirmation) else None
        self._hub.publish(LogEvent("failure", "no_response", text, uid, params))

    def _confirm(self, latch: Latch, one: Confirmation | NodeConfirmation) -> None:
        if one.ms is None:
            one.ms = round((self._base.now() - latch.at) * 1000, 2)
            self.response_times.add(self._base.now() - one.begun)
        if one.reported:
            one.reported = False
            uid = one.uid if isinstance(one, Confirmation) else None
            text = f"{one.label} acknowledged the stop: {mode_text(latch.mode)}."
            params: dict[str, object] = {"servo": one.label, "mode": latch.mode}
            self._hub.publish(LogEvent("notice", "stopped_late", text, uid, params))
        if latch is self.latch:
            self._hub.publish(StopChanged())


def reason_text(reason: str) -> str:
    """English text of a stop reason: the page sends codes, other clients send text."""
    return _REASONS.get(reason, reason)


def _pressed(latch: Latch) -> NewAuditEntry:
    notes = (_confirmed(latch),)
    if latch.reason:
        notes = (Note(f"{reason_text(latch.reason).rstrip('.')}.", "stop_reason", {"reason": latch.reason}), *notes)
    return NewAuditEntry(latch.by, "stop", "pressed", requested=latch.mode, notes=notes)


def _confirmed(latch: Latch) -> Note:
    every = [*latch.servos.values(), *latch.nodes.values()]
    took = max((one.ms for one in every if one.ms is not None), default=None)
    count = sum(one.confirmed for one in every)
    within = "" if took is None else f" within {took:.0f} ms"
    params = known(confirmed=count, of=len(every), within_ms=took)
    return Note(f"{count} of {len(every)} acknowledged{within}.", "stop_confirmed", params)
