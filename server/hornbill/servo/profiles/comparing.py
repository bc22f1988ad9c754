"""Comparison of servos, snapshots, profiles and defaults."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from hornbill.domain.change import Comparison, Difference
from hornbill.errors import InvalidValue, NoResponse, Unknown
from hornbill.schema import scale
from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import from_text
from hornbill.schema.parameter import Parameter
from hornbill.schema.scale import Value
from hornbill.servo.configuration.history import configured_values
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.profiles.profiles import Profiles
from hornbill.store.snapshots import StoredSnapshot
from hornbill.store.store import Store
from hornbill.units import Raw, Uid

FORMS = "servo:UID (RAM), rom:UID, snapshot:ID, snapshot-rom:ID, profile:NAME, default:MODEL or default:MODEL@FIRMWARE"
"""Syntax of a side's name."""

HIGHEST_ID = 2**31 - 1
"""Highest ID in the store."""

_UID = re.compile(r"[0-9a-f]{32}")
_ID = re.compile(r"[0-9]{1,10}")
_PROFILE = re.compile(r"[^/\\\x00-\x1f]{1,80}")


@dataclass(frozen=True, slots=True)
class Side:
    """One side of a comparison, or the source of a restore.

    `values`: rows of the side that are stored in ROM (0x20 to 0x46), in engineering units, None if unknown. `units`:
    unit of each number that has one; 0x36 follows 0x37 (section 4.30).
    """

    name: str
    title: str
    values: Mapping[str, Value]
    units: Mapping[str, str]


def compare(catalog: Catalog, left: Side, right: Side, *, identity: bool = False) -> Comparison:
    """Differences of two sides. Includes rows 0x44 to 0x46, which differ between any two servos, only with `identity`.

    An unknown value equals nothing, not even another unknown value.
    """
    same, found = 0, list[Difference]()
    for row in catalog.parameters.values():
        key = row.key
        if (key not in left.values and key not in right.values) or (row.identity and not identity):
            continue
        mine, other = left.values.get(key), right.values.get(key)
        units = left.units.get(key, ""), right.units.get(key, "")
        if _equal(mine, other) and units[0] == units[1]:
            same += 1
        else:
            found.append(Difference(key, mine, other, *units, key in left.values, key in right.values, row.identity))
    return Comparison(left.name, right.name, same, found)


def side_of(name: str, title: str, rows: Mapping[str, Parameter], raws: Mapping[str, Raw | None]) -> Side:
    """A side with the values `raws` of `rows`. Rows not stored in ROM are left out."""
    values: dict[str, Value] = {}
    units: dict[str, str] = {}
    for key, row in rows.items():
        if not row.rom:
            continue
        raw, decides = raws.get(key), row.unit_when
        if decides is not None and decides.parameter in rows and raws.get(decides.parameter) is None:
            raw = None  # without its unit the number is unknown
        values[key] = None if raw is None else scale.to_value(row, raw, raws)
        if row.kind == "number" and (unit := scale.unit_of(row, raws)[0]):
            units[key] = unit
    return Side(name, title, values, units)


def snapshot_side(catalog: Catalog, snapshot: StoredSnapshot, source: str = "ram") -> Side:
    """The `ram` or `rom` values of a snapshot, for the model and firmware its servo had."""
    form = "snapshot" if source == "ram" else "snapshot-rom"
    raws = snapshot.ram if source == "ram" else snapshot.rom
    title = f"snapshot {snapshot.id}" if source == "ram" else f"ROM in snapshot {snapshot.id}"
    return side_of(f"{form}:{snapshot.id}", title, _rows(catalog, snapshot.model, snapshot.firmware, raws), raws)


class Sides:
    """Resolves names to sides. Sends nothing."""

    def __init__(self, catalog: Catalog, fleet: Fleet, store: Store, profiles: Profiles) -> None:
        self._catalog = catalog
        self._fleet = fleet
        self._store = store
        self._profiles = profiles

    async def get(self, name: str) -> Side:
        """The side with a name in one of FORMS.

        Raises InvalidValue for another syntax or an unknown model or firmware; Unknown (unknown_servo,
        unknown_snapshot, unknown_profile); NoResponse for RAM of a servo that is offline.
        """
        form, _, rest = name.partition(":")
        if form in ("servo", "rom") and _UID.fullmatch(rest):
            return self._ram(name, Uid(rest)) if form == "servo" else self._rom(name, Uid(rest))
        if form in ("snapshot", "snapshot-rom") and _ID.fullmatch(rest):
            return snapshot_side(self._catalog, await self.snapshot(int(rest)), "ram" if form == "snapshot" else "rom")
        if form == "profile" and _PROFILE.fullmatch(rest):
            profile = self._profiles.get(rest)
            return Side(name, f'profile "{rest}"', profile.values, profile.units)
        if form == "default" and rest:
            return self._default(name, rest)
        raise InvalidValue(
            f'"{name[:60]}" cannot be compared. Use {FORMS}.',
            cause="side_unknown",
            requested=name[:200],
        )

    async def snapshot(self, snapshot_id: int) -> StoredSnapshot:
        """The snapshot with this ID. Accepts any integer. Raises Unknown (unknown_snapshot)."""
        if not 0 < snapshot_id <= HIGHEST_ID:
            raise Unknown(
                "unknown_snapshot",
                f"There is no snapshot {snapshot_id}.",
                snapshot=snapshot_id,
                cause="snapshot_not_found",
            )
        return await self._store.run(self._store.snapshots.get, snapshot_id)

    def _ram(self, name: str, uid: Uid) -> Side:
        if not self._fleet.knows(uid) and self._store.servos.get(uid) is not None:
            raise NoResponse(
                f"Servo {uid[:8]} is offline, so its RAM values are unknown. Use rom:{uid} instead.",
                cause="ram_unknown",
                servo=f"servo {uid[:8]}",
            )
        servo = self._fleet.get(uid)
        if not servo.online:
            raise NoResponse(
                f"{servo.title} is offline, so its RAM values are unknown. Use rom:{uid} instead.",
                cause="ram_unknown",
                servo=servo.title,
            )
        rows = {key: one.parameter for key, one in servo.registers.items()}
        return side_of(name, f"RAM of {servo.title}", rows, configured_values(servo))

    def _rom(self, name: str, uid: Uid) -> Side:
        one = None if self._fleet.knows(uid) else self._store.servos.get(uid)
        if one is not None:
            title = f"ROM of {one.label or f'servo {uid[:8]}'}"
            return side_of(name, title, _rows(self._catalog, one.facts.model, one.facts.firmware, one.rom), one.rom)
        servo = self._fleet.get(uid)
        rows = {key: one.parameter for key, one in servo.registers.items()}
        return side_of(name, f"ROM of {servo.title}", rows, servo.rom())

    def _default(self, name: str, rest: str) -> Side:
        model_name, at, firmware = rest.partition("@")
        model = self._catalog.models.get(model_name)
        if model is None:
            known = ", ".join(self._catalog.models)
            raise InvalidValue(
                f'Unknown model "{model_name[:40]}". Use one of {known}.',
                requested=rest[:200],
                cause="model_unknown",
            )
        rows = model.rows(from_text(firmware) if at else None)
        return side_of(name, f"defaults of {rest}", rows, {key: row.default for key, row in rows.items()})


def _rows(
    catalog: Catalog, model: str | None, firmware: int | None, raws: Mapping[str, Raw]
) -> Mapping[str, Parameter]:
    """The rows of a model. If it is unknown, the rows that have values."""
    known = catalog.models.get(model or "")
    if known is not None:
        return known.rows(firmware)
    return {key: row for key, row in catalog.parameters.items() if key in raws}


def _equal(left: Value, right: Value) -> bool:
    """Whether both are known and equal. The smallest step of any row is 0.1."""
    if left is None or right is None or isinstance(left, bool) != isinstance(right, bool):
        return False
    if isinstance(left, str) or isinstance(right, str):
        return left == right
    return math.isclose(left, right, rel_tol=0.0, abs_tol=1e-6)
