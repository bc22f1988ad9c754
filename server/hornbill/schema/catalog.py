"""Owns the catalogue: every table read once, checked against the others, found by key, address or model."""

import difflib
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from hornbill import resources
from hornbill.errors import Unknown
from hornbill.schema import check, overlay
from hornbill.schema.effect import EffectRule
from hornbill.schema.fault import FaultBit
from hornbill.schema.model import Series, ServoModel
from hornbill.schema.parameter import Group, Parameter
from hornbill.schema.tables import EffectsTable, FaultsTable, ParametersTable, read


@dataclass(frozen=True, eq=False)
class Catalog:
    """Everything the tables say. `parameters` are the 59 common rows by key, in address order.

    Rows whose numbers depend on the model hold None there; a model's own row has them.
    """

    specification: str
    firmware_steps: tuple[str, ...]
    groups: tuple[Group, ...]
    parameters: Mapping[str, Parameter]
    series: Mapping[str, Series]
    models: Mapping[str, ServoModel]
    overview: tuple[FaultBit, ...]
    faults: tuple[FaultBit, ...]
    effects: tuple[EffectRule, ...]
    revision: str
    by_address: Mapping[int, Parameter]
    readable: Mapping[str, Parameter]
    actions: Mapping[str, Parameter]
    effects_of: Mapping[str, tuple[EffectRule, ...]]

    @property
    def by_key(self) -> Mapping[str, Parameter]:
        """All 59 rows by key: the 55 of `readable`, the three actions and the forbidden one."""
        return self.parameters

    @classmethod
    def load(cls, folder: Path | None = None) -> "Catalog":
        """Reads schemas/ (or `folder`). Raises TableError naming file and row of the first mistake."""
        folder = resources.schemas() if folder is None else folder
        table = read(folder, "parameters.toml", ParametersTable)
        parameters = check.parameters(table)
        series = overlay.series(folder, parameters)
        models = overlay.models(folder, parameters, series, table.firmware)
        fault_table = read(folder, "faults.toml", FaultsTable)
        check.faults(fault_table, parameters)
        rules = read(folder, "effects.toml", EffectsTable).effect
        check.effects(rules, parameters)
        return cls(
            specification=table.specification,
            firmware_steps=table.firmware,
            groups=table.group,
            parameters=MappingProxyType(parameters),
            series=MappingProxyType(series),
            models=MappingProxyType(models),
            overview=fault_table.overview,
            faults=fault_table.fault,
            effects=rules,
            revision=_revision(folder),
            by_address=MappingProxyType({row.address: row for row in parameters.values()}),
            readable=MappingProxyType({key: row for key, row in parameters.items() if row.readable}),
            actions=MappingProxyType({key: row for key, row in parameters.items() if row.action}),
            effects_of=MappingProxyType(
                {key: tuple(rule for rule in rules if key in rule.parameters) for key in parameters}
            ),
        )

    def model(self, model_number: int, hardware_version: int) -> ServoModel | None:
        """The model with this identity, as 0x50 and 0x53 give it, or None (sections 4.40 and 4.43)."""
        for model in self.models.values():
            if (model.model_number, model.hardware_version) == (model_number, hardware_version):
                return model
        return None

    def parameter(self, key: str) -> Parameter:
        """The readable row of this key. Raises Unknown with the nearest key, for actions and 0x49 as well."""
        row = self.readable.get(key)
        if row is not None:
            return row
        near = difflib.get_close_matches(key, self.readable, n=1)
        hint = f" Did you mean {near[0]}?" if near else ""
        raise Unknown("unknown_parameter", f'There is no parameter "{key[:60]}".{hint}', key=key[:60])

    def widest(self, key: str) -> tuple[int | None, int | None]:
        """The lowest minimum and the highest maximum (raw) any model that offers the row allows."""
        rows = [row for model in self.models.values() if (row := model.rows().get(key)) is not None]
        low = [row.minimum for row in rows if row.minimum is not None]
        high = [row.maximum for row in rows if row.maximum is not None]
        return min(low, default=None), max(high, default=None)

    def faults_of(self, pwm: bool) -> tuple[FaultBit, ...]:
        """The detail bits a model with or without PWM input can raise (4.12, note 1)."""
        return tuple(bit for bit in self.faults if pwm or not bit.pwm_only)


def _revision(folder: Path) -> str:
    """Twelve hex digits over names and contents of every table file."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.toml")):
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:12]
