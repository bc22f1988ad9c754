"""Record of one servo in the result of a job. A report needs neither the servo nor the bus."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from typing import Any, Literal, TypeAlias, cast

from hornbill.domain.profile import Profile
from hornbill.errors import HornbillError
from hornbill.schema import scale
from hornbill.schema.firmware import to_text
from hornbill.schema.scale import Value
from hornbill.servo.device.servo import Servo
from hornbill.store.servos import StoredServo
from hornbill.units import Raw, Uid

Verdict: TypeAlias = Literal["waiting", "done", "failed", "not_tried"]


@dataclass(slots=True)
class ServoRecord:
    """One servo of a job. `values`: engineering values as read back. `units`: unit of each number that has one.

    `verified_in`: rom (read after a restart), ram, or "" if not verified. Instants: seconds since 1970 UTC.
    `verdict`: waiting, done, failed or not_tried. `problem`: the failure as JSON.
    """

    uid: Uid
    title: str = ""
    label: str = ""
    serial: str | None = None
    model: str | None = None
    firmware: str | None = None
    hardware_version: int | None = None
    production_date: str | None = None
    servo_id: int | None = None
    node_id: int | None = None
    by: str = ""
    profile: str | None = None
    profile_revision: str | None = None
    values: dict[str, Value] = field(default_factory=dict[str, Value])
    units: dict[str, str] = field(default_factory=dict[str, str])
    verified_in: Literal["rom", "ram", ""] = ""
    verdict: Verdict = "waiting"
    problem: Mapping[str, Any] | None = None
    started_at: float | None = None
    ended_at: float | None = None

    @property
    def duration_s(self) -> float | None:
        """Time from the first to the last step, s."""
        return None if self.started_at is None or self.ended_at is None else self.ended_at - self.started_at

    @property
    def problem_text(self) -> str | None:
        """The failure, in English."""
        return None if self.problem is None else self.problem["detail"]

    def fail(self, problem: HornbillError) -> None:
        """Record a failure."""
        self.verdict, self.problem = "failed", problem_document(problem)

    def use(self, profile: Profile) -> None:
        """Record the applied profile."""
        self.profile = profile.name
        self.profile_revision = f"{when(profile.updated_at)}, tables {profile.schema_revision}"

    def identify(self, servo: Servo) -> None:
        """Record the servo's current identity."""
        self.title, self.label, self.serial = servo.title, servo.label, servo.serial
        self.model = servo.model.name if servo.model else None
        self.firmware, self.hardware_version = servo.firmware_text, servo.hardware_version
        self.production_date = servo.production_date
        self.servo_id, self.node_id = servo.servo_id, servo.node_id

    def prove(self, servo: Servo, found: Mapping[str, Raw], verified_in: Literal["rom", "ram"]) -> None:
        """Record the values read back, raw by key."""
        rows = {key: servo.registers[key].parameter for key in found}
        self.values = {key: scale.to_value(row, found[key], found) for key, row in rows.items()}
        numbers = {key: row for key, row in rows.items() if row.kind == "number"}
        self.units = {key: unit for key, row in numbers.items() if (unit := scale.unit_of(row, found)[0])}
        self.verified_in = verified_in

    def document(self) -> dict[str, object]:
        """The record as JSON."""
        return asdict(self)


def when(at: float | None) -> str:
    """An instant in ISO 8601, such as 2026-05-04T10:00:00Z. Empty for None."""
    return "" if at is None else datetime.fromtimestamp(at, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def problem_document(error: HornbillError) -> dict[str, object]:
    """A problem in the result of a job: code, title, detail, and those facts that JSON can represent."""
    plain: dict[str, object] = {
        key: one for key, one in error.facts.items() if isinstance(one, str | int | float | list | dict)
    }
    return {**plain, "code": error.code, "title": error.title, "detail": error.detail}


def of_result(result: Mapping[str, object] | None) -> dict[Uid, ServoRecord]:
    """The records in the result of a job, by servo. Entries in another format are left out."""
    entries = (result or {}).get("servos")
    listed = cast("list[object]", entries) if isinstance(entries, list) else []
    known = {one.name for one in fields(ServoRecord)}
    found: dict[Uid, ServoRecord] = {}
    for entry in listed:
        if isinstance(entry, Mapping) and {"uid", "verdict"} <= entry.keys():
            document = cast("Mapping[str, Any]", entry)
            record = ServoRecord(**{key: value for key, value in document.items() if key in known})
            found[record.uid] = record
    return found


def saved(servo: Servo, *, by: str, began: float, ended: float) -> dict[str, object]:
    """The record of a servo whose ROM has just been read back, as JSON. Instants: seconds since 1970 UTC."""
    made = ServoRecord(servo.uid, by=by, verdict="done", started_at=began, ended_at=ended)
    made.identify(servo)
    made.prove(servo, servo.rom(), "rom")
    return made.document()


def of_inventory(uid: Uid, stored: StoredServo | None) -> ServoRecord:
    """A record from the inventory, for jobs that did not record the servo."""
    record = ServoRecord(uid)
    if stored is None:
        return record
    facts = stored.facts
    record.label, record.serial, record.model = stored.label, stored.serial_text, facts.model
    record.title = stored.label or record.serial or f"servo {uid[:8]}"
    record.firmware = None if facts.firmware is None else to_text(facts.firmware)
    record.hardware_version, record.production_date = facts.hardware_version, facts.production_date
    record.servo_id, record.node_id = facts.servo_id, facts.node_id
    return record
