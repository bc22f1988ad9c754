"""Stop: torque off or the brake on every known servo at once, repeated until acknowledged, and latched."""

import asyncio
from collections.abc import Collection
from dataclasses import dataclass, field

from hornbill.domain.fields import known
from hornbill.domain.note import Note
from hornbill.errors import Stopped
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.output import KEY, ON
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
"""The page sends one press over its socket and over REST; within this time both are one stop."""

RESPONSE_BOUNDS_S = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 1.0, 5.0)

REPORT_S = 1.0
"""Who has not confirmed after this long is reported in an event."""


@dataclass(slots=True)
class Confirmation:
    """How stop went on one servo since `begun`; `ms` from the request to the servo's answer.

    `reported`: somebody was told that it does not answer.
    """

    uid: Uid
    label: str
    begun: Instant
    ms: float | None = None
    reported: bool = False

    @property
    def confirmed(self) -> bool:
        """Whether the servo said that its torque is off."""
        return self.ms is not None


@dataclass(slots=True)
class NodeConfirmation:
    """The same of a node that may be a servo and has not been identified."""

    node_id: int
    begun: Instant
    ms: float | None = None
    reported: bool = False

    @property
    def confirmed(self) -> bool:
        """Whether the node said that its torque is off."""
        return self.ms is not None

    @property
    def label(self) -> str:
        """What to call it in a sentence."""
        return f"node {self.node_id}"


@dataclass(slots=True)
class Latch:
    """One stop, from its request until somebody clears it."""

    mode: str
    at: Instant
    by: str
    reason: str
    servos: dict[Uid, Confirmation] = field(default_factory=dict[Uid, Confirmation])
    nodes: dict[int, NodeConfirmation] = field(default_factory=dict[int, NodeConfirmation])

    def unconfirmed(self) -> list[Confirmation | NodeConfirmation]:
        """Who has not said yet that its torque is off."""
        return [one for one in (*self.servos.values(), *self.nodes.values()) if not one.confirmed]


class StopControl:
    """The latch, and the orders that carry it out. Needs no lease and waits for nothing.

    Every servo that may still be on the bus is written to, and every node that may be one until it answers or it is
    known what it is; foreign nodes never are.
    """

    def __init__(self, services: HostServices, fleet: Fleet, retries: TorqueOffRetries) -> None:
        self._hub = services.hub
        self._base = services.base
        self._audit = services.audit
        self._fleet = fleet
        self._retries = retries
        self.latch: Latch | None = None
        self.presses = 0
        """How often somebody stopped, since the start; the same press by two roads is one."""
        self.response_times = Histogram(RESPONSE_BOUNDS_S)
        """From the first write of a stop to the answer of each servo it is for."""
        self._bus_gone = False
        self._hub.subscribe(self._on_reading, ReadingChanged)
        self._hub.subscribe(self._on_suspect, NodeSuspected)
        self._hub.subscribe(self._on_bus, BusUsable)

    @property
    def latched(self) -> bool:
        """Whether motion waits for somebody to clear the stop."""
        return self.latch is not None

    def check(self) -> None:
        """Raises Stopped while the latch is set."""
        if self.latch is not None:
            raise Stopped(
                f"Stopped by {self.latch.by}. Nothing moves until the stop is cleared.",
                mode=self.latch.mode,
                cause="stopped",
                by=self.latch.by,
            )

    def restore(self, mode: str, by: str, reason: str, at: Instant) -> None:
        """Be stopped as somebody stopped it before the server was restarted. Call it before a bus is joined.

        Nothing is sent: servos are stopped as they arrive.
        """
        text = "Pressed before the server was restarted."
        self.latch = Latch(mode, at, by, f"{reason.rstrip('.')}. {text}" if reason else text)
        text = f"Still stopped by {by}, from before the server was restarted. Torque goes {mode} on every servo found."
        self._hub.publish(LogEvent("warning", "stopped", text, params={"by": by, "mode": mode, "before_start": True}))

    def now(self, mode: str, by: str, reason: str) -> Latch:
        """Stop. The first frames leave on the next turn of the event loop; pressing again sends again.

        `mode` is "off" or "brake".
        """
        latch = self.latch
        waiting = {servo.uid for servo in self._retries.servos()}
        self._hub.publish(StopPressed())
        if latch is not None and (latch.mode, latch.by) == (mode, by) and self._base.now() - latch.at < SAME_PRESS_S:
            self._repeat(latch, waiting)
            return latch
        self.latch = latch = Latch(mode, self._base.now(), by, reason)
        self.presses += 1
        # who has not answered to an earlier stop is not let off because it has no node id just now
        waiting |= self._retries.pending_servos()
        self._retries.cancel_all()
        for servo in self._fleet.seen():
            if servo.node_id is not None or servo.uid in waiting:
                self._begin(servo, latch)
        for node in self._fleet.suspects():
            self._begin_node(node, latch)
        self._hub.publish(StopChanged())
        text = f"Stopped by {by}. Torque goes {mode} on every servo."
        if self._bus_gone:
            text = (
                f"Stopped by {by}, but the bus is lost: torque goes {mode} on every servo as soon as it is back. "
                "Cut the supply of what can move until then."
            )
        params: dict[str, object] = {"by": by, "mode": mode, "bus_lost": self._bus_gone}
        self._hub.publish(LogEvent("failure", "stopped", text, params=params))
        self._audit.later(self._retries.acknowledged(AUDITED_S), lambda: _pressed(latch))
        return latch

    def _repeat(self, latch: Latch, waiting: Collection[Uid]) -> None:
        """The same press, by its other road: send again at once, and keep the times of the first."""
        for servo in self._fleet.seen():
            if servo.node_id is not None or servo.uid in waiting:
                self._begin(servo, latch, restart=False)
        for node in self._fleet.suspects():
            self._begin_node(node, latch)

    def on_arrival(self, servo: Servo) -> None:
        """A servo that comes back while the latch is set is stopped too: it may have started with torque on."""
        self._retries.retry_now()
        if self.latch is not None:
            self._begin(servo, self.latch)
            if servo.node_id is not None:
                self.latch.nodes.pop(servo.node_id, None)
            self._hub.publish(StopChanged())

    def _on_suspect(self, suspected: NodeSuspected) -> None:
        """While the latch is set, a node that may be a servo is stopped before it is identified."""
        if self.latch is not None and suspected.node_id not in self.latch.nodes:
            self._begin_node(suspected.node_id, self.latch)
            self._hub.publish(StopChanged())

    def _on_reading(self, change: ReadingChanged) -> None:
        """Somebody else turned torque on, or a restart too quick to be noticed did: not while the latch is set."""
        if self.latch is None or change.key != KEY or self._retries.pending(change.uid):
            return
        servo = next((one for one in self._fleet.seen() if one.uid == change.uid), None)
        if servo is not None and servo.raw(KEY) == ON:
            self._begin(servo, self.latch)
            self._hub.publish(StopChanged())

    def _on_bus(self, change: BusUsable) -> None:
        self._bus_gone = not change.usable

    def clear(self, by: str) -> None:
        """Unlatch. Moves and turns on nothing; a servo that has not answered yet is written to until it does."""
        if self.latch is None:
            return
        unconfirmed = [one.label for one in self.latch.unconfirmed()]
        open_ones = ", ".join(unconfirmed)
        latch, self.latch = self.latch, None
        self._hub.publish(StopChanged())
        text = f"Stop cleared by {by}. Torque stays off until turned on."
        if open_ones:
            text += f" Not confirmed: {open_ones}. Torque may still be on there; it is turned off when it answers."
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
        """From here on it is stopped as the servo it is, left alone as a foreign node, or gone."""
        latch.nodes.pop(node, None)
        if latch is self.latch:
            self._hub.publish(StopChanged())

    def _report_later(self, latch: Latch, one: Confirmation | NodeConfirmation) -> None:
        asyncio.get_running_loop().call_at(one.begun + REPORT_S, self._report_silent, latch)

    def _report_silent(self, latch: Latch) -> None:
        """Name everybody who should have confirmed by now, in one event."""
        due = self._base.now() - REPORT_S + 0.001
        silent = [one for one in latch.unconfirmed() if one.begun <= due and not one.reported]
        if latch is not self.latch or not silent:
            return
        for one in silent:
            one.reported = True
        text = f"No answer to the stop from {', '.join(one.label for one in silent)}. Torque may still be on there; "
        text += "it is written until they answer. If they can move, cut their supply."
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
            text = f"{one.label} has answered: torque {latch.mode}."
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
    return Note(f"{count} of {len(every)} confirmed{within}.", "stop_confirmed", params)
