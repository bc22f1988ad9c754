"""Named sets of values, checked before they are kept, and what of one a given servo can take."""

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
from hornbill.servo.configuration.history import held
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
    """What a profile is to hold. `units` may leave out what the document says anyway."""

    values: Mapping[str, object]
    description: str = ""
    model: str | None = None
    firmware: str | None = None
    units: Mapping[str, str] | None = None


@dataclass(frozen=True, slots=True)
class Checked:
    """One value of a draft after the check: its verdict, and unless ok the error that tells why."""

    key: str
    value: Value
    unit: str
    verdict: Verdict
    error: BadRequest | ForbiddenParameter | None = None


class Profiles:
    """Profiles by name, 1 to 80 characters. What is kept was legal in its model, or in one at least."""

    def __init__(self, store: Store, catalog: Catalog, audit: Audit) -> None:
        self._store = store
        self._catalog = catalog
        self._audit = audit

    def all(self) -> list[Profile]:
        """Every profile, by name."""
        return [_profile(one) for one in self._store.profiles.all()]

    def get(self, name: str) -> Profile:
        """One profile. Raises Unknown (unknown_profile)."""
        return _profile(self._store.profiles.get(name))

    def has(self, name: str) -> bool:
        """Whether there is one of that name."""
        try:
            self._store.profiles.get(name)
        except Unknown:
            return False
        return True

    async def put(self, name: str, draft: Draft, *, identity: bool = False, by: str) -> Profile:
        """Check and keep a profile; one of the same name is replaced. Raises the first problem, keeping nothing.

        Problems: Unknown, ForbiddenParameter, ReadOnly, NotInThisModel, OutOfRange, InvalidValue: also for a model
        that does not exist, a unit other than the row's, and identity rows (0x44 to 0x46) unless `identity`.
        """
        checked = self.check(draft, identity=identity)
        for one in checked:
            if one.error is not None:
                raise one.error
        if not checked:
            raise InvalidValue("A profile without values is none. Give at least one.", cause="no_values")
        before = _json(self.get(name).values) if self.has(name) else None
        ordered = sorted(checked, key=lambda one: self._catalog.parameters[one.key].address)
        values = {one.key: one.value for one in ordered}
        document: dict[str, Json] = {
            "description": draft.description, "model": draft.model, "firmware": draft.firmware,
            "schema_revision": self._catalog.revision, "values": _json(values),
            "units": {one.key: one.unit for one in ordered if one.unit},
        }  # fmt: skip
        kept = _profile(await self._store.run(self._store.profiles.put, name, document))
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
        return kept

    async def drop(self, name: str, *, by: str) -> None:
        """Forget one. Raises Unknown (unknown_profile)."""
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
        """What RAM of a servo holds, of `keys` or of all rows but torque mode and, unless asked, identity.

        They are all read first: another tool may have written them. Raises NotInThisModel, Busy, NoResponse,
        BusDisconnected.
        """
        if servo.model is None:
            raise NotInThisModel(
                f"{servo.title} is of series {servo.model_number} (0x50), which hornbill does not know, so no profile "
                "can be made from it. Take a snapshot.",
                cause="profile_of_unknown_series",
                servo=servo.title,
            )
        permission.check_writable(servo)
        rows = {key: one.parameter for key, one in servo.registers.items()}
        wanted = _wanted(rows, keys, servo.title, identity=identity)
        deciding = [row.unit_when.parameter for key in wanted if (row := rows[key]).unit_when is not None]
        async with servo.changing:  # half a change, which may yet be undone, is nothing to keep
            await read_rows(requests, servo, list(dict.fromkeys((*wanted, *deciding))))
            values, units = _engineering(rows, held(servo), wanted)
        return Draft(values, description, servo.model.name, servo.firmware_text, units)

    def from_snapshot(
        self, snapshot: StoredSnapshot, keys: Sequence[str] | None, *, identity: bool, description: str = ""
    ) -> Draft:
        """What RAM held when a snapshot was taken, of the same rows as `from_servo`. Raises NotInThisModel."""
        model = self._catalog.models.get(snapshot.model or "")
        if model is None:
            raise NotInThisModel(
                f"Snapshot {snapshot.id} is of no known model, so hornbill cannot tell what it means.",
                cause="snapshot_of_unknown_model",
                snapshot=snapshot.id,
            )
        rows = model.rows(snapshot.firmware)
        wanted = _wanted(rows, keys, f"snapshot {snapshot.id}", identity=identity)
        values, units = _engineering(rows, snapshot.ram, wanted)
        firmware = None if snapshot.firmware is None else to_text(snapshot.firmware)
        return Draft(values, description, model.name, firmware, units)

    def check(self, draft: Draft, *, identity: bool = False) -> list[Checked]:
        """A verdict on every value, in the order given. Raises InvalidValue for a model or firmware that is none."""
        candidates = self._candidates(draft)
        units = draft.units or {}
        return [
            self._check(key, value, draft.values, units, candidates, identity) for key, value in draft.values.items()
        ]

    def values_for(self, profile: Profile, servo: Servo) -> tuple[dict[str, Value], list[LeftOut]]:
        """What of a profile this servo takes, and the rows it does not have.

        Raises NotInThisModel for a servo of no known model, OutOfRange for a value its model does not allow,
        InvalidValue for 0x36 in another unit than its PWM mode gives it: then nothing of it is to be written.
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
        """The rows of every model the draft may be for."""
        firmware = None if draft.firmware is None else from_text(draft.firmware)
        if draft.model is None:
            return [model.rows(firmware) for model in self._catalog.models.values()]
        model = self._catalog.models.get(draft.model)
        if model is None:
            known = ", ".join(self._catalog.models)
            raise InvalidValue(
                f'There is no model "{draft.model[:40]}". Give one of {known}, or none.',
                requested=draft.model,
                cause="no_such_model",
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
                    f"{key} is no row of the model and firmware this is for.", cause="no_row_of_profile", key=key
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
                cause="no_model_allows",
                key=rows[0][1].key,
            )
        return bad("out_of_range" if isinstance(error, OutOfRange) else "invalid", error)

    def _refused(self, key: str, identity: bool) -> tuple[Verdict, BadRequest | ForbiddenParameter] | None:
        """Why no profile holds this key, whatever its value."""
        if not_a_key(key) or key in self._catalog.actions:
            return "forbidden", ForbiddenParameter(
                f"{key[:20]} is nothing a profile may hold. Take it out.", cause="not_for_profiles", key=key[:20]
            )
        try:
            row = self._catalog.parameter(key)
        except Unknown as error:
            return "unknown", error
        if row.group == "command":
            return "forbidden", InvalidValue(
                f"{key} moves the horn, so it is no configuration. Take it out.", cause="command_in_profile", key=key
            )
        if not row.writable:
            return "read_only", ReadOnly(
                f"{row.label} ({row.name}) can only be read. Take it out.", cause="read_only_in_profile", key=row.key
            )
        if row.identity and not identity:
            return "identity", InvalidValue(
                f"{row.label} ({row.name}) belongs to one servo. Take it out, or ask for identity rows.",
                cause="identity_in_profile",
                key=row.key,
            )
        return None


def not_in(model: str, firmware: str | None) -> Note:
    """Why a row that a model lacks is left out."""
    text = f"{model} with firmware {firmware or 'unknown'} does not have it."
    return Note(text, "not_in_servo", known(model=model, firmware=firmware))


def left_out(key: str, why: Note) -> LeftOut:
    """A row that is not written."""
    return LeftOut(key, why.text, why.code, why.params)


def _wanted(rows: Mapping[str, Parameter], keys: Sequence[str] | None, whose: str, *, identity: bool) -> list[str]:
    """The rows to take: those named, or all that ROM keeps but torque mode and, unless asked, identity.

    Torque mode only by name: applying a profile must not switch the output of a servo in passing.
    """
    if keys is None:
        return [key for key, row in rows.items() if row.rom and key != KEY and (identity or not row.identity)]
    for key in keys:
        if key not in rows:
            raise NotInThisModel(f"{key[:60]} is no row that {whose} has.", key=key[:60], cause="no_row_of_profile")
        if not rows[key].rom:
            raise InvalidValue(
                f"{key} is no configuration: ROM does not keep it. Take it out.", key=key, cause="not_kept_in_rom"
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
    """The raw value that decides the row's unit: from the profile's own values, else from the unit it states."""
    other = row.unit_when
    if other is None or other.parameter not in rows:
        return {}
    if other.parameter in values:
        try:
            return {other.parameter: scale.to_raw(rows[other.parameter], values[other.parameter])}
        except BadRequest:
            return {}  # that row has a verdict of its own
    return {other.parameter: other.raw} if units.get(row.key) == other.unit else {}


def _check_unit(row: Parameter, stated: str | None, known: Mapping[str, Raw | None], whose: str) -> None:
    """Raises InvalidValue when the unit stated is not the row's."""
    unit = scale.unit_of(row, known)[0] if row.kind == "number" else ""
    if stated is None or stated == unit:
        return
    why = "" if row.unit_when is None else f": it follows {row.unit_when.parameter} of {whose}"
    raise InvalidValue(
        f'{row.label} is stated in "{stated[:10]}", and its unit is "{unit}"{why}. State it in that unit.',
        unit=unit,
        cause="other_unit",
        key=row.key,
        stated=stated[:10],
    )


def _json(values: Mapping[str, Value]) -> dict[str, Json]:
    return dict(values)


def _profile(kept: StoredProfile) -> Profile:
    document = cast("Mapping[str, Any]", kept.document)
    return Profile(name=kept.name, created_at=kept.created_at, updated_at=kept.updated_at, **document)
