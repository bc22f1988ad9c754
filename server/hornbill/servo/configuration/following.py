"""Following of one servo through silence, restart, node ID change and soft start, and read-back of its ROM."""

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
"""Silence after a save is about 0.05 s; a restart and a new node ID take up to about 4 s. The rest allows for a supply
that is unplugged and plugged in again, and for lost messages: with 20 % of them lost, a node ID takes 4 to 42 s."""

IDENTIFIED_WITHIN_S = 40.0
"""Reading every row after a restart takes 0.1 s, or 20 s if 20 % of all frames are lost."""

RUNS_ON_S = 3.0
"""A servo that has been seen for this long without a restart will not restart: the request was lost or ignored."""

OLD_ENOUGH_S = 2
"""Minimum uptime before a restart is requested. Uptime is reported in whole seconds, so a lower one could not prove a
restart."""

RESTART_TRIES = 4
"""Maximum number of restart requests. Each follows only after the servo ran on for RUNS_ON_S, so the previous request
was lost and nothing is carried out twice."""

SOFT_START_WITHIN_S = 15.0
"""180° at 30 rpm take 1 s. A horn that has not arrived by then is blocked."""

CHECK_PERIOD_S = 0.02

PROVED_WITHIN_S = 2 * RESTART_WITHIN_S + 5
"""Total time to wait for a servo that fails again during the read-back."""

ANOTHER_STATUS_S = 1.5
"""NodeStatus arrives once a second. If ROM differs, wait for the next one, which would reveal a restart during the
read."""

T = TypeVar("T")


@dataclass(slots=True)
class Departure:
    """State of a servo when a restarting request was sent, and its longest silence since."""

    boot_count: int
    node_id: NodeId | None
    at: Instant
    last_seen: Instant
    silence: tuple[Instant, Instant]


class RestartFollower:
    """Shared part of save, restart and factory reset. Sends only reads and, unless stopped, RestartNode."""

    def __init__(self, services: HostServices, stop: StopControl, fleet: Fleet) -> None:
        self._requests = services.requests
        self._hub = services.hub
        self._base = services.base
        self.stop = stop
        self.fleet = fleet

    async def unless_stopped(self, work: Coroutine[Any, Any, T]) -> T:
        """Run `work`, but cancel it as soon as stop is latched, before the first frame of stop is sent.

        Raises Stopped then. Frames already sent stay sent.
        """
        task = asyncio.get_running_loop().create_task(work)

        def check(_change: StopChanged) -> None:
            if self.stop.latched:
                task.cancel()

        check(StopChanged())
        unsubscribe = self._hub.subscribe(check, StopChanged)
        try:
            return await task
        except asyncio.CancelledError:
            if not asyncio.current_task().cancelling():  # pyright: ignore[reportOptionalMemberAccess]
                self.stop.check()
            raise
        finally:
            unsubscribe()

    async def old_enough(self, servo: Servo) -> None:
        """Wait until the uptime is high enough to prove a restart."""
        until = self._base.now() + OLD_ENOUGH_S + 2
        while servo.status is not None and servo.status.uptime_sec < OLD_ENOUGH_S:
            if self._base.now() > until:
                return
            await asyncio.sleep(CHECK_PERIOD_S)

    def depart(self, servo: Servo) -> Departure:
        """Record the state. Call it immediately before a request that restarts the servo."""
        now = self._base.now()
        last = _last_seen(servo) or now
        return Departure(servo.boot_count, servo.node_id, now, last, (last, last))

    async def left(self, servo: Servo, departure: Departure) -> bool:
        """Wait for the outcome: True once a restart is seen, False if the servo runs on for RUNS_ON_S from now.

        Raises NoResponse if neither is seen within RESTART_WITHIN_S.
        """
        began = self._base.now()
        while servo.boot_count == departure.boot_count:
            self._update_silence(servo, departure)
            waited = self._base.now() - began
            since = None if servo.status_at is None or not servo.online else servo.status_at - began
            if waited > RUNS_ON_S and since is not None and since > RUNS_ON_S - 1.0:
                return False
            if waited > RESTART_WITHIN_S:
                raise NoResponse(
                    f"No restart of {servo.title} was seen within {RESTART_WITHIN_S:.0f} s. "
                    "The contents of its ROM are unknown. Check its supply. Its values are read when it is back.",
                    cause="restart_not_seen",
                    servo=servo.title,
                    within_s=RESTART_WITHIN_S,
                )
            await asyncio.sleep(CHECK_PERIOD_S)
        self._update_silence(servo, departure)
        return True

    async def request_restart(self, servo: Servo, departure: Departure) -> int:
        """Request a restart until one is seen. Returns the number of requests.

        Raises Stopped, Refused, BusDisconnected, and NoResponse if no restart is seen.
        """
        for tries in range(1, RESTART_TRIES + 1):
            servo.clear_write_times()
            try:
                if not await self.unless_stopped(self._requests.restart(servo, MAGIC)):
                    raise Refused(
                        f"{servo.title} refused the restart (ok = 0).", cause="restart_refused", servo=servo.title
                    )
            except NoResponse:
                pass  # it may have restarted before it could respond; the following wait decides
            if await self.left(servo, departure):
                return tries
        raise NoResponse(
            f"{servo.title} did not restart after {RESTART_TRIES} requests. Turn its supply off and on.",
            cause="restart_ignored",
            servo=servo.title,
            tries=RESTART_TRIES,
        )

    def silence(self, departure: Departure) -> Evidence:
        """Evidence of the silence: start and end after the request."""
        begun, ended = (max(0.0, at - departure.at) for at in departure.silence)
        text = f"silent from {begun:.2f} s to {ended:.2f} s after the request ({ended - begun:.2f} s)"
        return Evidence("silent", text, {"from_s": round(begun, 2), "to_s": round(ended, 2)})

    async def back(self, servo: Servo, departure: Departure) -> Evidence:
        """Wait until the servo is identified on any node ID. The evidence contains both node IDs.

        Raises NoResponse after IDENTIFIED_WITHIN_S.
        """
        servo.busy = State.RESTARTING
        self._hub.publish(ServoChanged(servo.uid))
        began = self._base.now()
        while not servo.identified or not servo.online:
            if self._base.now() - began > IDENTIFIED_WITHIN_S:
                raise NoResponse(
                    f"{servo.title} restarted, but could not be read within {IDENTIFIED_WITHIN_S:.0f} s. "
                    "The contents of its ROM are unknown. Check its supply and wiring.",
                    cause="unread_after_restart",
                    servo=servo.title,
                    within_s=IDENTIFIED_WITHIN_S,
                )
            await asyncio.sleep(CHECK_PERIOD_S)
        before, now = departure.node_id, servo.node_id
        after_s = self._base.now() - departure.at
        took = f"identified {after_s:.1f} s after the request"
        text = f"node {now} (unchanged), {took}" if now == before else f"node {before} → node {now}, {took}"
        values = known(node_id=now, node_id_before=before, after_s=round(after_s, 1))
        return Evidence("back_on_node", text, values)

    async def soft_start_over(self, servo: Servo) -> Evidence | None:
        """Wait for the end of soft start. Returns None if there is none. Raises DidNotMove if the horn is blocked."""
        if not servo.soft_starting:
            return None
        began = self._base.now()
        while servo.soft_starting:
            if servo.registers["torque_mode"].written and servo.raw("torque_mode") != 0:
                return Evidence("soft_start_aborted", "aborted because torque was turned off")
            if self._base.now() - began > SOFT_START_WITHIN_S:
                raise DidNotMove(
                    f"The horn of {servo.title} was not seen at 0° for {SOFT_START_WITHIN_S:.0f} s, so soft start may "
                    "not have ended, and the ROM values of speed and torque cannot be read. Check whether the horn is "
                    "blocked, then restart the servo.",
                    cause="soft_start_stuck",
                    servo=servo.title,
                )
            with contextlib.suppress(NoResponse, Refused):  # Status gives no angle until its unit is measured
                row = servo.registers["current_angle"].parameter
                angle = await self._requests.read(servo, row, POLL) / row.per_unit
                if servo.soft_starting and abs(angle) <= ARRIVED_DEG:
                    self.fleet.near_zero(servo, self._base.now())
            await asyncio.sleep(CHECK_PERIOD_S)
        angle = "" if servo.angle_deg is None else f", horn at {servo.angle_deg:+.1f}°"
        took_s = self._base.now() - began
        values = known(took_s=round(took_s, 1), angle_deg=servo.angle_deg)
        return Evidence("soft_start_over", f"finished after {took_s:.1f} s{angle}", values)

    def seen(self, job: RunningJob, departure: Departure, evidence: Evidence) -> None:
        """Complete the steps silence and restart."""
        if next(step.state for step in job.steps if step.name == "silence") != "running":
            job.begin("silence")
        job.done("silence", self.silence(departure))
        job.begin("restart")
        job.done("restart", evidence)

    async def prove(
        self, job: RunningJob, servo: Servo, departure: Departure, rows: list[str], wanted: Mapping[str, Raw | None]
    ) -> None:
        """Run `read_back`, and store the values read even if they differ from `wanted`."""
        try:
            await self.read_back(job, servo, departure, rows, wanted)
        finally:
            if servo.boot_count != departure.boot_count and servo.identified:
                self.fleet.remember(servo)
                self.publish_rows(servo)

    def publish_rows(self, servo: Servo) -> None:
        """Publish a possible change of every row."""
        for key in servo.registers:
            self._hub.publish(ReadingChanged(servo.uid, key))

    async def read_back(
        self, job: RunningJob, servo: Servo, departure: Departure, rows: list[str], wanted: Mapping[str, Raw | None]
    ) -> None:
        """Steps back, soft_start and read_back of a restarted servo. Afterwards its ROM is known.

        Raises NoResponse, BusDisconnected; ConfigurationLost or UnexpectedResult if ROM differs from `wanted`; and
        Stopped if only a stop prevented the verification.
        """
        until, looked_twice = self._base.now() + PROVED_WITHIN_S, False
        while True:
            if self._base.now() > until:
                raise NoResponse(
                    f"{servo.title} restarts repeatedly, so the contents of its ROM are unknown. Check its supply.",
                    cause="restarts_repeatedly",
                    servo=servo.title,
                )
            job.begin("back")
            job.done("back", await self.back(servo, departure))
            boot_count = servo.boot_count
            try:
                await self._soft_start_step(job, servo)
                job.begin("read_back")
                await identification.read_rows(self._requests, servo, rows)
            except NoResponse:
                if self._base.now() > until:
                    raise
                continue  # its power may have failed again
            if servo.boot_count != boot_count or not servo.identified:
                continue
            identification.learn_rom(servo, soft_start=False)
            wrong = [key for key, raw in wanted.items() if servo.registers[key].rom != raw]
            if wrong and not looked_twice:
                looked_twice = True
                await asyncio.sleep(ANOTHER_STATUS_S)
                continue  # read again: soft start may just have been ending
            break
        if wrong:
            raise not_saved(servo, wanted, wrong, stopped=self.stop.latched)
        if wanted:
            evidence = Evidence(
                "read_back", f"{len(wanted)} rows read back, all equal to the saved values", {"rows": len(wanted)}
            )
        else:
            evidence = Evidence("all_rows_read", f"{len(rows)} rows read", {"rows": len(rows)})
        job.done("read_back", evidence)

    async def _soft_start_step(self, job: RunningJob, servo: Servo) -> None:
        job.begin("soft_start")
        evidence = await self.soft_start_over(servo)
        if evidence is None:
            text = "no soft start: soft start is off, or the servo started with torque off"
            job.skip("soft_start", Evidence("no_soft_start", text))
        else:
            job.done("soft_start", evidence)

    def _update_silence(self, servo: Servo, departure: Departure) -> None:
        seen = _last_seen(servo)
        if seen is None or seen <= departure.last_seen:
            return
        begun, ended = departure.silence
        if seen - departure.last_seen > ended - begun:
            departure.silence = departure.last_seen, seen
        departure.last_seen = seen


def _last_seen(servo: Servo) -> Instant | None:
    return max((at for at in (servo.status_at, servo.angle_at) if at is not None), default=None)
