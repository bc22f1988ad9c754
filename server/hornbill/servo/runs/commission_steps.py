"""Steps of commissioning one servo, and their record."""

import asyncio
from dataclasses import asdict
from functools import partial
from typing import Protocol

from hornbill.domain.fields import known
from hornbill.domain.note import Note
from hornbill.domain.profile import Profile
from hornbill.errors import Conflict, UnexpectedResult
from hornbill.schema import scale
from hornbill.servo.configuration.proving import difference
from hornbill.servo.configuration.record import when
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.motion.identify import Identify
from hornbill.servo.profiles.profiles import Profiles
from hornbill.servo.runs.commission_request import wanted_values
from hornbill.servo.runs.commission_run import CommissionRun, CommissionTarget, CommissionWriter
from hornbill.servo.runs.fleet_run import SAVED, NotNeeded, rows_written
from hornbill.servo.runs.id_order import IdTurn
from hornbill.servo.runs.id_parking import PARK_STEPS, IdParking
from hornbill.servo.runtime.steps import Evidence
from hornbill.store.audit import NewAuditEntry
from hornbill.store.tables import Json
from hornbill.units import Raw

FAILED_BEFORE = Evidence("failed_before", "it failed before")
JOB_ENDED = Evidence("job_ended", "an anomaly ended the job")


class SetLabel(Protocol):
    """Sets the nickname of a servo. `by` and `job` are for the audit."""

    async def __call__(self, servo: Servo, label: str, *, by: str, job: str | None = None) -> None: ...


class CommissionSteps:
    """Steps of a commissioning run."""

    def __init__(
        self,
        services: HostServices,
        writer: CommissionWriter,
        parking: IdParking,
        fleet: Fleet,
        profiles: Profiles,
        wiggle: Identify,
        set_label: SetLabel,
    ) -> None:
        self._writer = writer
        self._parking = parking
        self._requests = services.requests
        self._base = services.base
        self._fleet = fleet
        self._profiles = profiles
        self._wiggle = wiggle
        self._audit = services.audit
        self._set_label = set_label

    async def execute(self, run: CommissionRun) -> None:
        """Run all steps."""
        try:
            run.update_result()
            for target in run.targets:
                if target.finished:
                    await run.step(target, "check", self._check)
            await run.each(run.order, self._turn)
            await self._clear_up(run)
        except asyncio.CancelledError:
            self._parking.note_parked(run)
            raise

    async def _turn(self, run: CommissionRun, turn: IdTurn) -> None:
        target = run.target(turn.uid)
        if turn.parked is not None:
            await run.step(target, PARK_STEPS[turn.parked], partial(self._parking.park, turn.parked))
        elif target.problem is not None:  # its ID could not be parked
            run.skip(target, FAILED_BEFORE)
        else:
            await self._commission(run, target)

    async def _commission(self, run: CommissionRun, target: CommissionTarget) -> None:
        """Every step of a target, up to its first problem."""
        record = target.record
        record.started_at = record.started_at or self._base.utc_now()
        record.by = run.by
        if run.request.profile is not None:
            record.use(Profile(**run.request.profile))
        does = {"identify": self._identify, "write": self._write, "save": self._save, "verify": self._verify}
        for kind in run.request.kinds:
            if not await run.step(target, kind, does[kind]):
                break
        record.ended_at = self._base.utc_now()
        record.verdict = "done" if target.problem is None else "failed"
        run.update_result()
        self._note(run, target)

    async def _clear_up(self, run: CommissionRun) -> None:
        """Restore the servo IDs of parked servos that were not reached, and skip all waiting steps."""
        await self._parking.restore(run)
        for target in run.targets:
            if target.problem is None and target.record.verdict == "waiting":
                target.record.verdict = "not_tried"
            run.skip(target, JOB_ENDED if target.problem is None else FAILED_BEFORE)

    async def _identify(self, run: CommissionRun, target: CommissionTarget) -> Evidence:
        servo = await self._writer.present(target)
        job = self._wiggle.identify(servo, run.lease_id, by=run.by)
        await self._writer.ended(job, servo)
        text = f"wiggled on node {servo.node_id} and returned to its start angle"
        return Evidence("identified", text, known(node_id=servo.node_id))

    async def _write(self, run: CommissionRun, target: CommissionTarget) -> Evidence:
        servo = await self._writer.present(target)
        self._check_free(target, servo)
        values = wanted_values(self._profiles, run.request, target.wanted, servo)
        if target.wanted.node_id == 0 and servo.node_id in run.request.fixed:
            await self._parking.pin_elsewhere(run, servo)
        written = await self._writer.apply(run, servo, values) if values else 0
        run.ids.settle(servo.uid)
        if target.wanted.label and target.wanted.label != servo.label:
            await self._set_label(servo, target.wanted.label, by=run.by, job=run.job.id)
        target.record.identify(servo)
        return rows_written(written, len(values))

    async def _save(self, run: CommissionRun, target: CommissionTarget) -> Evidence:
        servo = await self._writer.present(target)
        wanted = self._raws(run, target, servo)
        fixed = target.wanted.node_id
        if all(servo.registers[key].rom == raw for key, raw in wanted.items()) and fixed in (None, 0, servo.node_id):
            raise NotNeeded(Evidence("save_not_needed", "not needed: ROM already contains all values"))
        await self._writer.save(run, servo, wanted)
        return SAVED

    async def _verify(self, run: CommissionRun, target: CommissionTarget) -> Evidence:
        servo = await self._writer.present(target)
        keys, wanted = await self._compare(run, target, servo, rom_may_be_unknown=False)
        fixed, saved = target.wanted.node_id, run.request.save
        found = {key: servo.registers[key].rom if saved else servo.configured(key) for key in keys}
        target.record.identify(servo)
        target.record.prove(
            servo, {key: raw for key, raw in found.items() if raw is not None}, "rom" if saved else "ram"
        )
        if saved and fixed:
            self._parking.forget_allocation(run, servo)
        where = "in RAM and ROM" if saved else "in RAM, not in ROM"
        text = f"all {len(wanted)} values verified {where}, read from node {servo.node_id}"
        return Evidence("values_verified", text, known(values=len(wanted), node_id=servo.node_id, in_rom=saved))

    async def _check(self, run: CommissionRun, target: CommissionTarget) -> Evidence:
        """Check that a target finished by an earlier run still has its values. Writes nothing."""
        servo = await self._writer.present(target)
        keys, wanted = await self._compare(run, target, servo, rom_may_be_unknown=True)
        target.record.servo_id, target.record.node_id = servo.servo_id, servo.node_id
        # After a server start ROM may be unknown. It was verified by the earlier run, and only a save changes it.
        unknown = run.request.save and any(servo.registers[key].rom is None for key in keys)
        rom = f"; ROM verified at {when(target.record.ended_at)}" if unknown else ""
        text = f"all {len(wanted)} values read from node {servo.node_id}{rom}; nothing was written"
        verified_at = target.record.ended_at if unknown else None
        values = known(values=len(wanted), node_id=servo.node_id, verified_at=verified_at)
        return Evidence("values_still_verified", text, values)

    async def _compare(
        self, run: CommissionRun, target: CommissionTarget, servo: Servo, *, rom_may_be_unknown: bool
    ) -> tuple[list[str], dict[str, Raw]]:
        """Read all rows stored in ROM. Returns their keys and the requested values.

        Raises UnexpectedResult if RAM, or with save ROM, differs, or if the servo is not on its static node ID.
        """
        keys = [key for key, one in servo.registers.items() if one.parameter.rom]
        await read_rows(self._requests, servo, keys)
        wanted = self._raws(run, target, servo)
        fixed = target.wanted.node_id
        if run.request.save and fixed and servo.node_id != fixed:
            raise UnexpectedResult(
                f"{servo.title} responds on node {servo.node_id} instead of {fixed}.",
                key="node_id",
                cause="node_id_mismatch",
                servo=servo.title,
                node_id=servo.node_id,
                wanted_node_id=fixed,
            )
        wrong: list[dict[str, object]] = []
        texts: list[str] = []
        for key, raw in wanted.items():
            found = {"RAM": servo.configured(key)} | ({"ROM": servo.registers[key].rom} if run.request.save else {})
            for place, held in found.items():
                if held != raw and not (held is None and place == "ROM" and rom_may_be_unknown):
                    fact, text = difference(servo, key, raw, held, f"in {place} is ")
                    wrong.append({**fact, "in": place})
                    texts.append(text)
        if wrong:
            raise UnexpectedResult(
                f"{servo.title} has other values than requested: {'; '.join(texts)}.",
                differences=wrong,
                cause="values_differ",
                servo=servo.title,
                keys=[one["key"] for one in wrong],
            )
        return keys, wanted

    def _raws(self, run: CommissionRun, target: CommissionTarget, servo: Servo) -> dict[str, Raw]:
        """All requested values, raw by key."""
        values = wanted_values(self._profiles, run.request, target.wanted, servo)
        known: dict[str, Raw | None] = dict(servo.raws())
        wanted: dict[str, Raw] = {}
        for key in sorted(values, key=lambda key: servo.registers[key].parameter.unit_when is not None):
            wanted[key] = known[key] = scale.to_raw(servo.registers[key].parameter, values[key], known)
        return wanted

    def _check_free(self, target: CommissionTarget, servo: Servo) -> None:
        """Raises Conflict if a servo on the bus still has an ID that this target is to get."""
        for key, number in target.wanted.ids.items():
            others = [one for one in self._fleet.all() if one.online and one.uid != servo.uid]
            holder = next((one for one in others if number and getattr(one, key) == number), None)
            if holder is not None:
                raise Conflict(
                    f"{key.replace('_', ' ').capitalize()} {number} is still in use by {holder.title}, whose ID could "
                    "not be changed first.",
                    key=key, requested=number, owner=holder.uid, owner_title=holder.title, cause="id_still_in_use",
                )  # fmt: skip

    def _note(self, run: CommissionRun, target: CommissionTarget) -> None:
        record = target.record
        after: dict[str, Json] = {
            "label": record.label,
            "servo_id": record.servo_id,
            "node_id": record.node_id,
            "profile": record.profile,
        }
        outcome = "succeeded" if target.problem is None else "failed"
        notes: tuple[Note, ...] = () if run.request.save else (Note("RAM only, not saved to ROM.", "ram_only"),)
        if target.problem is not None:
            notes = (Note.of(target.problem),)
        elif record.problem_text:
            notes = (Note(record.problem_text, "servo_id_zero"),)
        wanted = asdict(target.wanted)
        requested = {key: value for key, value in wanted.items() if key != "uid" and value not in (None, "")}
        self._audit.note(
            NewAuditEntry(
                run.by, "commissioning", outcome, target.uid, requested=requested, after=after, notes=notes,
                job=run.job.id,
            )
        )  # fmt: skip
