"""A simulated servo without a bus as a horn of `lab.mechanics_moves`, in virtual time. Readings take as on a bus."""

from random import Random

from hornbill.domain.plant import PlantConstants
from hornbill.lab.mechanics_moves import Kind, Sample
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo

CATALOG = Catalog.load()
READ_S = 0.002
FREE = {"soft_start": 0, "timeout_action": 0, "speed_torque_control": 1, "smoothing": 0, "torque_mode": 0}


class BareHorn:
    """A servo that runs, with its output on. `lost`: share of lost readings."""

    def __init__(
        self, plant: PlantConstants, *, model: str = "BLA21-12U-A0", seed: int = 1, lost: float = 0.0, **rom: int
    ) -> None:
        self.random = Random(seed)
        self.lost = lost
        self.sim: SimulatedServo = Recipe(model, "1.300", 1, 11, rom=FREE | rom, plant=plant).build(CATALOG, seed)
        self._now = 0.0
        self.peak_torque = 0.0
        self.sim.power_on(0.0)
        self.wait(0.5)

    def wait(self, seconds: float) -> None:
        """Let it run."""
        self._now += seconds
        self.sim.advance(self._now)
        self.sim.motion.advance(self._now)
        self.peak_torque = max(self.peak_torque, abs(self.sim.motion.torque))

    def now(self) -> float:
        return self._now

    async def read(self, key: str) -> Sample | None:
        row, asked = CATALOG.by_key[key], self._now
        self.wait(READ_S * self.random.uniform(0.35, 0.65))
        raw = self.sim.register(row.address)
        self.wait(READ_S * self.random.uniform(0.35, 0.65))
        assert raw is not None
        if self.random.random() < self.lost:
            self.wait(0.02)
            return None
        return Sample((asked + self._now) / 2, raw / row.per_unit)

    async def command(self, kind: Kind, value: float) -> float:
        row = CATALOG.by_key[f"command_{kind}"]
        self.wait(READ_S * self.random.uniform(0.25, 0.5))
        at = self._now
        self.write(row.key, round(value * row.per_unit))
        self.wait(READ_S * self.random.uniform(0.25, 0.5))
        return at + 0.0003

    async def pause(self, seconds: float) -> None:
        self.wait(seconds)

    def write(self, key: str, raw: int) -> None:
        """Write a register."""
        registers = self.sim._device.registers  # pyright: ignore[reportPrivateUsage] - it has no bus
        assert registers.write(CATALOG.by_key[key].address, raw, self._now) == raw
