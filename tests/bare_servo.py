"""A simulated servo without a bus: registers and angles as a host reads them, in virtual time."""

from collections.abc import Mapping
from random import Random

from hornbill.domain.plant import PlantConstants
from hornbill.lab.improvement import Measured, Watch, measured
from hornbill.lab.model import SHAPING, Loop
from hornbill.schema.catalog import Catalog
from hornbill.schema.firmware import from_text
from hornbill.schema.model import ServoModel
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.device import ServoBuild, SimDevice
from hornbill.units import Raw

CATALOG = Catalog.load()
READ_S = 0.002
"""Mean time of one reading of 0x08 over the bus."""


class BareServo:
    """A servo that runs, with its output on. Times are those of its own clock."""

    def __init__(
        self, model: ServoModel, rows: Mapping[str, Raw], plant: PlantConstants, *, supply: float = 1.0,
        angle_deg: float = 0.0, seed: int = 1,
    ) -> None:  # fmt: skip
        """`supply`: voltage relative to nominal."""
        self.model = model
        self.random = Random(seed)
        rom = {"soft_start": 0, "timeout_action": 0, **rows}
        firmware, faults = from_text(model.steps[-1]), CATALOG.faults_of(model.pwm)
        build = ServoBuild(
            model, firmware, bytes(16), faults, 1, (2024, 1, 1, 0, 0), rom, seed, angle_deg, Behaviour()
        )  # fmt: skip
        self.device = SimDevice(build, Random(seed), lambda _now: None, lambda: None)
        self.device.conditions.plant = plant
        self.device.conditions.voltage_v = model.nominal_v * supply
        self.now = 0.0
        self.device.power_on(0.0)
        self.wait(0.5)

    def wait(self, seconds: float) -> None:
        """Let it run."""
        until = self.now + seconds
        while self.device.due <= until:
            self.now = max(self.now, self.device.due)
            self.device.run_due(self.now)
        self.now = until
        self.device.motion.advance(until)

    def write(self, key: str, raw: Raw) -> None:
        """Write a register."""
        self.device.registers.write(CATALOG.by_key[key].address, raw, self.now)

    def read(self, key: str) -> Raw:
        """Read a register."""
        self.wait(0.0)
        raw = self.device.registers.read(CATALOG.by_key[key].address)
        assert raw is not None
        return raw

    @property
    def angle_deg(self) -> float:
        """The angle as read."""
        return self.read("current_angle") / 10.0


class BareSubject:
    """The servo as a subject of `improvement`. `runs`: gains during each step."""

    def __init__(self, servo: BareServo, band_deg: float) -> None:
        self.servo = servo
        self.band_deg = band_deg
        self.steps = 0

    async def write(self, gains: Mapping[str, Raw]) -> None:
        """Write gains."""
        for key, raw in gains.items():
            self.servo.write(key, raw)

    async def home(self) -> None:
        """Return to the start."""
        self.servo.write("command_angle", 0)
        self.servo.wait(1.0)

    async def step(self, to_deg: float, dwell_s: float) -> Measured:
        """Command an angle and read about 500 angles a second."""
        servo, begin = self.servo, self.servo.angle_deg
        self.steps += 1
        watch = Watch(begin, to_deg, self.band_deg)
        servo.write("command_angle", round(to_deg * 10))
        started = servo.now + 0.0006  # the response takes that long
        t, angles, ended = [0.0], [begin], None
        while t[-1] < dwell_s and ended is None:
            asked = servo.now
            servo.wait(READ_S * servo.random.uniform(0.35, 0.65))
            angle = servo.angle_deg
            servo.wait(READ_S * servo.random.uniform(0.35, 0.65))
            at = (asked + servo.now) / 2 - started
            if at <= t[-1]:
                continue
            t.append(at)
            angles.append(angle)
            ended = watch.add(angle)
        return measured("there", to_deg, t, angles, ended, self.band_deg)


def loop_of(servo: BareServo) -> Loop:
    """The loop of a servo, as far as its registers tell."""
    rows = {key: servo.read(key) for key in SHAPING if CATALOG.by_key[key].address in servo.device.memory.rows}
    return Loop.of(servo.model, rows, servo.read("current_voltage") / 10.0)
