"""Owns Stop: torque off (or brake) written to every known servo at once, repeated until answered, and latched."""

import asyncio
import logging
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field

from hornbill.errors import HornbillError, Stopped
from hornbill.schema.catalog import Catalog
from hornbill.servo.asking import STOP, Asker
from hornbill.servo.counting import Spread
from hornbill.servo.hub import Change, Happened, Hub, ReadingChanged, StopChanged
from hornbill.servo.quenching import AGAIN_LATER_S, AGAIN_S, MODES, SOON, Quencher
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase
from hornbill.units import Instant, Uid

log = logging.getLogger(__name__)

SAME_S = 1.0
"""The page sends one press over its socket and over REST; within this time both are one stop."""

LOOK_S = 1.0
"""How often torque is taken again, while the latch is set, from a node nobody polls because it is not identified."""

LOOK_BRAKED_S = 0.33
"""The same with the brake: a third of the time-out (0x27) as delivered, which may let the brake go (section 4.19)."""

ANSWER_BOUNDS_S = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 1.0, 5.0)

NAMED_S = 1.0
"""Who has not confirmed after this long is named in an event."""


@dataclass(slots=True)
class Confirmation:
    """How stop went on one servo since `begun`; `ms` from the request to the servo's answer.

    `named`: somebody was told that it does not answer.
    """

    uid: Uid
    label: str
    begun: Instant
    ms: float | None = None
    named: bool = False

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
    named: bool = False

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


class Stop:
    """The latch and the tasks that carry it out. Needs no lease and waits for nothing.

    `known` gives every servo that may still be on the bus; `quiet` is called first and must cancel, before it
    returns, everything of ours that could still energise a servo; its answer is who is owed torque off.
    Nodes that may be servos (`suspects`) are written to as well, until they answer or it is known what they are;
    foreign nodes never are.
    """

    def __init__(
        self,
        asker: Asker,
        hub: Hub,
        base: TimeBase,
        catalog: Catalog,
        known: Callable[[], Iterable[Servo]],
        quiet: Callable[[], Collection[Servo]],
    ) -> None:
        self._asker = asker
        self._hub = hub
        self._base = base
        self._row = catalog.by_key["torque_mode"]
        self._known = known
        self._quiet = quiet
        self._quencher = Quencher(asker, self._row)
        self._tasks: dict[Uid | int, asyncio.Task[None]] = {}
        self._braking: dict[Uid, asyncio.Task[None]] = {}
        """Who keeps the brake from being let go by the servo's own time-out."""
        self.suspects: Callable[[], Collection[int]] = list[int]
        """Node ids that broadcast the Status of an actuator and are known neither as a servo nor as foreign."""
        self.imposing: Callable[[int], None] = lambda _node: None
        """Called before 0x20 is written to one of them."""
        self.on_pressed: Callable[[Latch], None] = lambda _latch: None
        """Called last, with every new latch. Must return at once."""
        self.on_cleared: Callable[[Latch, str], None] = lambda _latch, _by: None
        """Called last, with the latch that was cleared and who did. Must return at once."""
        self.latch: Latch | None = None
        self.presses = 0
        """How often somebody stopped, since the start; the same press by two roads is one."""
        self.answered = Spread(ANSWER_BOUNDS_S)
        """From the first write of a stop to the answer of each servo it is for."""
        self.bus_gone = False
        """The bus is lost: what is written leaves when it is back."""
        hub.listen(self._on_change)

    @property
    def latched(self) -> bool:
        """Whether motion waits for somebody to clear the stop."""
        return self.latch is not None

    def check(self) -> None:
        """Raises Stopped while the latch is set."""
        if self.latch is not None:
            raise Stopped(
                f"Stopped by {self.latch.by}. Nothing moves until the stop is cleared: DELETE /api/v1/stop.",
                mode=self.latch.mode,
            )

    def restore(self, mode: str, by: str, reason: str, at: Instant) -> None:
        """Be stopped as somebody stopped it before the server was restarted. Call it before a bus is joined.

        Nothing is sent: servos are stopped as they arrive.
        """
        text = "Pressed before the server was restarted."
        self.latch = Latch(mode, at, by, f"{reason.rstrip('.')}. {text}" if reason else text)
        text = f"Still stopped by {by}, from before the server was restarted. Torque goes {mode} on every servo found."
        self._hub.tell(Happened("warning", "stopped", text))

    def now(self, mode: str, by: str, reason: str) -> Latch:
        """Stop. The first frames leave on the next turn of the event loop; pressing again sends again.

        `mode` is "off" or "brake".
        """
        latch = self.latch
        waiting = {servo.uid for servo in self._quiet()}
        if latch is not None and (latch.mode, latch.by) == (mode, by) and self._base.now() - latch.at < SAME_S:
            self._go_on(latch, waiting)
            return latch
        self.latch = Latch(mode, self._base.now(), by, reason)
        self.presses += 1
        # who has not answered to an earlier stop is not let off because it has no node id just now
        waiting |= {uid for uid, task in self._tasks.items() if isinstance(uid, str) and not task.done()}
        self._end_tasks()
        servos = [servo for servo in self._known() if servo.node_id is not None or servo.uid in waiting]
        for servo in servos:
            self._begin(servo, self.latch)
        for node in self.suspects():
            self._begin_node(node, self.latch)
        self._hub.tell(StopChanged())
        text = f"Stopped by {by}. Torque goes {mode} on every servo."
        if self.bus_gone:
            text = (
                f"Stopped by {by}, but the bus is lost: torque goes {mode} on every servo as soon as it is back. "
                "Cut the supply of what can move until then."
            )
        self._hub.tell(Happened("failure", "stopped", text))
        self.on_pressed(self.latch)
        return self.latch

    def _go_on(self, latch: Latch, waiting: Collection[Uid]) -> None:
        """The same press, by its other road: send again at once, and keep the times of the first."""
        for servo in self._known():
            if servo.node_id is not None or servo.uid in waiting:
                self._begin(servo, latch, anew=False)
        for node in self.suspects():
            self._begin_node(node, latch)

    def hurry(self) -> None:
        """Ask at once, and often, whoever has not answered yet: the bus is back, or a servo is."""
        self._quencher.hurry()

    def let_go(self, servo: Servo) -> None:
        """Somebody takes this servo's brake off by name: it is not put on again by itself."""
        held = self._braking.pop(servo.uid, None)
        if held is not None:
            held.cancel()

    def on_arrival(self, servo: Servo) -> None:
        """A servo that comes back while the latch is set is stopped too: it may have started with torque on."""
        self.hurry()
        if self.latch is not None:
            self._begin(servo, self.latch)
            if servo.node_id is not None:
                self.latch.nodes.pop(servo.node_id, None)
            self._hub.tell(StopChanged())

    def on_suspect(self, node: int) -> None:
        """A node that may be a servo is there: while the latch is set it is stopped before it is identified."""
        if self.latch is not None and node not in self.latch.nodes:
            self._begin_node(node, self.latch)
            self._hub.tell(StopChanged())

    def _on_change(self, change: Change) -> None:
        """Somebody else turned torque on, or a restart too quick to be noticed did: not while the latch is set."""
        if self.latch is None or not isinstance(change, ReadingChanged) or change.key != self._row.key:
            return
        task = self._tasks.get(change.uid)
        servo = next((one for one in self._known() if one.uid == change.uid), None)
        if servo is not None and servo.raw(self._row.key) == 0 and (task is None or task.done()):
            self._begin(servo, self.latch)
            self._hub.tell(StopChanged())

    def clear(self, by: str) -> None:
        """Unlatch. Moves and turns on nothing; a servo that has not answered yet is written to until it does."""
        if self.latch is None:
            return
        open_ones = ", ".join(one.label for one in self.latch.unconfirmed())
        latch, self.latch = self.latch, None
        self._end_braking()
        self._hub.tell(StopChanged())
        text = f"Stop cleared by {by}. Torque stays off until turned on."
        if open_ones:
            text += f" Not confirmed: {open_ones}. Torque may still be on there; it is turned off when it answers."
        self._hub.tell(Happened("warning" if open_ones else "notice", "stop_cleared", text))
        self.on_cleared(latch, by)

    async def confirmed(self, within_s: float) -> None:
        """Answer when every servo has confirmed, or after that time."""
        tasks = [task for task in self._tasks.values() if not task.done()]
        if tasks:
            await asyncio.wait(tasks, timeout=within_s)

    async def close(self) -> None:
        """End the repetitions; the latch stays as it is."""
        tasks = [*self._tasks.values(), *self._braking.values()]
        self._end_tasks()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _end_tasks(self) -> None:
        for task in self._tasks.values():
            task.cancel()
        self._tasks.clear()
        self._end_braking()

    def _end_braking(self) -> None:
        for task in self._braking.values():
            task.cancel()
        self._braking.clear()

    def _begin(self, servo: Servo, latch: Latch, *, anew: bool = True) -> None:
        if anew or servo.uid not in latch.servos:
            latch.servos[servo.uid] = one = Confirmation(servo.uid, servo.title, self._base.now())
            self._name_later(latch, one)
        self.let_go(servo)
        old = self._tasks.pop(servo.uid, None)
        if old is not None:
            old.cancel()
        self._tasks[servo.uid] = asyncio.get_running_loop().create_task(self._quench_servo(servo, latch))

    def _begin_node(self, node: int, latch: Latch) -> None:
        one = latch.nodes.get(node)
        if one is None:
            one = latch.nodes[node] = NodeConfirmation(node, self._base.now())
            self._name_later(latch, one)
        old = self._tasks.pop(node, None)
        if old is not None:
            old.cancel()
        self._tasks[node] = asyncio.get_running_loop().create_task(self._quench_node(one, latch))

    def _name_later(self, latch: Latch, one: Confirmation | NodeConfirmation) -> None:
        asyncio.get_running_loop().call_at(one.begun + NAMED_S, self._name_silent, latch)

    def _name_silent(self, latch: Latch) -> None:
        """Name everybody who should have confirmed by now, in one event."""
        due = self._base.now() - NAMED_S + 0.001
        silent = [one for one in latch.unconfirmed() if one.begun <= due and not one.named]
        if latch is not self.latch or not silent:
            return
        for one in silent:
            one.named = True
        text = f"No answer to the stop from {', '.join(one.label for one in silent)}. Torque may still be on there; "
        text += "it is written until they answer. If they can move, cut their supply."
        only = silent[0] if len(silent) == 1 else None
        self._hub.tell(Happened("failure", "no_answer", text, only.uid if isinstance(only, Confirmation) else None))

    def _confirm(self, latch: Latch, one: Confirmation | NodeConfirmation) -> None:
        if one.ms is None:
            one.ms = round((self._base.now() - latch.at) * 1000, 2)
            self.answered.add(self._base.now() - one.begun)
        if one.named:
            one.named = False
            uid = one.uid if isinstance(one, Confirmation) else None
            self._hub.tell(Happened("notice", "stopped_late", f"{one.label} has answered: torque {latch.mode}.", uid))
        if latch is self.latch:
            self._hub.tell(StopChanged())

    async def quench(self, servo: Servo, mode: str) -> None:
        """Write `mode` into 0x20 of one servo, again and again until it answers that it holds it."""
        await self._quencher.quench(servo, mode)

    async def _quench_servo(self, servo: Servo, latch: Latch) -> None:
        await self._quencher.quench(servo, latch.mode)
        self._confirm(latch, latch.servos[servo.uid])
        if latch.mode == "brake" and latch is self.latch:
            self._braking[servo.uid] = asyncio.get_running_loop().create_task(
                self._quencher.keep_braked(servo, lambda: latch is self.latch)
            )

    async def _quench_node(self, one: NodeConfirmation, latch: Latch) -> None:
        """Write the latch's mode into 0x20 of a node that may be a servo, for as long as it may be one.

        Until it answers, latch or no latch; after that now and then while the latch is set: it may have started anew.
        """
        wanted, tries, node = MODES[latch.mode], 0, one.node_id
        look = LOOK_BRAKED_S if latch.mode == "brake" else LOOK_S
        while node in self.suspects():
            if one.confirmed and latch is not self.latch:
                return
            held = False
            self.imposing(node)
            try:
                held = await self._asker.impose(node, self._row, wanted, STOP) == wanted
            except HornbillError as error:
                log.debug("node %d: torque %s: %s", node, latch.mode, error.detail)
            except Exception:  # whatever it is, the node still has to be stopped
                log.exception("node %d: torque %s", node, latch.mode)
            if held:
                self._confirm(latch, one)
            tries = 0 if held else tries + 1
            await asyncio.sleep(look if held else AGAIN_S if tries <= SOON else AGAIN_LATER_S)
        # From here on it is stopped as the servo it is, left alone as a foreign node, or gone.
        latch.nodes.pop(node, None)
        if latch is self.latch:
            self._hub.tell(StopChanged())
