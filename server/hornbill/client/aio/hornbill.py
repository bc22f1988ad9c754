"""The client of one server, and the way to its servos."""

import asyncio
import time
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Any, Literal, Self
from urllib.parse import quote

from hornbill.client import answers
from hornbill.client.aio.bus import AsyncBus
from hornbill.client.aio.connection import AsyncConnection
from hornbill.client.aio.jobs import AsyncJobs
from hornbill.client.aio.lease import AsyncLease
from hornbill.client.aio.records import AsyncRecords
from hornbill.client.aio.servo import AsyncServo, Progress
from hornbill.client.aio.stream import AsyncStream
from hornbill.client.problems import TookTooLong, raised
from hornbill.errors import Conflict, Interrupted, InvalidValue, Unknown

LOOK_S = 0.1
"""How often something is looked at that is waited for."""


class AsyncHornbill(AsyncConnection):
    """One server. Use it in a block; `url` and `token` come from HORNBILL_URL and HORNBILL_TOKEN unless given.

    What it answers are the JSON objects of the API, typed in hornbill.client.answers. Every method raises the errors
    of hornbill.errors, and NoServer.
    """

    @property
    def bus(self) -> AsyncBus:
        """The adapter, who is on the bus, node ids, the log."""
        return AsyncBus(self)

    @property
    def jobs(self) -> AsyncJobs:
        """What takes time, and its reports."""
        return AsyncJobs(self)

    @property
    def records(self) -> AsyncRecords:
        """What the server keeps: servos ever met, audit, measured runs, recordings of the recorder."""
        return AsyncRecords(self)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.aclose()

    async def servos(self) -> list[AsyncServo]:
        """Every servo the server has seen since its start."""
        return [AsyncServo(self, one) for one in await self.ask("GET", "/servos")]

    async def find(
        self,
        *,
        label: str | None = None,
        serial: str | None = None,
        servo_id: int | None = None,
        uid: str | None = None,
        within_s: float = 10.0,
    ) -> AsyncServo:
        """The servo with this label, serial, servo id or unique id, once it is on the bus and identified.

        Raises Unknown when it is not after `within_s`, and Conflict when several fit.
        """
        wanted: dict[str, str | int | None] = {"label": label, "serial": serial, "servo_id": servo_id, "uid": uid}
        given = {key: value for key, value in wanted.items() if value is not None}
        if not given:
            raise InvalidValue("Say which servo: by label, serial, servo_id or uid.", cause=None)
        until = time.monotonic() + within_s
        while True:
            every: list[answers.Servo] = await self.ask("GET", "/servos")
            found = [one for one in every if given.items() <= {**one}.items()]
            if len(found) > 1:
                raise Conflict(f"{len(found)} servos have {_told(given)}. Name it by serial or uid.", cause=None)
            if found and found[0]["online"] and found[0]["state"] != "identifying":
                return AsyncServo(self, found[0])
            if time.monotonic() > until:
                raise Unknown("unknown_servo", _missing(given, found, every), cause=None)
            await asyncio.sleep(LOOK_S)

    async def look_up(self, name: str) -> AsyncServo:
        """The one servo with this label or serial, or whose unique id begins so, on the bus or not."""
        every: list[answers.Servo] = await self.ask("GET", "/servos")
        begun = name.lower() or "nobody"
        found = [one for one in every if name in (one["label"], one["serial"]) or one["uid"].startswith(begun)]
        if len(found) == 1:
            return AsyncServo(self, found[0])
        text = f"{len(found)} servos are" if found else "No servo is"
        raise Unknown("unknown_servo", f"{text} known as {name!r}. 'hornbill list' shows them.", cause=None)

    def lease(
        self, holder: str, *, ttl_s: float = 3.0, beat: bool = True, force: bool = False, reason: str = ""
    ) -> AsyncLease:
        """Motion control for a block. `force` takes it from whoever has it, with a reason."""
        return AsyncLease(self, holder, ttl_s, beat=beat, force=force, reason=reason)

    async def stop(
        self, mode: Literal["off", "brake"] = "off", *, reason: str = "", within_s: float = 1.0
    ) -> answers.Stop:
        """Stop every servo now; needs no lease. Answers when all have confirmed, or after `within_s`.

        The server goes on trying after that. Motion raises Stopped until `clear_stop`.
        """
        until = time.monotonic() + within_s
        state: answers.Stop = await self.ask("POST", "/stop", {"mode": mode, "reason": reason}, keyed=False, by=self.by)
        while unconfirmed(state) and time.monotonic() < until:
            await asyncio.sleep(LOOK_S / 2)
            seen = await self.stop_state()
            if not seen["latched"]:  # somebody cleared it meanwhile
                break
            state = seen
        return state

    async def stop_state(self) -> answers.Stop:
        """The stop latch, and who has confirmed."""
        return await self.ask("GET", "/stop")

    async def clear_stop(self) -> answers.Stop:
        """Clear the stop. Moves nothing and turns nothing on."""
        return await self.ask("DELETE", "/stop", by=self.by)

    async def restore_output(
        self,
        servos: Sequence[AsyncServo] | None = None,
        *,
        confirm: Sequence[str] = (),
        on_progress: Progress | None = None,
    ) -> answers.Job:
        """Switch outputs on again, each held where its horn stands, and wait for it; a latched stop is cleared.

        `servos`: None for all that a stop, a lease or a command switched off. Under a lease they are on until it ends;
        LeaseRequired for those that would let go by themselves. `confirm`: words of an earlier NeedsConfirmation
        ("load").
        """
        body = {"uids": _uids(servos), "confirm": list(confirm)}
        job: answers.Job = await self.ask("POST", "/stop/restore", body, once=True, by=self.by)
        return await self.wait(job["id"], on_progress=on_progress)

    async def plan_restore_output(self, servos: Sequence[AsyncServo] | None = None) -> answers.OutputRestorePreview:
        """What `restore_output` would switch on, who is under load, and who needs a lease. Switches nothing."""
        return await self.ask("POST", "/stop/restore", {"uids": _uids(servos), "dry_run": True}, by=self.by)

    async def command_many(
        self,
        commands: Sequence[tuple[AsyncServo, Literal["angle", "speed", "torque"], float]],
        *,
        clamp: bool = False,
        confirm: Sequence[str] = (),
    ) -> answers.BurstSent:
        """Commands that leave together, under a lease: all of them or none. Sent once."""
        shown = [{"uid": servo.uid, "type": kind, "value": value} for servo, kind, value in commands]
        body = {"commands": shown, "clamp": clamp, "confirm": list(confirm)}
        return await self.ask("POST", "/commands", body, once=True)

    def stream(
        self,
        servos: Sequence[AsyncServo],
        kind: Literal["angle", "speed", "torque"] = "angle",
        *,
        rate_hz: float = 50.0,
    ) -> AsyncStream:
        """Steady bursts to several servos for a block, under a lease."""
        return AsyncStream(self, list(servos), kind, rate_hz)

    async def leases(self) -> list[answers.LeaseView]:
        """Who has motion control."""
        return await self.ask("GET", "/leases")

    async def wait(
        self, job: str, *, timeout_s: float | None = None, on_progress: Progress | None = None
    ) -> answers.Job:
        """Wait for a job by its id. Raises what it failed of, with the fact `job`; Interrupted when it was cancelled;
        TookTooLong after `timeout_s`. `on_progress` is called with the job whenever it was looked at.
        """
        until = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            seen: answers.Job = await self.ask("GET", f"/jobs/{job}")
            if on_progress is not None:
                on_progress(seen)
            if seen["state"] == "succeeded":
                return seen
            if seen["state"] == "cancelled":
                raise Interrupted(f"The {seen['kind']} job was cancelled.", cause=None, job=seen)
            if seen["state"] == "failed":
                problem = seen["error"]
                raise raised(500 if problem is None else problem["status"], {**(problem or {}), "job": seen})
            if until is not None and time.monotonic() > until:
                raise TookTooLong(f"The {seen['kind']} job is not done after {timeout_s:g} s.", cause=None, job=seen)
            await asyncio.sleep(LOOK_S)

    async def profiles(self) -> list[answers.Profile]:
        """Every profile, by name."""
        return await self.ask("GET", "/profiles")

    async def profile(self, name: str) -> answers.Profile:
        """One profile."""
        return await self.ask("GET", f"/profiles/{quote(name, safe='')}")

    async def delete_profile(self, name: str) -> None:
        """Forget a profile. Servos it was applied to stay as they are."""
        await self.ask("DELETE", f"/profiles/{quote(name, safe='')}")

    async def put_profile(
        self, name: str, values: Mapping[str, bool | int | float | str] | AsyncServo, *, description: str = ""
    ) -> answers.Profile:
        """Keep values under a name, or those a servo holds (without its identity)."""
        body: dict[str, Any] = {"description": description}
        body |= {"from_uid": values.uid} if isinstance(values, AsyncServo) else {"values": dict(values)}
        return await self.ask("PUT", f"/profiles/{quote(name, safe='')}", body)

    async def apply_profile(
        self,
        name: str,
        servos: Sequence[AsyncServo],
        *,
        dry_run: bool = False,
        save: bool = False,
        confirm: Sequence[str] = (),
        on_progress: Progress | None = None,
    ) -> answers.Job:
        """Bring servos to a profile one by one, each all or nothing, and wait for it."""
        body = {
            "uids": [one.uid for one in servos], "dry_run": dry_run, "save": save, "confirm": list(confirm),
        }  # fmt: skip
        job: answers.Job = await self.ask("POST", f"/profiles/{quote(name, safe='')}/apply", body)
        return await self.wait(job["id"], on_progress=on_progress)

    async def compare(self, left: str, right: str, *, identity: bool = False) -> answers.Comparison:
        """Where two sides differ: servo:UID, rom:UID, snapshot:ID, profile:NAME, default:MODEL."""
        return await self.ask("GET", "/compare", left=left, right=right, identity=identity)

    async def read_many(self, servos: Sequence[AsyncServo], keys: Sequence[str]) -> answers.BatchRead:
        """Parameters × servos, read now; a servo that cannot be read says why in its `problem`."""
        uids = ",".join(one.uid for one in servos)
        return await self.ask("GET", "/parameters", uids=uids, keys=",".join(keys), refresh=True)

    async def read_faults(self, servos: Sequence[AsyncServo]) -> answers.FaultsRead:
        """Fault bits of several servos, past ones, too; a servo that is not known says why in its `problem`."""
        return await self.ask("GET", "/faults", uids=",".join(one.uid for one in servos))

    async def write_many(
        self,
        values: Mapping[AsyncServo, Mapping[str, bool | int | float | str]],
        *,
        dry_run: bool = False,
        save: bool = False,
        all_or_none: bool = False,
        confirm: Sequence[str] = (),
    ) -> answers.BatchPatched:
        """Values by servo by key, each servo all or nothing; `all_or_none`: one rejected plan keeps all from it."""
        body = {
            "servos": {servo.uid: dict(rows) for servo, rows in values.items()}, "dry_run": dry_run, "save": save,
            "all_or_none": all_or_none, "confirm": list(confirm),
        }  # fmt: skip
        return await self.ask("PATCH", "/parameters", body)

    async def candidates(self) -> answers.Candidates:
        """Servos that look new, each with a free servo id."""
        return await self.ask("GET", "/commissioning/candidates")

    async def commission(
        self,
        servos: Sequence[Mapping[str, Any]],
        *,
        profile: str | None = None,
        save: bool = True,
        identify: bool = False,
        on_anomaly: Literal["stop", "continue"] = "stop",
        confirm: Sequence[str] = (),
        on_progress: Progress | None = None,
    ) -> answers.Job:
        """Give servos ({"uid", "servo_id", "node_id", "label"} each) their identity and a profile, and wait for it."""
        body = {
            "servos": [dict(one) for one in servos], "profile": profile, "save": save, "identify": identify,
            "on_anomaly": on_anomaly, "confirm": list(confirm),
        }  # fmt: skip
        job: answers.Job = await self.ask("POST", "/commissioning", body)
        return await self.wait(job["id"], on_progress=on_progress)

    async def plan_commission(
        self,
        servos: Sequence[Mapping[str, Any]],
        *,
        profile: str | None = None,
        save: bool = True,
        identify: bool = False,
        confirm: Sequence[str] = (),
    ) -> answers.CommissioningPreview:
        """What `commission` would write to each servo and to its ROM, after every check of it. Writes nothing."""
        body = {
            "servos": [dict(one) for one in servos], "profile": profile, "save": save, "identify": identify,
            "confirm": list(confirm), "dry_run": True,
        }  # fmt: skip
        return await self.ask("POST", "/commissioning", body)

    async def health(self) -> answers.Health:
        """Version, uptime and bus of the server."""
        return await self.ask("GET", "/health")

    async def schema(self) -> answers.SchemaDocument:
        """The parameter tables: every row with its unit, range and meaning, every model, every fault bit."""
        return await self.ask("GET", "/schema")

    async def doctor(self) -> list[answers.Finding]:
        """What was looked at on the bus, severity ok included, worst first."""
        return await self.ask("GET", "/bus/doctor", all=True)


def unconfirmed(state: answers.Stop) -> list[str]:
    """Who has not confirmed a stop: servos by what they are called, and nodes that may be servos."""
    names = [one["label"] or one["uid"][:8] for one in state["servos"] if not one["confirmed"]]
    return names + [f"node {one['node_id']}" for one in state["nodes"] if not one["confirmed"]]


def _uids(servos: Sequence[AsyncServo] | None) -> list[str] | None:
    return None if servos is None else [one.uid for one in servos]


def _told(given: Mapping[str, object]) -> str:
    return ", ".join(f"{key} {value!r}" for key, value in given.items())


def _missing(given: Mapping[str, object], found: list[answers.Servo], every: list[answers.Servo]) -> str:
    if found:
        return f"The servo with {_told(given)} is {found[0]['state']}. Look at its supply and its plug."
    there = ", ".join(sorted(one["label"] or one["serial"] or one["uid"] for one in every)) or "nobody"
    return f"No servo with {_told(given)} is on the bus. There is: {there}."
