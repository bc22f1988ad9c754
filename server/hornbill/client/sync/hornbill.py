"""Client of one server, with access to its servos."""

# Generated from hornbill.client.aio by `make generate`. Edit the source there.

from __future__ import annotations

import math
import time
from collections.abc import Generator, Mapping, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self
from urllib.parse import quote

from hornbill.client.live import Gap, Sample
from hornbill.client.problems import WaitTimeout, raised
from hornbill.client.sync.autopilot import Autopilot
from hornbill.client.sync.bus import Bus
from hornbill.client.sync.connection import Connection
from hornbill.client.sync.jobs import Jobs
from hornbill.client.sync.lease import Lease
from hornbill.client.sync.live import Live
from hornbill.client.sync.records import Records
from hornbill.client.sync.servo import Progress, Servo
from hornbill.client.sync.sim import Sim
from hornbill.client.sync.stream import Stream
from hornbill.errors import Conflict, Interrupted, InvalidValue, Unknown

if TYPE_CHECKING:
    from hornbill.client import responses

POLL_S = 0.1
"""Polling interval while waiting, s."""
LONG_POLL_S = 20.0
"""Time for which one request waits for the end of a job, s."""


class Hornbill(Connection):
    """One server, as a context manager. `url` and `token` default to HORNBILL_URL and HORNBILL_TOKEN.

    Methods return the JSON objects of the API, typed in hornbill.client.responses, and raise the errors of
    hornbill.errors and ServerUnreachable.
    """

    @property
    def bus(self) -> Bus:
        """Adapter, nodes, node IDs and logs."""
        return Bus(self)

    @property
    def autopilot(self) -> Autopilot:
        """Parameter files, live verification and failsafe of servos commanded by an autopilot."""
        return Autopilot(self)

    @property
    def jobs(self) -> Jobs:
        """Jobs and their reports."""
        return Jobs(self)

    @property
    def records(self) -> Records:
        """Inventory, audit, step test runs and recordings."""
        return Records(self)

    @property
    def sim(self) -> Sim:
        """Simulated servos and autopilot, on a server that has them."""
        return Sim(self)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def servos(self) -> list[Servo]:
        """Servos seen since the start of the server."""
        return [Servo(self, one) for one in self.request("GET", "/servos")]

    def find(
        self,
        *,
        label: str | None = None,
        serial: str | None = None,
        servo_id: int | None = None,
        uid: str | None = None,
        within_s: float = 10.0,
    ) -> Servo:
        """Find a servo by label, serial, servo ID or unique ID. Waits until it is on the bus and identified.

        Raises Unknown if it is not within `within_s`, and Conflict if several match.
        """
        wanted: dict[str, str | int | None] = {"label": label, "serial": serial, "servo_id": servo_id, "uid": uid}
        given = {key: value for key, value in wanted.items() if value is not None}
        if not given:
            raise InvalidValue("No servo given. Specify label, serial, servo_id or uid.", cause=None)
        until = time.monotonic() + within_s
        while True:
            every: list[responses.Servo] = self.request("GET", "/servos")
            found = [one for one in every if given.items() <= {**one}.items()]
            if len(found) > 1:
                raise Conflict(f"{len(found)} servos have {_text(given)}. Specify serial or uid.", cause=None)
            if found and found[0]["online"] and found[0]["state"] != "identifying":
                return Servo(self, found[0])
            if time.monotonic() > until:
                raise Unknown("unknown_servo", _missing(given, found, every), cause=None)
            time.sleep(POLL_S)

    def look_up(self, name: str) -> Servo:
        """The servo with this label, serial or start of its unique ID, on the bus or not."""
        every: list[responses.Servo] = self.request("GET", "/servos")
        start = name.lower() or "–"
        found = [one for one in every if name in (one["label"], one["serial"]) or one["uid"].startswith(start)]
        if len(found) == 1:
            return Servo(self, found[0])
        text = f"{len(found)} servos match" if found else "No servo matches"
        raise Unknown("unknown_servo", f"{text} {name!r}. 'hornbill list' lists them.", cause=None)

    def lease(
        self,
        holder: str,
        *,
        uids: Sequence[str] | None = None,
        ttl_s: float = 3.0,
        heartbeat: bool = True,
        force: bool = False,
        reason: str = "",
    ) -> Lease:
        """Lease (motion control) as a context manager. `force` takes it from its current holder and needs a reason.

        `uids`: servos to control (unique IDs, serial numbers or labels), so that several programs can share a bus. None
        for all servos.
        """
        return Lease(self, holder, ttl_s, uids=uids, heartbeat=heartbeat, force=force, reason=reason)

    def events(
        self, servos: Sequence[Servo] | None = None, *, past: bool = False, reconnect_s: float | None = 60.0
    ) -> Generator[responses.EventMessage | Gap]:
        """Events as they occur, of all servos or these, and those that concern none. Endless.

        `past`: recent events first. After a lost connection it reconnects for up to `reconnect_s` (None: without
        limit; then ServerUnreachable) and resumes; a Gap stands for events that were lost.
        """
        uids = None if servos is None else [one.uid for one in servos]
        return Live(self, reconnect_s).events(uids, past=past)

    def telemetry(
        self,
        servos: Sequence[Servo],
        channels: Sequence[str],
        *,
        rate_hz: float | None = None,
        reconnect_s: float | None = 60.0,
    ) -> Generator[Sample | Gap]:
        """Samples as they arrive: `uid`, `key`, `t` (seconds since 1970 UTC) and `value`. Endless. Moves nothing.

        `rate_hz`: subscribes to the channels at this rate meanwhile; the bus budget may grant less. None: only what is
        polled or broadcast anyway. A lost connection is resumed as in `events`; a Gap stands for missing samples.
        """
        return Live(self, reconnect_s).samples([one.uid for one in servos], channels, rate_hz)

    def improve(
        self,
        servos: Sequence[Servo],
        goal: Literal["calm", "fast", "stiff"] = "calm",
        *,
        bounds: Mapping[str, float] | None = None,
        expert: bool = False,
        on_progress: Progress | None = None,
    ) -> responses.Job:
        """Improve several servos in turn. The result has the spread of their gains, and the outlier."""
        body = {
            "uids": [one.uid for one in servos], "goal": goal, "bounds": dict(bounds or {}), "expert": expert
        }  # fmt: skip
        job: responses.Job = self.request("POST", "/improve", body)
        return self.wait(job["id"], on_progress=on_progress)

    def stop(
        self,
        mode: Literal["off", "brake"] = "off",
        *,
        reason: str = "",
        within_s: float = 1.0,
        everyone: bool = False,
    ) -> responses.Stop:
        """Stop all servos immediately. Needs no lease. Returns when all have confirmed, or after `within_s`.

        As guest, only servos that hornbill commands, unless `everyone`: then also those that an autopilot commands. The
        server continues to retry after that. Motion raises Stopped until `clear_stop`.
        """
        until = time.monotonic() + within_s
        state: responses.Stop = self.request(
            "POST",
            "/stop",
            {"mode": mode, "reason": reason} | ({"everyone": True} if everyone else {}),
            keyed=False,
            by=self.by,
        )
        while unconfirmed(state) and time.monotonic() < until:
            time.sleep(POLL_S / 2)
            seen = self.stop_state()
            if not seen["latched"]:  # cleared by another client
                break
            state = seen
        return state

    def stop_state(self) -> responses.Stop:
        """State of the stop latch, with confirmations."""
        return self.request("GET", "/stop")

    def clear_stop(self) -> responses.Stop:
        """Clear the stop. Moves nothing; torque stays off."""
        return self.request("DELETE", "/stop", by=self.by)

    def restore_output(
        self,
        servos: Sequence[Servo] | None = None,
        *,
        confirm: Sequence[str] = (),
        on_progress: Progress | None = None,
    ) -> responses.Job:
        """Switch outputs on again, each holding its current angle, and wait. Clears a latched stop.

        `servos`: None for all that a stop, lease or command switched off. Under a lease they stay on until it ends.
        Raises LeaseRequired if a servo's timeout would switch it off again. `confirm`: codes of an earlier
        NeedsConfirmation ("load").
        """
        body = {"uids": _uids(servos), "confirm": list(confirm)}
        job: responses.Job = self.request("POST", "/stop/restore", body, once=True, by=self.by)
        return self.wait(job["id"], on_progress=on_progress)

    def plan_restore_output(self, servos: Sequence[Servo] | None = None) -> responses.OutputRestorePreview:
        """Servos that `restore_output` would switch on, with load and need for a lease. Switches nothing."""
        return self.request("POST", "/stop/restore", {"uids": _uids(servos), "dry_run": True}, by=self.by)

    def command_many(
        self,
        commands: Sequence[tuple[Servo, Literal["angle", "speed", "torque"], float]],
        *,
        clamp: bool = False,
        confirm: Sequence[str] = (),
    ) -> responses.BurstSent:
        """Command several servos simultaneously, all or none. Requires a lease. Sent once."""
        shown = [{"uid": servo.uid, "type": kind, "value": value} for servo, kind, value in commands]
        body = {"commands": shown, "clamp": clamp, "confirm": list(confirm)}
        return self.request("POST", "/commands", body, once=True)

    def stream(
        self,
        servos: Sequence[Servo],
        kind: Literal["angle", "speed", "torque"] = "angle",
        *,
        rate_hz: float = 50.0,
    ) -> Stream:
        """Stream of setpoints to several servos, as a context manager. Requires a lease."""
        return Stream(self, list(servos), kind, rate_hz)

    def run_plan(
        self, plan: Mapping[str, Any], *, confirm: Sequence[str] = (), on_progress: Progress | None = None
    ) -> responses.Job:
        """Run a test plan and wait. The server runs it under a lease of its own, also if this program ends.

        `plan`: contents of a plan file, for example from `tomllib.load`. Raises UnexpectedResult if a limit was
        exceeded. A lease of this program is released first.
        """
        job = self.start_plan(plan, confirm=confirm)
        return self.wait(job["id"], on_progress=on_progress)

    def start_plan(self, plan: Mapping[str, Any], *, confirm: Sequence[str] = ()) -> responses.Job:
        """Start a test plan and return immediately. See `run_plan`."""
        body = {"plan": dict(plan), "confirm": list(confirm), "by": self.by}
        return self.request("POST", "/plans", body, once=True)

    def check_plan(self, plan: Mapping[str, Any], *, confirm: Sequence[str] = ()) -> responses.PlanPreview:
        """Check a test plan: servos with cautions, and what would prevent the run. Sends only reads."""
        return self.request("POST", "/plans", {"plan": dict(plan), "confirm": list(confirm), "dry_run": True})

    def leases(self) -> list[responses.LeaseView]:
        """Valid leases, oldest first. Empty if no client has motion control."""
        return self.request("GET", "/leases")

    def wait(self, job: str, *, timeout_s: float | None = None, on_progress: Progress | None = None) -> responses.Job:
        """Wait for a job. Raises the error it failed with, including the fact `job`; Interrupted if it was cancelled;
        WaitTimeout after `timeout_s`. `on_progress` is called with the job ten times a second.
        """
        until = math.inf if timeout_s is None else time.monotonic() + timeout_s
        while True:
            within_s = 0.0 if on_progress is not None else max(0.0, min(LONG_POLL_S, until - time.monotonic()))
            seen: responses.Job = self.request(
                "GET", f"/jobs/{job}", timeout_s=LONG_POLL_S + 10, wait=round(within_s, 3) or None
            )
            if on_progress is not None:
                on_progress(seen)
            if seen["state"] == "succeeded":
                return seen
            if seen["state"] == "cancelled":
                raise Interrupted(f"The {seen['kind']} job was cancelled.", cause=None, job=seen)
            if seen["state"] == "failed":
                problem = seen["error"]
                raise raised(500 if problem is None else problem["status"], {**(problem or {}), "job": seen})
            if time.monotonic() >= until:
                raise WaitTimeout(f"The {seen['kind']} job has not ended after {timeout_s:g} s.", cause=None, job=seen)
            if on_progress is not None:
                time.sleep(POLL_S)

    def profiles(self) -> list[responses.Profile]:
        """All profiles, by name."""
        return self.request("GET", "/profiles")

    def profile(self, name: str) -> responses.Profile:
        """One profile."""
        return self.request("GET", f"/profiles/{quote(name, safe='')}")

    def delete_profile(self, name: str) -> None:
        """Delete a profile. Servos that it was applied to stay unchanged."""
        self.request("DELETE", f"/profiles/{quote(name, safe='')}")

    def store_profile(
        self, name: str, values: Mapping[str, bool | int | float | str] | Servo, *, description: str = ""
    ) -> responses.Profile:
        """Store a profile from values, or from a servo (without its identity rows)."""
        body: dict[str, Any] = {"description": description}
        body |= {"from_uid": values.uid} if isinstance(values, Servo) else {"values": dict(values)}
        return self.request("PUT", f"/profiles/{quote(name, safe='')}", body)

    def apply_profile(
        self,
        name: str,
        servos: Sequence[Servo],
        *,
        dry_run: bool = False,
        save: bool = False,
        confirm: Sequence[str] = (),
        on_progress: Progress | None = None,
    ) -> responses.Job:
        """Apply a profile to servos one by one, each all or nothing, and wait."""
        body = {
            "uids": [one.uid for one in servos], "dry_run": dry_run, "save": save, "confirm": list(confirm),
        }  # fmt: skip
        job: responses.Job = self.request("POST", f"/profiles/{quote(name, safe='')}/apply", body)
        return self.wait(job["id"], on_progress=on_progress)

    def compare(self, left: str, right: str, *, identity: bool = False) -> responses.Comparison:
        """Compare two sides: servo:UID, rom:UID, snapshot:ID, profile:NAME, default:MODEL."""
        return self.request("GET", "/compare", left=left, right=right, identity=identity)

    def read_many(self, servos: Sequence[Servo], keys: Sequence[str]) -> responses.BatchRead:
        """Read parameters of several servos. A servo that cannot be read has a `problem` instead."""
        uids = ",".join(one.uid for one in servos)
        return self.request("GET", "/parameters", uids=uids, keys=",".join(keys), refresh=True)

    def read_faults(self, servos: Sequence[Servo]) -> responses.FaultsRead:
        """Fault bits of several servos, present and past. An unknown servo has a `problem` instead."""
        return self.request("GET", "/faults", uids=",".join(one.uid for one in servos))

    def write_many(
        self,
        values: Mapping[Servo, Mapping[str, bool | int | float | str]],
        *,
        dry_run: bool = False,
        save: bool = False,
        all_or_none: bool = False,
        confirm: Sequence[str] = (),
    ) -> responses.BatchPatched:
        """Write values by servo and key, all or nothing for each servo. `all_or_none`: write to none if any plan is
        rejected.
        """
        body = {
            "servos": {servo.uid: dict(rows) for servo, rows in values.items()}, "dry_run": dry_run, "save": save,
            "all_or_none": all_or_none, "confirm": list(confirm),
        }  # fmt: skip
        return self.request("PATCH", "/parameters", body)

    def candidates(self) -> responses.Candidates:
        """Servos that appear to be new, each with the next free servo ID."""
        return self.request("GET", "/commissioning/candidates")

    def commission(
        self,
        servos: Sequence[Mapping[str, Any]],
        *,
        profile: str | None = None,
        save: bool = True,
        identify: bool = False,
        on_anomaly: Literal["stop", "continue"] = "stop",
        confirm: Sequence[str] = (),
        on_progress: Progress | None = None,
    ) -> responses.Job:
        """Commission servos (each {"uid", "servo_id", "node_id", "label"}), and wait."""
        body = {
            "servos": [dict(one) for one in servos], "profile": profile, "save": save, "identify": identify,
            "on_anomaly": on_anomaly, "confirm": list(confirm),
        }  # fmt: skip
        job: responses.Job = self.request("POST", "/commissioning", body)
        return self.wait(job["id"], on_progress=on_progress)

    def plan_commission(
        self,
        servos: Sequence[Mapping[str, Any]],
        *,
        profile: str | None = None,
        save: bool = True,
        identify: bool = False,
        confirm: Sequence[str] = (),
    ) -> responses.CommissioningPreview:
        """Writes and ROM changes of `commission` for each servo, after all its checks. Writes nothing."""
        body = {
            "servos": [dict(one) for one in servos], "profile": profile, "save": save, "identify": identify,
            "confirm": list(confirm), "dry_run": True,
        }  # fmt: skip
        return self.request("POST", "/commissioning", body)

    def health(self) -> responses.Health:
        """Version, uptime and bus of the server."""
        return self.request("GET", "/health")

    def tuning(self) -> responses.Tuning:
        """What the server can compute, and the thresholds of its verdicts."""
        return self.request("GET", "/tuning")

    def schema(self) -> responses.SchemaDocument:
        """Parameter catalogue: all rows, models and fault bits."""
        return self.request("GET", "/schema")

    def doctor(self) -> list[responses.Finding]:
        """All checks of the bus, including those without findings, most severe first."""
        return self.request("GET", "/bus/doctor", all=True)


def unconfirmed(state: responses.Stop) -> list[str]:
    """Names of servos, and of nodes that may be servos, that have not confirmed a stop."""
    names = [one["label"] or one["uid"][:8] for one in state["servos"] if not one["confirmed"]]
    return names + [f"node {one['node_id']}" for one in state["nodes"] if not one["confirmed"]]


def _uids(servos: Sequence[Servo] | None) -> list[str] | None:
    return None if servos is None else [one.uid for one in servos]


def _text(given: Mapping[str, object]) -> str:
    return ", ".join(f"{key} {value!r}" for key, value in given.items())


def _missing(given: Mapping[str, object], found: list[responses.Servo], every: list[responses.Servo]) -> str:
    if found:
        return f"The servo with {_text(given)} is {found[0]['state']}. Check its supply and wiring."
    known = ", ".join(sorted(one["label"] or one["serial"] or one["uid"] for one in every)) or "none"
    return f"No servo with {_text(given)} is on the bus. Known servos: {known}."
