"""Frequency responses measured over the bus, compared with an independent integration of the same plant.

The reference shares no code with the measurement: another integration, ideal commands, samples every millisecond
without quantisation or bus, and the textbook estimate (cross spectrum over power spectrum, averaged over a band).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from behaviour.rig import Rig, json, play
from hornbill.domain.frequency_response import FrequencyCurve
from hornbill.domain.plant import PlantConstants
from hornbill.lab.excitation import SLOT_S, ExcitationPlan, offsets
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.mechanics.motion import Controller
from hornbill.sim.mechanics.plant import plant_of
from unit.sim.reference import CONTROL_S, Reference, orders_of

MODELS = (
    "BLA15-06U-A0", "BLA15-12U-A0", "BLA21-06U-A0", "BLA21-12U-A0", "BLA21-28U-A0", "BLA21-28U-AB", "BLA34-12U-AB",
    "BLA34-28U-AB",
)  # fmt: skip
INERTIAS = (0.0, 3.0, 10.0)
PLAN = ExcitationPlan("chirp", 2.0, 0.5, 15.0, 20.0)


@dataclass(frozen=True)
class Case:
    """One servo with a load, with or without 0x25."""

    model: str
    inertia: float
    cascade: bool

    @property
    def recipe(self) -> Recipe:
        """Without smoothing, boost, integral and speed deadband, which the reference does not have."""
        rom = {
            "smoothing": 0, "speed_torque_control": int(self.cascade), "speed_i_gain": 0, "speed_dead_band": 0,
            "angle_boost": 0,
        }  # fmt: skip
        plant = PlantConstants(inertia=self.inertia)
        return Recipe(
            self.model,
            "1.500" if self.model.startswith("BLA34") else "1.300",
            servo_id=1,
            node_id=11,
            rom=rom,
            plant=plant,
        )


@dataclass(frozen=True)
class Deviation:
    """Deviations of a measured curve from the truth at its `reliable` frequencies, of so many."""

    gain_db: np.ndarray
    phase_deg: np.ndarray
    frequencies: int

    @property
    def reliable(self) -> int:
        """Number of reliable frequencies."""
        return len(self.gain_db)

    @property
    def outside(self) -> int:
        """Number of reliable frequencies beyond ±0.5 dB or ±5°."""
        return int(((self.gain_db > 0.5) | (self.phase_deg > 5.0)).sum())


def measure(recipe: Recipe, **body: object) -> dict[str, Any]:
    """Measure over the embedded bus. Returns the frequency response as the API shows it."""
    found: dict[str, Any] = {}

    async def scene(rig: Rig) -> None:
        servo = (await rig.ready())[0]
        lease = await rig.lease(ttl_s=60.0)
        path = f"/servos/{servo.uid}"
        json(await rig.call("POST", f"{path}/torque", {"mode": "on"}, lease=lease))
        job = json(await rig.call("POST", f"{path}/frequency-response?wait=true", body, lease=lease))
        assert job["state"] == "succeeded", job["error"]
        found.update(json(await rig.call("GET", f"/frequency-responses/{job['result']['run']}")))

    play(scene, recipe)
    return found


def truth(case: Case, plan: ExcitationPlan, hz: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Gain (dB) and phase (°) of the reference under the same excitation, at these frequencies."""
    model = Catalog.load().models[case.model]
    plant, rows = plant_of(model), model.parameters
    gain = plant.angle_p if case.cascade else plant.angle_p_direct
    orders = orders_of(
        plant,
        Controller.ANGLE_CASCADE if case.cascade else Controller.ANGLE_DIRECT,
        0.0,
        angle_p=(rows["angle_p_gain"].default or 0) * gain,
        angle_d=(rows["angle_d_gain"].default or 0) * plant.angle_d,
        speed_p=(rows["speed_p_gain"].default or 0) * plant.speed_p,
        dead_band=(rows["angle_dead_band"].default or 0) / 10,
        speed_low=(rows["speed_limit_ccw"].default or 0) * 6.0,
        speed_high=(rows["speed_limit_cw"].default or 0) * 6.0,
    )
    reference = Reference(plant, orders, PlantConstants(inertia=case.inertia))
    command = np.repeat(offsets(plan), round(SLOT_S / CONTROL_S))
    angle = np.empty(len(command))
    for number, target in enumerate(command.tolist()):
        reference.orders = orders._replace(target=target)
        reference.step()
        angle[number] = reference.horn
    return textbook(command, angle, hz)


def textbook(command: np.ndarray, angle: np.ndarray, hz: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Cross spectrum over power spectrum, each averaged over ±3 % (at least three lines) about a frequency."""
    lines = np.fft.rfftfreq(len(command), CONTROL_S)
    drift = np.linspace(float(angle[0]), float(angle[-1]), len(angle))
    x, y = np.fft.rfft(command), np.fft.rfft(angle - drift)
    # a command is held during its millisecond, and the angle is that at the end of it
    x, y = x * np.exp(-1j * np.pi * lines * CONTROL_S), y * np.exp(-2j * np.pi * lines * CONTROL_S)
    found: list[complex] = []
    for one in hz:
        band = np.abs(lines - one) <= max(0.03 * one, 1.6 * lines[1])
        found.append(complex((np.conj(x[band]) * y[band]).sum() / (np.abs(x[band]) ** 2).sum()))
    response = np.array(found)
    return 20 * np.log10(np.abs(response)), np.degrees(np.angle(response))


def deviation(case: Case, plan: ExcitationPlan = PLAN) -> Deviation:
    """Measure a case over the bus, and compare it with the truth up to 15 Hz where it is reliable."""
    run = measure(
        case.recipe, excitation=plan.kind, amplitude_deg=plan.amplitude_deg, from_hz=plan.from_hz, to_hz=plan.to_hz,
        duration_s=plan.duration_s,
    )  # fmt: skip
    curve = FrequencyCurve.model_validate(run["curves"][0])
    good = np.array(curve.reliable)
    gain, phase = truth(case, plan, curve.frequency_hz)
    away = (np.array(curve.phase_deg) - phase + 180.0) % 360.0 - 180.0
    return Deviation(np.abs(np.array(curve.gain_db) - gain)[good], np.abs(away)[good], len(good))
