"""Retries torque off (or brake) until the servo acknowledges: for Stop, an ended lease, a lost bus or a save."""

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final

from hornbill.errors import HornbillError
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.output import KEY, MODES, Reason, mode_text
from hornbill.servo.device.requests import STOP, RetryPolicy, ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Hub, LogEvent, ServoChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Raw, Uid

log = logging.getLogger(__name__)

LATER: Final = replace(STOP, timeout_s=0.25, tries=4)
OFFLINE: Final = replace(STOP, timeout_s=1.0, tries=1)
"""Policies after `FAST_S`, for a servo that is online, and for one that is offline, which may be switched off.

A late response counts while its request has tries left: within 0.4 s with STOP, within 1 s with these."""

FAST_S: Final = 0.5
"""Time from an order, or from the return of the bus or a servo, within which requests with the policy STOP begin."""

REPORT_S: Final = 10.0
"""An order other than a stop not acknowledged for this time is reported once as a failure; retries continue."""

REWRITE_S: Final = 1.0
"""Interval at which a latched stop writes again to an unidentified node, which is not polled."""

REWRITE_BRAKE_S: Final = 0.33
"""The same for the brake: a third of the factory timeout (0x27), which may release the brake (section 4.19)."""

MAX_REWRITE_S: Final = 60.0
MIN_REWRITE_S: Final = 0.02
_OFF: Final[Raw] = 1


@dataclass(slots=True, eq=False)
class TorqueOffOrder:
    """Torque off or brake for a servo, or for a node ID that may be one, with reason and author.

    `settled` is done at the first acknowledgement, or when the order is cancelled. `reported`: whether it was reported
    as unacknowledged. `fast_until`: end of the time in which requests begin with the policy STOP. `waiting`: whether it
    is in a pause or an infrequent try, which `retry_now` ends.
    """

    to: Servo | int
    mode: str
    reason: Reason
    by: str | None
    since: Instant
    on_acknowledged: Callable[[], None] | None
    persistent: Callable[[], bool]
    on_gone: Callable[[], None]
    settled: asyncio.Future[None] = field(default_factory=lambda: asyncio.get_running_loop().create_future())
    task: asyncio.Task[None] | None = None
    reported: bool = False
    fast_until: Instant = 0.0
    waiting: bool = False

    @property
    def key(self) -> Uid | int:
        """The unique ID of the servo, or the node ID."""
        return self.to if isinstance(self.to, int) else self.to.uid


class TorqueOffRetries:
    """One order per servo, written with the priority of Stop ahead of all queues, even across a lost or changed bus.

    An order ends when the servo acknowledges. A command under a lease cancels it, unless it belongs to a stop.
    """

    def __init__(self, requests: ServoRequests, hub: Hub, base: TimeBase, fleet: Fleet) -> None:
        self._requests = requests
        self._hub = hub
        self._base = base
        self._fleet = fleet
        self._row = fleet.catalog.by_key[KEY]
        self._orders: dict[Uid | int, TorqueOffOrder] = {}

    def servos(self) -> list[Servo]:
        """Servos that have not acknowledged an order other than a stop."""
        pending = (one for one in self._orders.values() if one.reason != "stop" and not one.settled.done())
        return [one.to for one in pending if isinstance(one.to, Servo)]

    def pending(self, to: Uid | int) -> bool:
        """Whether this servo or node has not acknowledged yet, even for a stop that was cleared."""
        order = self._orders.get(to)
        return order is not None and not order.settled.done()

    def pending_servos(self) -> set[Uid]:
        """Servos that have not acknowledged yet."""
        return {key for key in self._orders if isinstance(key, str) and self.pending(key)}

    def order(
        self,
        to: Servo | int,
        mode: str,
        reason: Reason,
        by: str | None,
        *,
        on_acknowledged: Callable[[], None] | None = None,
        persistent: Callable[[], bool] = lambda: False,
        on_gone: Callable[[], None] = lambda: None,
    ) -> None:
        """Write `mode` (off or brake) from the next turn of the event loop on, replacing any earlier order.

        `on_acknowledged` is called on every acknowledgement. While `persistent`, the brake of a servo and the torque
        mode of a node are rewritten periodically. `on_gone` is called when the node no longer counts as a servo.
        """
        order = TorqueOffOrder(to, mode, reason, by, self._base.now(), on_acknowledged, persistent, on_gone)
        self.cancel(order.key)
        self._orders[order.key] = order
        self._start(order)

    def require(self, servo: Servo, reason: Reason, by: str | None, mode: str = "off") -> None:
        """As `order`, but keeps a pending order: a brake holds what torque off would drop."""
        old = self._orders.get(servo.uid)
        if old is None:
            self.order(servo, mode, reason, by)
            asyncio.get_running_loop().call_later(REPORT_S, self._report, self._orders[servo.uid])
        elif old.settled.done():
            self.order(
                servo, old.mode, old.reason, old.by, on_acknowledged=old.on_acknowledged, persistent=old.persistent
            )

    async def write(self, servo: Servo, mode: str, reason: Reason, by: str | None, *, retry: bool) -> Raw:
        """Write `mode` now, with ten tries, and return the acknowledged value.

        `retry`: if that fails, retry until it acknowledges. Raises NoResponse, Refused, BusDisconnected.
        """
        servo.output.switch(MODES[mode], reason, by)
        try:
            return await self._requests.write(servo, self._row, MODES[mode], STOP)
        except (HornbillError, asyncio.CancelledError):
            if retry:
                self.require(servo, reason, by, mode)
            raise

    def cancel_for_command(self, uid: Uid) -> None:
        """Cancel the order for a servo that is commanded again, unless it belongs to a stop."""
        order = self._orders.get(uid)
        if order is not None and order.reason != "stop":
            self.cancel(uid)

    def release_brake(self, uid: Uid) -> None:
        """Stop rewriting the brake of an acknowledged stop, to release this servo."""
        if not self.pending(uid):
            self.cancel(uid)

    def cancel(self, to: Uid | int) -> None:
        """End the order for a servo or node, if there is one."""
        order = self._orders.pop(to, None)
        if order is not None:
            self._settle(order)
            if order.task is not None:
                order.task.cancel()

    def cancel_all(self) -> None:
        """End every order."""
        for to in list(self._orders):
            self.cancel(to)

    def retry_now(self) -> None:
        """Retry all pending orders immediately and at short intervals, because the bus or a servo is back."""
        for order in self._orders.values():
            order.fast_until = self._base.now() + FAST_S
            if order.waiting:
                self._start(order)

    async def acknowledged(self, within_s: float) -> None:
        """Wait until all orders are acknowledged, but at most this time, s."""
        waiting = [one.settled for one in self._orders.values() if not one.settled.done()]
        if waiting:
            await asyncio.wait(waiting, timeout=within_s)

    def report_pending(self) -> None:
        """Report the servos that have not acknowledged, each once. Stops are reported by StopControl."""
        for order in self._orders.values():
            self._report(order)

    async def close(self) -> None:
        """End every order and wait for their tasks."""
        tasks = [one.task for one in self._orders.values() if one.task is not None]
        self.cancel_all()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _report(self, order: TorqueOffOrder) -> None:
        if order.reported or order.settled.done() or order.reason == "stop" or isinstance(order.to, int):
            return
        order.reported = True
        text = f"{order.to.title} has not acknowledged {mode_text(order.mode)}. It is repeated until acknowledged."
        params: dict[str, object] = {"servos": [order.to.title], "mode": order.mode}
        text += " If the servo can move, cut its supply."
        self._hub.publish(LogEvent("failure", "no_response", text, order.to.uid, params))

    @staticmethod
    def _settle(order: TorqueOffOrder) -> None:
        if not order.settled.done():
            order.settled.set_result(None)

    def _start(self, order: TorqueOffOrder) -> None:
        """Write an order from the next turn of the event loop on, ending the try in progress."""
        if order.task is not None:
            order.task.cancel()
        order.task = asyncio.get_running_loop().create_task(self._write(order))

    async def _write(self, order: TorqueOffOrder) -> None:
        try:
            while True:
                if isinstance(order.to, Servo):
                    order.to.output.switch(MODES[order.mode], order.reason, order.by)
                order.fast_until = self._base.now() + FAST_S
                while True:
                    if order.settled.done() and not order.persistent():
                        return
                    if isinstance(order.to, int) and order.to not in self._fleet.suspects():
                        order.on_gone()
                        return
                    if await self._try(order):
                        break
                self._acknowledged(order)
                if not await self._needed_again(order):
                    return
        finally:
            if order.task is asyncio.current_task():
                self._settle(order)
                if self._orders.get(order.key) is order:
                    del self._orders[order.key]

    async def _try(self, order: TorqueOffOrder) -> bool:
        """Send one request. True if acknowledged; otherwise returns at least one timeout after it began."""
        began, policy = self._base.now(), self._policy(order)
        order.waiting = policy is not STOP
        try:
            if not self._requests.silent and await self._request(order, policy):
                order.waiting = False
                return True
        except HornbillError as error:
            log.debug("%s: torque %s: %s", order.key, order.mode, error.detail)
        except Exception:  # whatever the error, the servo must still be stopped
            log.exception("%s: torque %s", order.key, order.mode)
        pause = began + self._policy(order).timeout_s - self._base.now()
        if pause > 0:
            order.waiting = True
            await asyncio.sleep(pause)
        return False

    async def _request(self, order: TorqueOffOrder, policy: RetryPolicy) -> bool:
        """Write the mode. True if acknowledged.

        While a servo is offline, another node may use its node ID and respond instead: that does not count.
        """
        wanted = MODES[order.mode]
        if isinstance(order.to, int):
            self._fleet.torque_written(order.to)
            single = replace(policy, tries=1)  # before the next try, the node may have been identified
            return await self._requests.write_to_node(order.to, self._row, wanted, single) == wanted
        if await self._requests.write(order.to, self._row, wanted, policy) != wanted:
            return False
        if not order.to.online:
            order.fast_until = self._base.now()
        return order.to.online

    def _policy(self, order: TorqueOffOrder) -> RetryPolicy:
        if self._requests.silent:
            return OFFLINE
        if self._base.now() < order.fast_until:
            return STOP
        return OFFLINE if isinstance(order.to, Servo) and not order.to.online else LATER

    def _acknowledged(self, order: TorqueOffOrder) -> None:
        if order.on_acknowledged is not None:
            order.on_acknowledged()
        elif isinstance(order.to, Servo):
            if order.reported:
                order.reported = False
                text = f"{order.to.title} acknowledged {mode_text(order.mode)}."
                params: dict[str, object] = {"servo": order.to.title, "mode": order.mode}
                self._hub.publish(LogEvent("notice", "torque_off", text, order.to.uid, params))
            self._hub.publish(ServoChanged(order.to.uid))
        self._settle(order)

    async def _needed_again(self, order: TorqueOffOrder) -> bool:
        """Wait until an acknowledged order must be written again. False if it need not be.

        A node may have restarted. The brake is rewritten at a third of the servo's timeout (0x27): section 4.19 does
        not exclude that the timeout releases a brake, and 0x20 counts as a command. With 0x26 at off, the timeout could
        drop what the brake holds. Writing 2 energises nothing.
        """
        while order.persistent():
            if isinstance(order.to, int):
                await asyncio.sleep(REWRITE_BRAKE_S if order.mode == "brake" else REWRITE_S)
                return order.to not in self._fleet.suspects() or order.persistent()
            if order.mode != "brake":
                return False
            timeout_s = (order.to.raw("timeout_time") or 1000) / 1000
            await asyncio.sleep(max(MIN_REWRITE_S, min(MAX_REWRITE_S, timeout_s / 3)))
            if order.persistent() and order.to.raw("timeout_action") in (None, _OFF):
                return True
        return False
