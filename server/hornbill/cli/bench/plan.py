"""What a bench file comes to: what differs on each servo, and bringing it there once all of it is known to go."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, cast

from hornbill.cli.bench.file import BenchEntry, Complaints, Value, check_keys, configuration
from hornbill.errors import BadRequest, Busy, LeaseHeld, NeedsConfirmation, NotAsWanted, Stopped

if TYPE_CHECKING:
    from hornbill.client import Hornbill, Servo
    from hornbill.client.sync.servo import Progress


@dataclass(frozen=True, slots=True)
class BenchDifference:
    """A row that is not as wanted: RAM, what is known of ROM (None: not known), and what is wanted."""

    key: str
    ram: Any
    rom: Any
    wanted: Any
    write: bool


@dataclass(frozen=True, slots=True)
class BenchPlan:
    """What is to be done with one servo; nothing when `differences` is empty."""

    entry: BenchEntry
    servo: "Servo"
    revision: str
    differences: list[BenchDifference]
    save: bool
    saved_too: list[str]
    """Rows that are only in RAM and in no file: a save takes them along."""
    rom_changes: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    """Rows that ROM will hold differently: key, before (None: not known), after."""
    rom_unknown: list[str] = field(default_factory=list[str])
    """Rows that are saved as they are, of which ROM's value is not known."""
    restart: dict[str, Any] | None = None
    """What the save does to the horn."""

    def as_json(self) -> dict[str, Any]:
        """For programs."""
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
    """What differs, servo by servo. Reads every servo and writes nothing.

    `saves`: the saves are planned, too, with every check the server makes of them.

    Raises InvalidValue with a line for whatever in the file is not known or not legal, all of it at once.
    """
    complaints = Complaints(file)
    check_keys(entries, [row["key"] for row in configuration(hornbill.schema()["parameters"])], complaints)
    servos = _servos(hornbill, entries, complaints)
    profiles = {one["name"]: one["values"] for one in hornbill.profiles()}
    for entry in entries:
        if entry.profile is not None and entry.profile not in profiles:
            there = ", ".join(sorted(profiles)) or "none"
            text = f"There is no profile {entry.profile!r}. There is: {there}."
            complaints.add(entry.lines.get("profile", entry.lines[""]), text)
    complaints.tell()
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
                remedy = f" Add {each} to this servo, if that is meant."
            line = entry.lines.get(f"values.{key}", entry.lines[""])
            complaints.add(line, f"{servo.title}{f', {key}' if key else ''}: {error.detail}{remedy}")
    complaints.tell()
    return made


def carry_out(
    hornbill: "Hornbill", file: str, plans: Sequence[BenchPlan], on_progress: "Progress | None" = None
) -> None:
    """Do it, servo by servo, each all or nothing, and look again.

    Raises StaleRevision when a servo was changed since it was planned, NotAsWanted when one is not as the file says
    in the end, and whatever a servo answers.
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
        told = "; ".join(f"{one.servo.title}: {', '.join(row.key for row in one.differences)}" for one in left)
        raise NotAsWanted(f"After all was written, this is not as the file says: {told}.", cause=None)


def _servos(hornbill: "Hornbill", entries: Sequence[BenchEntry], complaints: Complaints) -> "list[Servo | None]":
    every = hornbill.servos()
    there = ", ".join(sorted(one.title for one in every)) or "nobody"
    found: list[Servo | None] = []
    seen: dict[str, BenchEntry] = {}
    for entry in entries:
        line = entry.lines.get(entry.by, entry.lines[""])
        fitting = [one for one in every if {**one.known}[entry.by] == entry.name]
        if len(fitting) != 1:
            text = f"{len(fitting)} servos have {entry.title}." if fitting else f"No servo has {entry.title}."
            complaints.add(line, f"{text} There is: {there}.")
        elif not fitting[0].known["online"]:
            complaints.add(line, f"{fitting[0].title} is not on the bus. Look at its supply and its plug.")
        elif fitting[0].uid in seen:
            complaints.add(line, f"{fitting[0].title} is in line {seen[fitting[0].uid].lines['']} already.")
        found.append(fitting[0] if len(fitting) == 1 else None)
        if len(fitting) == 1:
            seen.setdefault(fitting[0].uid, entry)
    return found


def _culprit(servo: "Servo", entry: BenchEntry) -> str:
    """The first key of the entry that is refused by itself, too; "" when only all of them together are."""
    for key, value in entry.values.items():
        try:
            servo.write_many({key: value}, dry_run=True, confirm=entry.confirm)
        except BadRequest:
            return key
    return ""


def _one(servo: "Servo", entry: BenchEntry, given: dict[str, Any], *, refresh: bool, saves: bool) -> BenchPlan:
    readings = servo.read_all(refresh=refresh)["parameters"]
    # Of a profile, rows a servo does not have are left out; what the file itself says must be there.
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
