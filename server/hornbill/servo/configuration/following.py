"""Follows one servo through silence, restart, another node ID and soft start, and reads back its ROM."""

import asyncio
import contextlib
from collections.abc import Coroutine, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from hornbill.domain.fields import known
from hornbill.errors import DidNotMove, NoResponse, Refused
from hornbill.servo.configuration.forecast import ARRIVED_DEG
from hornbill.servo.configuration.proving import not_saved
from hornbill.servo.device import identification
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.requests import POLL
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.runtime.hub import ReadingChanged, ServoChanged, StopChanged
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.steps import Evidence
from hornbill.servo.torque_off.stop import StopControl
from hornbill.units import Instant, NodeId, Raw
from hornbill.wire.services import MAGIC

RESTART_WITHIN_S = 45.0
"""Silence after a save is about 0.05 s, a restart and a new node id take up to about 4 s. The rest is for whoever
pulled the plug and puts it back, and for lost messages: with a fifth of them lost, a node id takes 4 to 42 s."""

IDENTIFIED_WITHIN_S = 40.0
"""Reading every row after a restart takes 0.1 s, or 20 s when a fifth of all frames is lost."""

RUNS_ON_S = 3.0
"""A servo that has been heard for this long without restarting is not about to: what was sent to it is over."""

OLD_ENOUGH_S = 2
"""Uptime a servo must have reached before it is sent into a restart: a younger one's uptime, told in whole seconds,
could not prove that it started anew."""

RESTART_TRIES = 4
"""Times a restart is asked for, each only after the servo was heard for RUNS_ON_S without one: what was lost on the
bus was never carried out, so this repeats nothing."""

SOFT_START_WITHIN_S = 15.0
"""180 degrees at 30 rpm take 1 s. A horn that is not there by then is blocked."""

LOOK_AGAIN_S = 0.02

PROVED_WITHIN_S = 2 * RESTART_WITHIN_S + 5
"""A servo that fails again while it is read back is waited for so long in all."""

ANOTHER_STATUS_S = 1.5
"""A NodeStatus comes once a second: when ROM seems wrong, it is waited for, because it would tell of a restart in the
middle of the reading."""

T = TypeVar("T")


@dataclass(slots=True)
class Departure:
    """A servo as it was when something was sent that restarts it, and the longest it was not heard since."""

    boots: int
    node_id: NodeId | None
    at: Instant
    heard: Instant
    silence: tuple[Instant, Instant]


class RestartFollower:
    """What save, restart and factory reset share. Sends only reads and RestartNode, the latter not while stopped."""

    def __init__(self, services: HostServices, stop: StopControl, fleet: Fleet) -> None:
        self._requests = services.requests
        self._hub = services.hub
        self._base = services.base
        self.stop = stop
        self.fleet = fleet

    async def unless_stopped(self, work: Coroutine[Any, Any, T]) -> T:
        """Do what sends something, and drop it in the very call that presses stop, before the first frame of stop.

        Raises Stopped then; what had left already has left.
        """
        task = asyncio.get_running_loop().create_task(work)

        def look(_change: StopChanged) -> None:
            if self.stop.latched:
                task.cancel()

        look(StopChanged())
        forget = self._hub.listen(look, StopChanged)
        try:
            return await task
        except asyncio.CancelledError:
            if not asyncio.current_task().cancelling():  # pyright: ignore[reportOptionalMemberAccess]
                self.stop.check()
            raise
        finally:
            forget()

    async def old_enough(self, servo: Servo) -> None:
        """Wait until a restart could be told from its uptime."""
        until = self._base.now() + OLD_ENOUGH_S + 2
        while servo.status is not None and servo.status.uptime_sec < OLD_ENOUGH_S:
            if self._base.now() > until:
                return
            await asyncio.sleep(LOOK_AGAIN_S)

    def depart(self, servo: Servo) -> Departure:
        """Call it right before what restarts the servo is sent."""
        now = self._base.now()
        heard = _heard(servo) or now
        return Departure(servo.boots, servo.node_id, now, heard, (heard, heard))

    async def left(self, servo: Servo, departure: Departure) -> bool:
        """Wait for what tells: True once a start is seen, False when the servo runs on for RUNS_ON_S from now.

        Raises NoResponse when neither is seen within RESTART_WITHIN_S.
        """
        began = self._base.now()
        while servo.boots == departure.boots:
            self._listen(servo, departure)
            waited = self._base.now() - began
            since = None if servo.status_at is None or not servo.online else servo.status_at - began
            if waited > RUNS_ON_S and since is not None and since > RUNS_ON_S - 1.0:
                return False
            if waited > RESTART_WITHIN_S:
                raise NoResponse(
                    f"{servo.title} was not seen to restart within {RESTART_WITHIN_S:.0f} s. "
                    "What ROM holds is not known. Check its supply; once it is back, what it holds is read.",
                    cause="no_restart_seen",
                    servo=servo.title,
                    within_s=RESTART_WITHIN_S,
                )
            await asyncio.sleep(LOOK_AGAIN_S)
        self._listen(servo, departure)
        return True

    async def ask(self, servo: Servo, departure: Departure) -> int:
        """Have it restart, and see it do so: how often it had to be asked.

        Raises Stopped, Refused, BusDisconnected, and NoResponse when it is not seen to.
        """
        for tries in range(1, RESTART_TRIES + 1):
            servo.writes_are_over()
            try:
                if not await self.unless_stopped(self._requests.restart(servo, MAGIC)):
                    raise Refused(
                        f"{servo.title} refused to restart (ok = 0).", cause="restart_refused", servo=servo.title
                    )
            except NoResponse:
                pass  # it may have restarted before it could answer; the wait that follows decides
            if await self.left(servo, departure):
                return tries
        raise NoResponse(
            f"{servo.title} runs on, although it was asked {RESTART_TRIES} times to restart.",
            cause="runs_on",
            servo=servo.title,
            tries=RESTART_TRIES,
        )

    def silence(self, departure: Departure) -> Evidence:
        """The silence as evidence: from when to when after the write nothing was heard."""
        begun, ended = (max(0.0, at - departure.at) for at in departure.silence)
        text = f"nothing heard from {begun:.2f} s to {ended:.2f} s after it was sent ({ended - begun:.2f} s)"
        return Evidence("silent", text, {"from_s": round(begun, 2), "to_s": round(ended, 2)})

    async def back(self, servo: Servo, departure: Departure) -> Evidence:
        """Wait for the servo to be identified, on whatever node id: the evidence, which names both.

        Raises NoResponse when it is not within IDENTIFIED_WITHIN_S.
        """
        servo.busy = State.RESTARTING
        self._hub.tell(ServoChanged(servo.uid))
        began = self._base.now()
        while not servo.identified or not servo.online:
            if self._base.now() - began > IDENTIFIED_WITHIN_S:
                raise NoResponse(
                    f"{servo.title} restarted, but could not be read within {IDENTIFIED_WITHIN_S:.0f} s since. "
                    "What ROM holds is not known. Check its supply and the wiring.",
                    cause="unread_after_restart",
                    servo=servo.title,
                    within_s=IDENTIFIED_WITHIN_S,
                )
            await asyncio.sleep(LOOK_AGAIN_S)
        before, now = departure.node_id, servo.node_id
        after_s = self._base.now() - departure.at
        took = f"identified {after_s:.1f} s after it was sent"
        text = f"node {now}, as before, {took}" if now == before else f"node {before} → node {now}, {took}"
        values = known(node_id=now, node_id_before=before, after_s=round(after_s, 1))
        return Evidence("back_on_node", text, values)

    async def soft_start_over(self, servo: Servo) -> Evidence | None:
        """Wait for the end of soft start: the evidence, None when there is none. Raises DidNotMove if it is blocked."""
        if not servo.soft_starting:
            return None
        began = self._base.now()
        while servo.soft_starting:
            if servo.registers["torque_mode"].written and servo.raw("torque_mode") != 0:
                return Evidence("soft_start_aborted", "ended, for torque was taken away")
            if self._base.now() - began > SOFT_START_WITHIN_S:
                raise DidNotMove(
                    f"The horn of {servo.title} does not come to 0° in its soft start, so what ROM holds of speed and "
                    "torque cannot be read. Look whether it is blocked, then restart the servo.",
                    cause="soft_start_stuck",
                    servo=servo.title,
                )
            with contextlib.suppress(NoResponse, Refused):  # what Status says is no angle until its unit is measured
                row = servo.registers["current_angle"].parameter
                angle = await self._requests.read(servo, row, POLL) / row.per_unit
                if servo.soft_starting and abs(angle) <= ARRIVED_DEG:
                    self.fleet.near_zero(servo, self._base.now())
            await asyncio.sleep(LOOK_AGAIN_S)
        angle = "" if servo.angle_deg is None else f", horn at {servo.angle_deg:+.1f}°"
        took_s = self._base.now() - began
        values = known(took_s=round(took_s, 1), angle_deg=servo.angle_deg)
        return Evidence("soft_start_over", f"over after {took_s:.1f} s{angle}", values)

    def seen(self, job: RunningJob, departure: Departure, evidence: Evidence) -> None:
        """End the steps silence and restart of a servo that was seen to start anew."""
        if next(step.state for step in job.steps if step.name == "silence") != "running":
            job.begin("silence")
        job.done("silence", self.silence(departure))
        job.begin("restart")
        job.done("restart", evidence)

    async def prove(
        self, job: RunningJob, servo: Servo, departure: Departure, rows: list[str], wanted: Mapping[str, Raw | None]
    ) -> None:
        """`read_back`; what was found is stored, also when it is not as wanted."""
        try:
            await self.read_back(job, servo, departure, rows, wanted)
        finally:
            if servo.boots != departure.boots and servo.identified:
                self.fleet.remember(servo)
                self.publish_rows(servo)

    def publish_rows(self, servo: Servo) -> None:
        """Publish that every row may have another value."""
        for key in servo.registers:
            self._hub.tell(ReadingChanged(servo.uid, key))

    async def read_back(
        self, job: RunningJob, servo: Servo, departure: Departure, rows: list[str], wanted: Mapping[str, Raw | None]
    ) -> None:
        """Steps back, soft_start and read_back of a servo that was seen to start anew: then ROM is known.

        Raises NoResponse, BusDisconnected; ConfigurationLost or NotAsWanted when ROM does not hold `wanted`, and Stopped
        when only stop kept that from being proved.
        """
        until, looked_twice = self._base.now() + PROVED_WITHIN_S, False
        while True:
            if self._base.now() > until:
                raise NoResponse(
                    f"{servo.title} starts again and again, so what its ROM holds is not known. Check its supply.",
                    cause="restarts_repeatedly",
                    servo=servo.title,
                )
            job.begin("back")
            job.done("back", await self.back(servo, departure))
            boots = servo.boots
            try:
                await self._soft_start_step(job, servo)
                job.begin("read_back")
                await identification.read_rows(self._requests, servo, rows)
            except NoResponse:
                if self._base.now() > until:
                    raise
                continue  # its power may have failed again: it is followed once more
            if servo.boots != boots or not servo.identified:
                continue
            identification.learn_rom(servo, soft_start=False)
            wrong = [key for key, raw in wanted.items() if servo.registers[key].rom != raw]
            if wrong and not looked_twice:
                looked_twice = True
                await asyncio.sleep(ANOTHER_STATUS_S)
                continue  # read once more, too: soft start may have been at its very end
            break
        if wrong:
            raise not_saved(servo, wanted, wrong, stopped=self.stop.latched)
        if wanted:
            evidence = Evidence("read_back", f"{len(wanted)} rows read back, all as saved", {"rows": len(wanted)})
        else:
            evidence = Evidence("all_rows_read", f"{len(rows)} rows read", {"rows": len(rows)})
        job.done("read_back", evidence)

    async def _soft_start_step(self, job: RunningJob, servo: Servo) -> None:
        job.begin("soft_start")
        evidence = await self.soft_start_over(servo)
        if evidence is None:
            text = "no soft start: it is off, or the servo started with torque off"
            job.skip("soft_start", Evidence("no_soft_start", text))
        else:
            job.done("soft_start", evidence)

    def _listen(self, servo: Servo, departure: Departure) -> None:
        heard = _heard(servo)
        if heard is None or heard <= departure.heard:
            return
        begun, ended = departure.silence
        if heard - departure.heard > ended - begun:
            departure.silence = departure.heard, heard
        departure.heard = heard


def _heard(servo: Servo) -> Instant | None:
    return max((at for at in (servo.status_at, servo.angle_at) if at is not None), default=None)
