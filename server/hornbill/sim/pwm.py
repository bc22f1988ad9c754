"""Command of a pulse at the PWM input, and the bits for missing or out-of-range pulses (4.29, 4.30)."""

from typing import NamedTuple

from hornbill.sim import address
from hornbill.sim.memory import Memory
from hornbill.units import Raw


class PulseCommand(NamedTuple):
    """A command register, the value commanded by a pulse, and its notification bits.

    `raw` is None without a signal: no pulse, or one out of range, which counts as none (4.30).
    """

    kind: int
    raw: Raw | None
    bits: tuple[str, ...]


def read_pulse(memory: Memory, width_us: float | None) -> PulseCommand | None:
    """Decode the present pulse. None on a servo without PWM rows, which sets no bits either."""
    if address.PWM_RANGE not in memory.rows:
        return None
    kind = address.COMMAND_SPEED if memory.get(address.PWM_MODE) else address.COMMAND_ANGLE
    if width_us is None:
        return PulseCommand(kind, None, ("pwm_missing",))
    share = (width_us - memory.get(address.PWM_NEUTRAL)) / memory.get(address.PWM_RANGE)
    bits = ("pwm_high",) if share >= 1.0 else ("pwm_low",) if share <= -1.0 else ()
    if not -1.0 <= share <= 1.0:
        return PulseCommand(kind, None, bits)
    raw = round(share * memory.get(address.PWM_OUTPUT_RANGE))
    if kind == address.COMMAND_SPEED:
        row = memory.rows[kind]
        raw = min(max(raw, row.minimum or 0), row.maximum or 0)
    return PulseCommand(kind, raw, bits)
