"""Owns what a pulse at the PWM input asks for, and the bits of pulses that are missing or too wide (4.29, 4.30)."""

from typing import NamedTuple

from hornbill.sim import address
from hornbill.sim.memory import Memory
from hornbill.units import Raw


class PulseCommand(NamedTuple):
    """A command register, the value a pulse puts into it, and the notification bits it sets."""

    kind: int
    raw: Raw
    bits: tuple[str, ...]


def read_pulse(memory: Memory, width_us: float | None) -> PulseCommand | None:
    """What the present pulse means; None on a servo without the PWM rows, which raises no bits either.

    Without a pulse `raw` is 0 and `bits` says so. At the ends of the range and beyond, the command is that of
    the end: the document says which bit is set then, not what the horn does.
    """
    if address.PWM_RANGE not in memory.rows:
        return None
    kind = address.COMMAND_SPEED if memory.get(address.PWM_MODE) else address.COMMAND_ANGLE
    if width_us is None:
        return PulseCommand(kind, 0, ("pwm_missing",))
    share = (width_us - memory.get(address.PWM_NEUTRAL)) / memory.get(address.PWM_RANGE)
    bits = ("pwm_high",) if share >= 1.0 else ("pwm_low",) if share <= -1.0 else ()
    raw = round(min(max(share, -1.0), 1.0) * memory.get(address.PWM_OUTPUT_RANGE))
    if kind == address.COMMAND_SPEED:
        row = memory.rows[kind]
        raw = min(max(raw, row.minimum or 0), row.maximum or 0)
    return PulseCommand(kind, raw, bits)
