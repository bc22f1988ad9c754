"""Description of one simulated servo."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from random import Random
from typing import Final

from hornbill.domain.plant import DEFAULT_PLANT, PlantConstants
from hornbill.errors import InvalidValue
from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import from_text
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.device import ServoBuild
from hornbill.sim.mechanics.conditions import ROOM_C
from hornbill.sim.servo import SimulatedServo
from hornbill.units import Raw

_UID_BYTES = 16
IDENTITY: Final = frozenset(("model_number", "firmware_version", "hardware_version"))
"""The registers that identify the model of a servo."""
_STILL_BUILT: Final = "2025-12"
"""Last production month for a current version, fixed so that equal seeds give equal servos."""


def _none() -> dict[str, Raw]:
    return {}


def _months(year_and_month: str) -> int:
    """Months since January of year 0."""
    year, month = year_and_month.split("-")
    return int(year) * 12 + int(month) - 1


@dataclass(frozen=True, slots=True)
class Recipe:
    """A servo as delivered and saved: `model` as in the tables, `firmware` as "1.300".

    `servo_id` and `node_id` 0 are those of a new servo, which cannot be addressed and requests a node ID. `rom` are
    other saved raw values by key. `angle_deg` is the angle of the horn; `serial` 0 derives one from the seed. `story`
    is its purpose, for users; `room_c` and `plant` are its environment. Without `rom_sound`, power
    failed during a ROM write. `any_firmware` allows a version the model was never built with; `reads` overrides
    identity registers by key, as on an unknown servo.
    """

    model: str = "BLA21-06U-A0"
    firmware: str = "1.300"
    servo_id: int = 0
    node_id: int = 0
    rom: Mapping[str, Raw] = field(default_factory=_none)
    angle_deg: float = 0.0
    uid: bytes | None = None
    serial: int = 0
    behaviour: Behaviour | None = None
    story: str = ""
    room_c: float = ROOM_C
    plant: PlantConstants = DEFAULT_PLANT
    rom_sound: bool = True
    any_firmware: bool = False
    reads: Mapping[str, Raw] = field(default_factory=_none)

    def build(self, catalog: Catalog, seed: int | str) -> SimulatedServo:
        """Build the servo, switched off. Everything not specified is drawn from `seed`.

        Raises InvalidValue for an unknown model or firmware, or a combination never built (section 5), unless
        `any_firmware`; ValueError for values invalid in ROM.
        """
        model = catalog.models.get(self.model)
        if model is None:
            raise InvalidValue(
                f'Unknown model "{self.model}". Use one of {", ".join(catalog.models)}.',
                cause="model_unknown",
                requested=self.model,
            )
        if self.firmware not in catalog.firmware_steps and not self.any_firmware:
            steps = ", ".join(catalog.firmware_steps)
            raise InvalidValue(
                f'Unknown firmware "{self.firmware}". Use one of {steps}.',
                cause="firmware_unknown",
                requested=self.firmware,
                known=list(catalog.firmware_steps),
            )
        if self.firmware not in model.firmware and not self.any_firmware:
            raise InvalidValue(
                f"{self.model} was never built with firmware {self.firmware}. Use one of {', '.join(model.firmware)}, "
                "or set any_firmware for a test.",
                cause="firmware_not_for_model",
                model=self.model,
                firmware=self.firmware,
                known=list(model.firmware),
            )
        if not self.reads.keys() <= IDENTITY:
            raise InvalidValue(
                f"Only {', '.join(sorted(IDENTITY))} can be overridden.",
                cause="reading_not_settable",
                known=sorted(IDENTITY),
            )
        random = Random(f"{seed}")
        uid = random.randbytes(_UID_BYTES)
        serial = random.randrange(1, 1_000_000)
        step = next((one for one in catalog.firmware if one.version == self.firmware), catalog.firmware[-1])
        month = random.randint(_months(step.first), _months(step.last or _STILL_BUILT))
        production = (
            month // 12, month % 12 + 1, random.randrange(1, 29),
            random.randrange(8, 18), random.randrange(60),
        )  # fmt: skip
        identity = {"servo_id": self.servo_id, "node_id": self.node_id}
        build = ServoBuild(
            model,
            from_text(self.firmware),
            uid if self.uid is None else self.uid,
            faults=catalog.faults_of(model.pwm),
            serial=self.serial or serial,
            production=production,
            rom=identity | dict(self.rom),
            seed=random.getrandbits(32),
            angle_deg=self.angle_deg,
            behaviour=self.behaviour or Behaviour(),
        )
        made = SimulatedServo(build)
        made.conditions.temperature_c = self.room_c
        made.conditions.plant = self.plant
        made.memory.rom_sound = self.rom_sound
        made.memory.override_identity(self.reads)
        return made
