"""Plan of a bench file: differences of each servo, and applying them once everything is checked."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, cast

from hornbill.cli.bench.file import BenchEntry, FileErrors, Value, check_keys, configuration
from hornbill.errors import BadRequest, Busy, LeaseHeld, NeedsConfirmation, Stopped, UnexpectedResult

if TYPE_CHECKING:
    from hornbill.client import Hornbill, Servo
    from hornbill.client.sync.servo import Progress


@dataclass(frozen=True, slots=True)
class BenchDifference:
    """A row that differs: value in RAM, in ROM (None: unknown), and wanted value."""

    key: str
    ram: Any
    rom: Any
    wanted: Any
    write: bool


@dataclass(frozen=True, slots=True)
class BenchPlan:
    """Changes of one servo. None if `differences` is empty."""

    entry: BenchEntry
    servo: "Servo"
    revision: str
    differences: list[BenchDifference]
    save: bool
    saved_too: list[str]
    """Rows only in RAM and not in the file, which a save includes."""
    rom_changes: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    """Rows whose ROM value changes: key, before (None: unknown), after."""
    rom_unknown: list[str] = field(default_factory=list[str])
    """Rows that are saved unchanged and whose ROM value is unknown."""
    restart: dict[str, Any] | None = None
    """Effect of the save on the horn."""

    def as_json(self) -> dict[str, Any]:
        """JSON form."""
        return {
            "uid": self.servo.uid, "name": self.servo.title, "save": self.save, "saved_too": self.saved_too,
            "rom_changes": self.rom_changes, "rom_unknown": self.rom_unknown, "restart": self.restart,
            "differences": [
                {"key": one.key, "ram": one.ram, "rom": one.rom, "wanted": one.wanted} for one in self.differences
            ],
        }  # fmt: skip


def plan(
    hornbill: "Hornbill", file: str, entries: Sequence[BenchEntry], *, refresh: bool = True, saves: bool = True
) -> list[BenchPlan]:
    """Compute the differences of every servo. Writes nothing.

    `saves`: also plan the saves, with all checks of the server.

    Raises InvalidValue with the line of every unknown or invalid entry of the file.
    """
    errors = FileErrors(file)
    check_keys(entries, [row["key"] for row in configuration(hornbill.schema()["parameters"])], errors)
    servos = _servos(hornbill, entries, errors)
    profiles = {one["name"]: one["values"] for one in hornbill.profiles()}
    for entry in entries:
        if entry.profile is not None and entry.profile not in profiles:
            text = f"Unknown profile {entry.profile!r}. Known profiles: {', '.join(sorted(profiles)) or 'none'}."
            errors.add(entry.lines.get("profile", entry.lines[""]), text)
    errors.check()
    made: list[BenchPlan] = []
    for entry, servo in zip(entries, servos, strict=True):
        assert servo is not None
        given = {} if entry.profile is None else profiles[entry.profile]
        try:
            made.append(_one(servo, entry, given, refresh=refresh, saves=saves))
        except (Busy, Stopped, LeaseHeld):
            raise
        except BadRequest as error:
            key = str(error.facts.get("key") or _culprit(servo, entry))
            remedy = ""
            if isinstance(error, NeedsConfirmation):
                words = error.facts.get("choices") or [error.facts.get("confirm")]
                each = " or ".join(f'confirm = ["{word}"]' for word in cast("list[str]", words))
                remedy = f" To confirm, add {each} to this servo."
            line = entry.lines.get(f"values.{key}", entry.lines[""])
            errors.add(line, f"{servo.title}{f', {key}' if key else ''}: {error.detail}{remedy}")
    errors.check()
    return made


def apply_plans(
    hornbill: "Hornbill", file: str, plans: Sequence[BenchPlan], on_progress: "Progress | None" = None
) -> None:
    """Apply the plans, servo by servo, each all or nothing, and verify the result.

    Raises StaleRevision if a servo was changed since the plan, UnexpectedResult if differences remain, and errors of
    the servos.
    """
    changed = [one for one in plans if one.differences]
    for one in changed:
        values = {row.key: row.wanted for row in one.differences if row.write}
        if values:
            one.servo.write_many(
                values, save=one.save, if_match=one.revision, confirm=one.entry.confirm, on_progress=on_progress
            )
        else:
            one.servo.save(confirm=one.entry.confirm, on_progress=on_progress)
    if not changed:
        return
    left = [one for one in plan(hornbill, file, [one.entry for one in changed], saves=False) if one.differences]
    if left:
        rows = "; ".join(f"{one.servo.title}: {', '.join(row.key for row in one.differences)}" for one in left)
        raise UnexpectedResult(f"After writing, these rows still differ from the file: {rows}.", cause=None)


def _servos(hornbill: "Hornbill", entries: Sequence[BenchEntry], errors: FileErrors) -> "list[Servo | None]":
    every = hornbill.servos()
    known = ", ".join(sorted(one.title for one in every)) or "none"
    found: list[Servo | None] = []
    seen: dict[str, BenchEntry] = {}
    for entry in entries:
        line = entry.lines.get(entry.by, entry.lines[""])
        fitting = [one for one in every if {**one.known}[entry.by] == entry.name]
        if len(fitting) != 1:
            text = f"{len(fitting)} servos have {entry.title}." if fitting else f"No servo has {entry.title}."
            errors.add(line, f"{text} Known servos: {known}.")
        elif not fitting[0].known["online"]:
            errors.add(line, f"{fitting[0].title} is off the bus. Check its supply and wiring.")
        elif fitting[0].uid in seen:
            errors.add(line, f"{fitting[0].title} is already listed in line {seen[fitting[0].uid].lines['']}.")
        found.append(fitting[0] if len(fitting) == 1 else None)
        if len(fitting) == 1:
            seen.setdefault(fitting[0].uid, entry)
    return found


def _culprit(servo: "Servo", entry: BenchEntry) -> str:
    """First key of the entry that is refused on its own; "" if only their combination is."""
    for key, value in entry.values.items():
        try:
            servo.write_many({key: value}, dry_run=True, confirm=entry.confirm)
        except BadRequest:
            return key
    return ""


def _one(servo: "Servo", entry: BenchEntry, given: dict[str, Any], *, refresh: bool, saves: bool) -> BenchPlan:
    readings = servo.read_all(refresh=refresh)["parameters"]
    # Rows of a profile that the servo lacks are skipped; rows of the file itself are required.
    wanted: dict[str, Value] = {key: value for key, value in given.items() if key in readings and value is not None}
    wanted |= entry.values
    if not wanted:
        return BenchPlan(entry, servo, "", [], False, [])
    planned = servo.write_many(wanted, dry_run=True, confirm=entry.confirm)
    differences: list[BenchDifference] = []
    for change in planned["changes"]:
        reading = readings[change["key"]]
        write = change["verdict"] != "unchanged"
        if write or (entry.save and reading["rom"] != change["requested"]):
            differences.append(
                BenchDifference(change["key"], change["before"], reading["rom"], change["requested"], write)
            )
    save = entry.save and bool(differences)
    others = [key for key in servo.refresh()["unsaved"] if key not in wanted] if save else []
    found = BenchPlan(entry, servo, planned["revision"], differences, save, others)
    if not (save and saves):
        return found
    preview = servo.write_many(wanted, dry_run=True, save=True, confirm=entry.confirm)
    return replace(
        found, rom_changes=[{**one} for one in preview["rom_changes"]], rom_unknown=preview["rom_unknown"],
        restart=None if preview["restart"] is None else {**preview["restart"]},
    )  # fmt: skip
