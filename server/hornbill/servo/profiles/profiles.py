"""Named sets of values, checked before they are stored, and their selection for a servo."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, cast

from hornbill.domain.change import LeftOut
from hornbill.domain.fields import known
from hornbill.domain.note import Note
from hornbill.domain.profile import Profile
from hornbill.errors import (
    BadRequest,
    ForbiddenParameter,
    InvalidValue,
    NotInThisModel,
    OutOfRange,
    ReadOnly,
    Unknown,
)
from hornbill.schema import scale
from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import from_text, to_text
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value
from hornbill.servo.configuration.changes import not_a_key
from hornbill.servo.configuration.history import configured_values
from hornbill.servo.device import permission
from hornbill.servo.device.identification import read_rows
from hornbill.servo.device.output import KEY
from hornbill.servo.device.requests import ServoRequests
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.audit import Audit
from hornbill.store.audit import NewAuditEntry
from hornbill.store.profiles import StoredProfile
from hornbill.store.snapshots import StoredSnapshot
from hornbill.store.store import Store
from hornbill.store.tables import Json
from hornbill.units import Raw

Verdict: TypeAlias = Literal[
    "ok", "unknown", "forbidden", "read_only", "identity", "out_of_range", "invalid", "not_in_this_model"
]


@dataclass(frozen=True, slots=True)
class Draft:
    """Contents of a profile to store. `units` is optional where the tables define the unit."""

    values: Mapping[str, object]
    description: str = ""
    model: str | None = None
    firmware: str | None = None
    units: Mapping[str, str] | None = None


@dataclass(frozen=True, slots=True)
class Checked:
    """Verdict on one value of a draft, with the error unless ok."""

    key: str
    value: Value
    unit: str
    verdict: Verdict
    error: BadRequest | ForbiddenParameter | None = None


class Profiles:
    """Profiles by name, 1 to 80 characters. Stored values were valid for their model, or for at least one model."""

    def __init__(self, store: Store, catalog: Catalog, audit: Audit) -> None:
        self._store = store
        self._catalog = catalog
        self._audit = audit

    def all(self) -> list[Profile]:
        """All profiles, sorted by name."""
        return [_profile(one) for one in self._store.profiles.all()]

    def get(self, name: str) -> Profile:
        """One profile. Raises Unknown (unknown_profile)."""
        return _profile(self._store.profiles.get(name))

    def has(self, name: str) -> bool:
        """Whether a profile with this name exists."""
        try:
            self._store.profiles.get(name)
        except Unknown:
            return False
        return True

    async def put(self, name: str, draft: Draft, *, identity: bool = False, by: str) -> Profile:
        """Check and store a profile, replacing one with the same name. Raises the first problem without storing.

        Problems: Unknown, ForbiddenParameter, ReadOnly, NotInThisModel, OutOfRange, InvalidValue. The last also for an
        unknown model, a wrong unit, and identity rows (0x44 to 0x46) unless `identity`.
        """
        checked = self.check(draft, identity=identity)
        for one in checked:
            if one.error is not None:
                raise one.error
        if not checked:
            raise InvalidValue("The profile has no values. Add at least one.", cause="values_missing")
        before = _json(self.get(name).values) if self.has(name) else None
        ordered = sorted(checked, key=lambda one: self._catalog.parameters[one.key].address)
        values = {one.key: one.value for one in ordered}
        document: dict[str, Json] = {
            "description": draft.description, "model": draft.model, "firmware": draft.firmware,
            "schema_revision": self._catalog.revision, "values": _json(values),
            "units": {one.key: one.unit for one in ordered if one.unit},
        }  # fmt: skip
        stored = _profile(await self._store.run(self._store.profiles.put, name, document))
        how = ("profile_stored", "stored") if before is None else ("profile_replaced", "replaced")
        self._audit.note(
            NewAuditEntry(
                by,
                "profile",
                "succeeded",
                before=before,
                after=_json(values),
                notes=(Note(f'"{name}" {how[1]}, {len(values)} rows', how[0], {"profile": name, "rows": len(values)}),),
            )
        )
        return stored

    async def drop(self, name: str, *, by: str) -> None:
        """Delete a profile. Raises Unknown (unknown_profile)."""
        before = _json(self.get(name).values)
        await self._store.run(self._store.profiles.drop, name)
        note = Note(f'"{name}" deleted', "profile_deleted", {"profile": name})
        self._audit.note(NewAuditEntry(by, "profile", "succeeded", before=before, notes=(note,)))

    async def from_servo(
        self,
        requests: ServoRequests,
        servo: Servo,
        keys: Sequence[str] | None,
        *,
        identity: bool,
        description: str = "",
    ) -> Draft:
        """A draft of a servo's RAM values, for `keys` or all rows except torque mode and, unless `identity`, identity.

        All rows are read first, because another tool may have written them. Raises NotInThisModel, Busy, NoResponse,
        BusDisconnected.
        """
        if servo.model is None:
            raise NotInThisModel(
                f"{servo.title} is of the unknown series {servo.model_number} (0x50), so no profile can be created "
                "from it. Take a snapshot instead.",
                cause="profile_of_unknown_series",
                servo=servo.title,
            )
        permission.check_writable(servo)
        rows = {key: one.parameter for key, one in servo.registers.items()}
        wanted = _wanted(rows, keys, servo.title, identity=identity)
        deciding = [row.unit_when.parameter for key in wanted if (row := rows[key]).unit_when is not None]
        async with servo.changing:  # an unfinished change may still be rolled back
            await read_rows(requests, servo, list(dict.fromkeys((*wanted, *deciding))))
            values, units = _engineering(rows, configured_values(servo), wanted)
        return Draft(values, description, servo.model.name, servo.firmware_text, units)

    def from_snapshot(
        self, snapshot: StoredSnapshot, keys: Sequence[str] | None, *, identity: bool, description: str = ""
    ) -> Draft:
        """A draft of a snapshot's RAM values, for the same rows as `from_servo`. Raises NotInThisModel."""
        model = self._catalog.models.get(snapshot.model or "")
        if model is None:
            raise NotInThisModel(
                f"Snapshot {snapshot.id} is of an unknown model, so its values cannot be interpreted.",
                cause="snapshot_of_unknown_model",
                snapshot=snapshot.id,
            )
        rows = model.rows(snapshot.firmware)
        wanted = _wanted(rows, keys, f"snapshot {snapshot.id}", identity=identity)
        values, units = _engineering(rows, snapshot.ram, wanted)
        firmware = None if snapshot.firmware is None else to_text(snapshot.firmware)
        return Draft(values, description, model.name, firmware, units)

    def check(self, draft: Draft, *, identity: bool = False) -> list[Checked]:
        """Verdict on each value, in the given order. Raises InvalidValue for an unknown model or firmware."""
        candidates = self._candidates(draft)
        units = draft.units or {}
        return [
            self._check(key, value, draft.values, units, candidates, identity) for key, value in draft.values.items()
        ]

    def values_for(self, profile: Profile, servo: Servo) -> tuple[dict[str, Value], list[LeftOut]]:
        """The values of a profile for this servo, and the rows that it does not have.

        Raises NotInThisModel for an unknown model, OutOfRange for a value that its model does not allow, InvalidValue
        if the unit of 0x36 does not match its PWM mode. Then nothing must be written.
        """
        if servo.model is None:
            raise permission.unknown_series(servo)
        rows = {key: one.parameter for key, one in servo.registers.items()}
        taken = {key: value for key, value in profile.values.items() if key in rows}
        known: dict[str, Raw | None] = dict(servo.raws())
        for key, value in sorted(taken.items(), key=lambda item: rows[item[0]].unit_when is not None):
            row = rows[key]
            try:
                _check_unit(row, profile.units.get(key), known, servo.title)
                known[key] = scale.to_raw(row, value, known)
            except BadRequest as error:
                error.facts.setdefault("key", key)
                error.facts.setdefault("uid", servo.uid)
                raise
        why = not_in(servo.model.name, servo.firmware_text)
        return taken, [left_out(key, why) for key in profile.values if key not in rows]

    def _candidates(self, draft: Draft) -> list[Mapping[str, Parameter]]:
        """The rows of each model that the draft may be for."""
        firmware = None if draft.firmware is None else from_text(draft.firmware)
        if draft.model is None:
            return [model.rows(firmware) for model in self._catalog.models.values()]
        model = self._catalog.models.get(draft.model)
        if model is None:
            known = ", ".join(self._catalog.models)
            raise InvalidValue(
                f'Unknown model "{draft.model[:40]}". Use one of {known}, or none.',
                requested=draft.model,
                cause="model_unknown",
            )
        return [model.rows(firmware)]

    def _check(
        self,
        key: str,
        value: object,
        values: Mapping[str, object],
        units: Mapping[str, str],
        candidates: list[Mapping[str, Parameter]],
        identity: bool,
    ) -> Checked:
        shown = value if isinstance(value, bool | int | float | str) else None

        def bad(verdict: Verdict, error: BadRequest | ForbiddenParameter) -> Checked:
            error.facts.setdefault("key", key[:60])
            return Checked(key, shown, units.get(key, ""), verdict, error)

        refused = self._refused(key, identity)
        if refused is not None:
            return bad(*refused)
        rows = [(one, one[key]) for one in candidates if key in one]
        if not rows:
            return bad(
                "not_in_this_model",
                NotInThisModel(
                    f"The profile's model and firmware do not have {key}.", cause="row_not_in_model", key=key
                ),
            )
        errors: list[BadRequest] = []
        for others, row in rows:
            known = _known(row, others, values, units)
            try:
                _check_unit(row, units.get(key), known, "the profile")
                raw = scale.to_raw(row, value, known)
            except BadRequest as error:
                errors.append(error)
            else:
                unit = scale.unit_of(row, known)[0] if row.kind == "number" else ""
                return Checked(key, scale.to_value(row, raw, known), unit, "ok")
        error = errors[0]
        if len(rows) > 1 and isinstance(error, OutOfRange):
            each = "; ".join(
                dict.fromkeys(scale.allowed(row, _known(row, others, values, units)) for others, row in rows)
            )
            error = OutOfRange(
                f"No model allows {shown} for {rows[0][1].label.lower()}. Enter {each}.",
                **{name: fact for name, fact in error.facts.items() if name not in ("cause", "key")},
                cause="outside_all_models",
                key=rows[0][1].key,
            )
        return bad("out_of_range" if isinstance(error, OutOfRange) else "invalid", error)

    def _refused(self, key: str, identity: bool) -> tuple[Verdict, BadRequest | ForbiddenParameter] | None:
        """Reason why a profile must not contain this key."""
        if not_a_key(key) or key in self._catalog.actions:
            return "forbidden", ForbiddenParameter(
                f"{key[:20]} is not allowed in a profile. Remove it.", cause="not_allowed_in_profile", key=key[:20]
            )
        try:
            row = self._catalog.parameter(key)
        except Unknown as error:
            return "unknown", error
        if row.group == "command":
            return "forbidden", InvalidValue(
                f"{key} moves the horn, so it is not a configuration row. Remove it.",
                cause="command_in_profile",
                key=key,
            )
        if not row.writable:
            return "read_only", ReadOnly(
                f"{row.label} ({row.name}) is read-only. Remove it.", cause="read_only_in_profile", key=row.key
            )
        if row.identity and not identity:
            return "identity", InvalidValue(
                f"{row.label} ({row.name}) is specific to one servo. Remove it, or allow identity rows.",
                cause="identity_in_profile",
                key=row.key,
            )
        return None


def not_in(model: str, firmware: str | None) -> Note:
    """Note for a row that a model lacks."""
    text = f"{model} with firmware {firmware or 'unknown'} does not have it."
    return Note(text, "not_in_servo", known(model=model, firmware=firmware))


def left_out(key: str, why: Note) -> LeftOut:
    """A row left out, with the reason."""
    return LeftOut(key, why.text, why.code, why.params)


def _wanted(rows: Mapping[str, Parameter], keys: Sequence[str] | None, whose: str, *, identity: bool) -> list[str]:
    """The rows to include: `keys`, or all rows stored in ROM except torque mode and, unless `identity`, identity.

    Torque mode is included only by key, because applying a profile must not switch an output unintentionally.
    """
    if keys is None:
        return [key for key, row in rows.items() if row.rom and key != KEY and (identity or not row.identity)]
    for key in keys:
        if key not in rows:
            raise NotInThisModel(
                f"{whose[:1].upper()}{whose[1:]} does not have {key[:60]}.", key=key[:60], cause="row_not_in_model"
            )
        if not rows[key].rom:
            raise InvalidValue(
                f"{key} is not stored in ROM, so it is not a configuration row. Remove it.",
                key=key,
                cause="not_stored_in_rom",
            )
    return list(dict.fromkeys(keys))


def _engineering(
    rows: Mapping[str, Parameter], raws: Mapping[str, Raw], wanted: Sequence[str]
) -> tuple[dict[str, Value], dict[str, str]]:
    found = [key for key in wanted if key in raws]
    numbers = [key for key in found if rows[key].kind == "number"]
    return (
        {key: scale.to_value(rows[key], raws[key], raws) for key in found},
        {key: unit for key in numbers if (unit := scale.unit_of(rows[key], raws)[0])},
    )


def _known(
    row: Parameter, rows: Mapping[str, Parameter], values: Mapping[str, object], units: Mapping[str, str]
) -> dict[str, Raw | None]:
    """The raw value that determines the row's unit: from the profile's values, else from the stated unit."""
    other = row.unit_when
    if other is None or other.parameter not in rows:
        return {}
    if other.parameter in values:
        try:
            return {other.parameter: scale.to_raw(rows[other.parameter], values[other.parameter])}
        except BadRequest:
            return {}  # that row has its own verdict
    return {other.parameter: other.raw} if units.get(row.key) == other.unit else {}


def _check_unit(row: Parameter, stated: str | None, known: Mapping[str, Raw | None], whose: str) -> None:
    """Raises InvalidValue if the stated unit is not the row's unit."""
    unit = scale.unit_of(row, known)[0] if row.kind == "number" else ""
    if stated is None or stated == unit:
        return
    why = "" if row.unit_when is None else f" because of {row.unit_when.parameter} in {whose}"
    raise InvalidValue(
        f'{row.label} is given in "{stated[:10]}", but its unit is "{unit}"{why}. Convert the value to that unit.',
        unit=unit,
        cause="unit_mismatch",
        key=row.key,
        stated=stated[:10],
    )


def _json(values: Mapping[str, Value]) -> dict[str, Json]:
    return dict(values)


def _profile(stored: StoredProfile) -> Profile:
    document = cast("Mapping[str, Any]", stored.document)
    return Profile(name=stored.name, created_at=stored.created_at, updated_at=stored.updated_at, **document)
