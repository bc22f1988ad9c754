"""Owns Recipe: what is particular about one simulated servo, before there is one."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from random import Random
from typing import Final

from hornbill.errors import InvalidValue
from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import from_text
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.conditions import ROOM_C
from hornbill.sim.servo import SimServo
from hornbill.units import Raw

_UID_BYTES = 16
_MADE: Final[Mapping[str, tuple[int, int]]] = {
    "1.010": (2021 * 12 + 4, 2023 * 12 + 11),
    "1.100": (2021 * 12 + 9, 2022 * 12 + 3),
    "1.200": (2022 * 12 + 8, 2023 * 12 + 11),
    "1.300": (2024 * 12, 2025 * 12 + 11),
}
"""First and last month, counted from January of year 0, in which section 5 has every model of a step built with it."""


def _no_rom() -> dict[str, Raw]:
    return {}


@dataclass(frozen=True, slots=True)
class Recipe:
    """A servo as it was delivered and saved: `model` as in the tables, `firmware` as "1.300".

    `servo_id` and `node_id` 0 are a new servo's: not to be addressed, and asking for a node id. `rom` is what
    else was saved, by key, raw. `angle_deg` is where the horn stands, `serial` 0 takes one from the seed. `story`
    says to people why it is there; `room_c`, `load_pct` and `load_inertia` are its surroundings; unless
    `rom_sound`, power failed once while ROM was written.
    """

    model: str = "BLA21-06U-A0"
    firmware: str = "1.300"
    servo_id: int = 0
    node_id: int = 0
    rom: Mapping[str, Raw] = field(default_factory=_no_rom)
    angle_deg: float = 0.0
    uid: bytes | None = None
    serial: int = 0
    behaviour: Behaviour | None = None
    story: str = ""
    room_c: float = ROOM_C
    load_pct: float = 0.0
    load_inertia: float = 0.0
    rom_sound: bool = True

    def build(self, catalog: Catalog, seed: int | str) -> SimServo:
        """The servo, switched off. Everything not said is drawn from `seed`.

        Raises InvalidValue for a model or firmware that does not exist, ValueError for values ROM cannot hold.
        """
        model = catalog.models.get(self.model)
        if model is None:
            raise InvalidValue(f'There is no model "{self.model}". Give one of {", ".join(catalog.models)}.')
        if self.firmware not in catalog.firmware_steps:
            steps = ", ".join(catalog.firmware_steps)
            raise InvalidValue(f'There is no firmware "{self.firmware}". Give one of {steps}.')
        random = Random(f"{seed}")
        uid = random.randbytes(_UID_BYTES)
        serial = random.randrange(1, 1_000_000)
        first, last = _MADE.get(self.firmware, _MADE["1.300"])
        month = random.randint(first, last)
        production = (
            month // 12, month % 12 + 1, random.randrange(1, 29),
            random.randrange(8, 18), random.randrange(60),
        )  # fmt: skip
        identity = {"servo_id": self.servo_id, "node_id": self.node_id}
        made = SimServo(
            model,
            from_text(self.firmware),
            uid if self.uid is None else self.uid,
            faults=catalog.faults_of(model.pwm),
            serial=self.serial or serial,
            production=production,
            rom=identity | dict(self.rom),
            seed=random.getrandbits(32),
            angle_deg=self.angle_deg,
            behaviour=self.behaviour,
        )
        made.conditions.temperature_c = self.room_c
        made.conditions.load_pct = self.load_pct
        made.conditions.load_inertia = self.load_inertia
        made.memory.rom_sound = self.rom_sound
        return made
