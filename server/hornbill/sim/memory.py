"""RAM and ROM of a servo, and the values each register accepts (3.1, 4.11)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from hornbill.schema.model import ServoModel
from hornbill.schema.parameter import Parameter
from hornbill.sim import address
from hornbill.sim.behaviour import Absent, Behaviour
from hornbill.units import Raw

_IDENTITY: Final = (address.ORIGIN, address.SERVO_ID, address.NODE_ID)
_SOFT_START: Final[Mapping[int, Raw]] = MappingProxyType(
    {
        address.SPEED_TORQUE_CONTROL: 1,
        address.SPEED_LIMIT_CW: 30,
        address.SPEED_LIMIT_CCW: -30,
        address.TORQUE_LIMIT_CW: 30,
        address.TORQUE_LIMIT_CCW: -30,
    }
)


class Memory:
    """Registers of one servo by address. All values are raw.

    `rows` are those of its model and firmware, including 0x10 to 0x12 and 0x49. Current values and fault words are not
    stored here: they are measured on request.
    """

    def __init__(
        self,
        model: ServoModel,
        firmware: int,
        *,
        serial: int,
        production: tuple[int, int, int, int, int],
        rom: Mapping[str, Raw] | None = None,
    ) -> None:
        """`firmware` is the integer of 0x52, `rom` the values in ROM that differ from the defaults, by key.

        Raises ValueError for a key not stored in ROM and for a value out of range.
        """
        rows = {row.address: row for row in model.rows(firmware).values()}
        rows |= {row.address: row for row in model.parameters.values() if row.action or row.forbidden}
        self.rows: Mapping[int, Parameter] = MappingProxyType(rows)
        self.rom_sound = True
        """Whether ROM can be read. Not during a write, nor after a power failure during a write (4.11)."""
        self._defaults = {at: row.default or 0 for at, row in rows.items() if not row.action}
        self._fixed = {
            address.MODEL_NUMBER: model.model_number,
            address.PRODUCT_NUMBER: serial,
            address.FIRMWARE_VERSION: firmware,
            address.HARDWARE_VERSION: model.hardware_version,
            **dict(zip(address.PRODUCTION_DATE, production, strict=True)),
        }
        self._known = frozenset(row.address for row in model.parameters.values())
        absent = [row for row in model.parameters.values() if row.readable and row.address not in rows]
        self._absent_pwm_rows = frozenset(row.address for row in absent if row.pwm_only and not model.pwm)
        self._later_rows = frozenset(row.address for row in absent) - self._absent_pwm_rows
        self._rom = {at: self._defaults[at] for at, row in rows.items() if row.rom}
        for key, raw in (rom or {}).items():
            row = model.parameters.get(key)
            if row is None or row.address not in self._rom or not _fits(row, raw):
                raise ValueError(f"{key} = {raw} is not valid in ROM of a {model.name} with firmware {firmware}.")
            self._rom[row.address] = raw
        self._temporary: Mapping[int, Raw] = {}
        self._ram: dict[int, Raw] = {}
        self.load()

    def load(self) -> bool:
        """Initialize RAM as at power-on: ROM over defaults. False if ROM cannot be read and defaults are used."""
        self._temporary = {}
        self._ram = self._defaults | self._fixed
        if self.rom_sound:
            self._ram |= self._rom
        return self.rom_sound

    def save(self, behaviour: Behaviour) -> None:
        """Copy the configuration from RAM to ROM (4.11)."""
        self._rom = {at: self.shown(at, behaviour) for at in self._rom}

    def reset(self, behaviour: Behaviour, *, rom: bool = False) -> None:
        """Reset the configuration in RAM, and with `rom` in ROM, to the defaults of the model (4.9)."""
        preserved = _IDENTITY if behaviour.erase_keeps_identity else ()
        factory = {at: self._defaults[at] for at in self._rom if at not in preserved}
        self._ram |= factory
        if rom:
            self._rom |= factory

    def override_identity(self, reads: Mapping[str, Raw]) -> None:
        """Override identity registers (0x50 to 0x53, by key), as on an unknown servo."""
        addresses = {row.key: at for at, row in self.rows.items() if at in self._fixed}
        self._fixed |= {addresses[key]: raw for key, raw in reads.items()}
        self._ram |= self._fixed

    def get(self, at: int, absent: Raw = 0) -> Raw:
        """The effective value, during soft start its temporary one. `absent` if this firmware lacks the row."""
        if at in self._temporary:
            return self._temporary[at]
        return self._ram.get(at, absent)

    def own(self, at: int, absent: Raw = 0) -> Raw:
        """The value as written or loaded, regardless of soft start."""
        return self._ram.get(at, absent)

    def put(self, at: int, raw: Raw) -> None:
        """Set a register in RAM. Values of soft start keep priority."""
        self._ram[at] = raw

    def apply_soft_start(self, on: bool) -> None:
        """Apply or remove the temporary values of soft start (4.14)."""
        self._temporary = _SOFT_START if on else {}

    def shown(self, at: int, behaviour: Behaviour) -> Raw:
        """The value returned by a read."""
        return self.get(at) if behaviour.soft_start_shows == "temporary" else self._ram[at]

    def stored(self, at: int) -> Raw | None:
        """Value in ROM. None for a register not stored there. For tests: it cannot be read from a real servo."""
        return self._rom.get(at)

    def absent(self, at: int, behaviour: Behaviour) -> Absent:
        """Response of a register without a value, by a switch of `behaviour`. Writes have no effect."""
        row = self.rows.get(at)
        if row is not None:
            return behaviour.write_only if row.action else "empty"
        if at in self._absent_pwm_rows:
            return behaviour.pwm_rows
        if at in self._later_rows:
            return behaviour.later_rows
        return behaviour.reserved if at <= address.LAST and at not in self._known else "empty"

    def admit(self, at: int, raw: Raw, behaviour: Behaviour) -> Raw | None:
        """The resulting value of a write of `raw`. None if refused: unknown row, read-only, or out of range."""
        row = self.rows.get(at)
        if row is None or row.access == "r":
            return None
        if row.forbidden or _fits(row, raw):
            return raw
        if behaviour.out_of_range == "refuse" or row.minimum is None or row.maximum is None:
            return None
        return min(max(raw, row.minimum), row.maximum)


def _fits(row: Parameter, raw: Raw) -> bool:
    return row.minimum is None or row.maximum is None or row.minimum <= raw <= row.maximum
