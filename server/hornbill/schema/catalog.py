"""The catalogue: all tables, read once and cross-checked, with lookup by key, address and model."""

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
from hornbill.schema.fault import REGISTERS, FaultBit
from hornbill.schema.firmware import FirmwareStep, from_text, to_text
from hornbill.schema.model import Series, ServoModel
from hornbill.schema.parameter import Group, Parameter
from hornbill.schema.tables import EffectsTable, FaultsTable, ParametersTable, read


@dataclass(frozen=True, eq=False)
class Catalog:
    """Contents of all tables. `parameters` are the 59 common rows by key, in address order.

    Numbers that depend on the model are None there; the rows of a model have them.
    """

    specification: str
    firmware: tuple[FirmwareStep, ...]
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
    polled: Mapping[str, float]
    """Polled rows with their periods, s."""
    fault_words: tuple[str, ...]
    """Rows of detail bits, read while the overview is not 0."""
    fault_bits: Mapping[str, FaultBit]
    """Detail bits by key."""
    stops_output: Mapping[str, int]
    """Fault words with bits that mean no output, and the mask of those that do so regardless of readings."""
    protections: Mapping[int, tuple[str, str]]
    """Warning bits of limits outside which torque turns off, with their reading and limit (4.12)."""
    unique: tuple[str, ...]
    """Rows with a number unique to each servo."""

    @property
    def firmware_steps(self) -> tuple[str, ...]:
        """Known versions, oldest first."""
        return tuple(step.version for step in self.firmware)

    @property
    def by_key(self) -> Mapping[str, Parameter]:
        """All 59 rows by key: the 55 of `readable`, the three actions and the forbidden one."""
        return self.parameters

    @classmethod
    def load(cls, folder: Path | None = None) -> "Catalog":
        """Read schemas/ (or `folder`). Raises TableError with file and row of the first error."""
        folder = resources.schemas() if folder is None else folder
        table = read(folder, "parameters.toml", ParametersTable)
        parameters = check.parameters(table)
        series = overlay.series(folder, parameters)
        models = overlay.models(folder, parameters, series, tuple(step.version for step in table.firmware))
        fault_table = read(folder, "faults.toml", FaultsTable)
        check.faults(fault_table, parameters)
        rules = read(folder, "effects.toml", EffectsTable).effect
        check.effects(rules, parameters)
        return cls(
            specification=table.specification,
            firmware=table.firmware,
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
            polled=MappingProxyType({key: row.poll_s for key, row in parameters.items() if row.poll_s is not None}),
            fault_words=tuple(REGISTERS),
            fault_bits=MappingProxyType({bit.key: bit for bit in fault_table.fault}),
            stops_output=MappingProxyType(_stops_output(fault_table)),
            protections=MappingProxyType(_protections(parameters, fault_table)),
            unique=tuple(key for key, row in parameters.items() if row.unique is not None),
        )

    def model(self, model_number: int, hardware_version: int) -> ServoModel | None:
        """The model with these values of 0x50 and 0x53. None if unknown (sections 4.40 and 4.43)."""
        for model in self.models.values():
            if (model.model_number, model.hardware_version) == (model_number, hardware_version):
                return model
        return None

    def treated_as(self, model_number: int, hardware_version: int | None) -> ServoModel | None:
        """The model a servo of this identity is treated as: its own, or the newest known of its series.

        The thousands of the hardware number are the supply (4.43), so the newest model with that supply is preferred.
        None for an unknown series.
        """
        known = None if hardware_version is None else self.model(model_number, hardware_version)
        if known is not None or hardware_version is None:
            return known
        supply = hardware_version // 1000
        return max(
            (model for model in self.models.values() if model.model_number == model_number),
            key=lambda model: (
                model.hardware_version // 1000 == supply, from_text(model.firmware[-1]), model.hardware_version
            ),
            default=None,
        )  # fmt: skip

    def note_on(self, model: ServoModel | None, firmware: int | None) -> str | None:
        """Note on a firmware for users. None if it is unknown, or not one of this model's series."""
        if model is None or firmware is None or model.counts_as(firmware) is not None:
            return None
        return next((step.note for step in self.firmware if step.version == to_text(firmware)), None)

    def parameter(self, key: str) -> Parameter:
        """The readable row with this key. Raises Unknown with the closest key, also for actions and 0x49."""
        row = self.readable.get(key)
        if row is not None:
            return row
        near = difflib.get_close_matches(key, self.readable, n=1)
        hint = f" Did you mean {near[0]}?" if near else ""
        raise Unknown(
            "unknown_parameter", f'Unknown parameter "{key[:60]}".{hint}', key=key[:60], cause="parameter_unknown"
        )

    def widest(self, key: str) -> tuple[int | None, int | None]:
        """Lowest minimum and highest maximum (raw) among the models with this row."""
        rows = [row for model in self.models.values() if (row := model.rows().get(key)) is not None]
        low = [row.minimum for row in rows if row.minimum is not None]
        high = [row.maximum for row in rows if row.maximum is not None]
        return min(low, default=None), max(high, default=None)

    def faults_of(self, pwm: bool) -> tuple[FaultBit, ...]:
        """Detail bits of models with or without PWM input (4.12, note 1)."""
        return tuple(bit for bit in self.faults if pwm or not bit.pwm_only)


def _stops_output(table: FaultsTable) -> dict[str, int]:
    found: dict[str, int] = {}
    for bit in table.fault:
        if bit.output_off:
            found[bit.parameter] = found.get(bit.parameter, 0) | (0 if bit.limit else bit.mask)
    return found


def _protections(parameters: Mapping[str, Parameter], table: FaultsTable) -> dict[int, tuple[str, str]]:
    reading = {
        key: row.key
        for row in parameters.values()
        if row.limits is not None and row.limits.tolerance is not None
        for key in (row.limits.lower, row.limits.upper)
    }
    bits = [bit for bit in table.fault if bit.output_off and bit.level == "warning"]
    return {bit.bit: (reading[bit.limit], bit.limit) for bit in bits if bit.limit in reading}


def _revision(folder: Path) -> str:
    """Twelve hex digits of a hash over names and contents of all table files."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.toml")):
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:12]
