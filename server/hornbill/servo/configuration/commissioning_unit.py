"""Owns Crew: what commissioning does to one servo, step by step, and what it writes down about it."""

from dataclasses import asdict
from typing import Protocol

from hornbill.errors import Conflict, NotAsWanted
from hornbill.schema import scale
from hornbill.servo.asking import Asker
from hornbill.servo.configuration.audit import Audit
from hornbill.servo.configuration.commission_hands import Hands, Needless
from hornbill.servo.configuration.commission_run import Run, Unit, wanted_values
from hornbill.servo.configuration.parking import Parking
from hornbill.servo.configuration.profiles import Profile, Profiles
from hornbill.servo.configuration.report import when
from hornbill.servo.fleet import Fleet
from hornbill.servo.identification import read_rows
from hornbill.servo.servo import Servo
from hornbill.servo.timebase import TimeBase
from hornbill.servo.wiggle import Wiggle
from hornbill.store.audit import Entry
from hornbill.store.tables import Json
from hornbill.units import Raw


class SetLabel(Protocol):
    """Gives a servo a nickname; `by` and `job` are for the audit."""

    def __call__(self, servo: Servo, label: str, *, by: str, job: str | None = None) -> None: ...


class Crew:
    """Does the steps. A HornbillError of a step is that unit's problem, and never leaves here."""

    def __init__(
        self,
        hands: Hands,
        parking: Parking,
        asker: Asker,
        base: TimeBase,
        fleet: Fleet,
        profiles: Profiles,
        wiggle: Wiggle,
        audit: Audit,
        set_label: SetLabel,
    ) -> None:
        """`set_label` gives a nickname."""
        self._hands = hands
        self._parking = parking
        self._asker = asker
        self._base = base
        self._fleet = fleet
        self._profiles = profiles
        self._wiggle = wiggle
        self._audit = audit
        self._set_label = set_label

    async def commission(self, run: Run, unit: Unit) -> None:
        """Every step of a unit, up to its first problem."""
        if unit.problem is not None:  # it could not step aside
            self._leave_out(run, unit, "it failed before")
            return
        sheet = unit.sheet
        sheet.started_at = sheet.started_at or self._base.utc_now()
        sheet.by = run.by
        if run.request.profile is not None:
            profile = Profile(**run.request.profile)
            sheet.profile, sheet.profile_revision = (
                profile.name,
                f"{when(profile.updated_at)}, tables {profile.schema_revision}",
            )
        does = {"identify": self._identify, "write": self._write, "save": self._save, "verify": self._verify}
        for kind in run.request.kinds:
            if not await self._hands.step(run, unit, kind, does[kind]):
                break
        sheet.ended_at = self._base.utc_now()
        sheet.verdict = "done" if unit.problem is None else "failed"
        run.tell()
        self._note(run, unit)

    async def check(self, run: Run, unit: Unit) -> None:
        """Whether a unit that was finished in an earlier run still holds what it was found to hold. Writes nothing."""
        if await self._hands.step(run, unit, "check", self._still):
            return
        unit.sheet.verdict = "failed"
        run.tell()

    async def clear_up(self, run: Run) -> None:
        """Put back the servo ids of those that stepped aside and did not come to their turn, and say who did not."""
        for unit in run.units:
            if unit.aside is not None and unit.sheet.verdict != "done":
                await self._parking.put_back(run, unit)
            if unit.problem is None and unit.sheet.verdict == "waiting":
                unit.sheet.verdict = "not_tried"
            self._leave_out(run, unit, "an anomaly ended the job" if unit.problem is None else "it failed before")

    async def _identify(self, run: Run, unit: Unit) -> str:
        servo = await self._hands.present(unit)
        job = self._wiggle.identify(servo, run.lease_id, by=run.by)
        await self._hands.ended(job, servo)
        return f"by its own node {servo.node_id}, and back where it was"

    async def _write(self, run: Run, unit: Unit) -> str:
        servo = await self._hands.present(unit)
        self._check_free(unit, servo)
        values = wanted_values(self._profiles, run.request, unit.wanted, servo)
        if unit.wanted.node_id == 0 and servo.node_id in run.fixed:
            self._parking.pin_elsewhere(run, servo)
        written = await self._hands.apply(run, servo, values) if values else 0
        unit.aside = None
        if unit.wanted.label and unit.wanted.label != servo.label:
            self._set_label(servo, unit.wanted.label, by=run.by, job=run.job.id)
        unit.sheet.identify(servo)
        return f"{written} rows written and read back, {len(values) - written} as they were"

    async def _save(self, run: Run, unit: Unit) -> str:
        servo = await self._hands.present(unit)
        wanted = self._raws(run, unit, servo)
        fixed = unit.wanted.node_id
        if all(servo.registers[key].rom == raw for key, raw in wanted.items()) and fixed in (None, 0, servo.node_id):
            raise Needless("not needed: ROM is known to hold everything already")
        await self._hands.save(run, servo)
        return "in ROM, read back after the restart"

    async def _verify(self, run: Run, unit: Unit) -> str:
        servo = await self._hands.present(unit)
        kept, wanted = await self._compare(run, unit, servo, rom_may_be_unknown=False)
        fixed, saved = unit.wanted.node_id, run.request.save
        held = {key: servo.registers[key].rom if saved else servo.raw(key) for key in kept}
        unit.sheet.identify(servo)
        unit.sheet.prove(servo, {key: raw for key, raw in held.items() if raw is not None}, "rom" if saved else "ram")
        if saved and fixed:
            self._parking.forget_allocation(run, servo)
        where = "RAM and ROM hold" if saved else "RAM holds, and ROM does not,"
        return f"{where} all {len(wanted)} values, read from node {servo.node_id}"

    async def _still(self, run: Run, unit: Unit) -> str:
        servo = await self._hands.present(unit)
        kept, wanted = await self._compare(run, unit, servo, rom_may_be_unknown=True)
        unit.sheet.servo_id, unit.sheet.node_id = servo.servo_id, servo.node_id
        # A server that has just started may not know ROM. It was proved then, and only a save of ours changes it.
        unknown = run.request.save and any(servo.registers[key].rom is None for key in kept)
        rom = f"; ROM as proved at {when(unit.sheet.ended_at)}" if unknown else ""
        return f"all {len(wanted)} values read from node {servo.node_id}{rom}; nothing was written"

    async def _compare(
        self, run: Run, unit: Unit, servo: Servo, *, rom_may_be_unknown: bool
    ) -> tuple[list[str], dict[str, Raw]]:
        """Read every row that ROM keeps; their keys, and what was wanted. Raises NotAsWanted for what RAM, or with save
        ROM, does not hold, and for a node that is not on its fixed id.
        """
        kept = [key for key, one in servo.registers.items() if one.parameter.rom]
        await read_rows(self._asker, servo, kept)
        wanted = self._raws(run, unit, servo)
        fixed = unit.wanted.node_id
        if run.request.save and fixed and servo.node_id != fixed:
            raise NotAsWanted(f"{servo.title} answers on node {servo.node_id} instead of {fixed}.", key="node_id")
        wrong: list[dict[str, object]] = []
        said: list[str] = []
        values = servo.raws()
        for key, raw in wanted.items():
            register = servo.registers[key]
            found = {"RAM": register.raw} | ({"ROM": register.rom} if run.request.save else {})
            for place, held in found.items():
                if held != raw and not (held is None and place == "ROM" and rom_may_be_unknown):
                    row = register.parameter
                    shown = [None if one is None else scale.to_value(row, one, values) for one in (raw, held)]
                    wrong.append({"key": key, "wanted": shown[0], "found": shown[1], "in": place})
                    text = "unknown" if held is None else scale.to_text(row, held, values)
                    said.append(f"{row.label} in {place} is {text} instead of {scale.to_text(row, raw, values)}")
        if wrong:
            raise NotAsWanted(f"{servo.title} holds something else: {'; '.join(said)}.", differences=wrong)
        return kept, wanted

    def _raws(self, run: Run, unit: Unit, servo: Servo) -> dict[str, Raw]:
        """Raw by key of everything wanted."""
        values = wanted_values(self._profiles, run.request, unit.wanted, servo)
        known: dict[str, Raw | None] = dict(servo.raws())
        wanted: dict[str, Raw] = {}
        for key in sorted(values, key=lambda key: servo.registers[key].parameter.unit_when is not None):
            wanted[key] = known[key] = scale.to_raw(servo.registers[key].parameter, values[key], known)
        return wanted

    def _check_free(self, unit: Unit, servo: Servo) -> None:
        """Raises Conflict while somebody on the bus has an id this unit is to get: who should have left did not."""
        for key, number in (("servo_id", unit.wanted.servo_id), ("node_id", unit.wanted.node_id)):
            others = [one for one in self._fleet.all() if one.online and one.uid != servo.uid]
            holder = next((one for one in others if number and getattr(one, key) == number), None)
            if holder is not None:
                raise Conflict(
                    f"{key.replace('_', ' ').capitalize()} {number} still is {holder.title}'s, which could not be "
                    "moved first.",
                    key=key, requested=number, owner=holder.uid, owner_title=holder.title,
                )  # fmt: skip

    def _leave_out(self, run: Run, unit: Unit, why: str) -> None:
        for step in run.job.steps:
            if step.uid == unit.wanted.uid and step.state == "waiting":
                run.job.skip(step.name, why)

    def _note(self, run: Run, unit: Unit) -> None:
        sheet = unit.sheet
        after: dict[str, Json] = {
            "label": sheet.label,
            "servo_id": sheet.servo_id,
            "node_id": sheet.node_id,
            "profile": sheet.profile,
        }
        outcome = "succeeded" if unit.problem is None else "failed"
        detail = sheet.problem or ("" if run.request.save else "RAM only: nothing is in ROM")
        wanted = asdict(unit.wanted)
        requested = {key: value for key, value in wanted.items() if key != "uid" and value not in (None, "")}
        self._audit.note(
            Entry(
                run.by, "commissioning", outcome, unit.wanted.uid, requested=requested, after=after, detail=detail,
                job=run.job.id,
            )
        )  # fmt: skip
