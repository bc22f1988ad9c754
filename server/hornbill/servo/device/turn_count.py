"""Detects servos that restarted beyond ±180° and so lost their turn count (4.1)."""

from collections.abc import Callable
from dataclasses import dataclass

from hornbill.servo.device.position_estimate import HALF_TURN_DEG
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import Hub, LogEvent, Sampled, ServoChanged
from hornbill.units import Instant, Uid

UNCERTAIN_S = 2.0
"""NodeStatus gives the start to within a second (uptime, table 2-17), and angles arrive every 0.1 s to 1 s."""


@dataclass(slots=True)
class _Beyond:
    """The last angle beyond ±180°, in degrees, and when angles came back within."""

    angle_deg: float
    boot_count: int
    within_since: Instant | None = None


class TurnCount:
    """Follows angles and restarts, and sets a servo's `turns_lost_deg`.

    By the time a restart is noticed, the servo has already reported its new angle, so the angle shortly before the
    restart counts.
    """

    def __init__(self, hub: Hub, find: Callable[[Uid], Servo | None]) -> None:
        self._hub = hub
        self._find = find
        self._beyond: dict[Uid, _Beyond] = {}
        hub.subscribe(self._on_sample, Sampled)
        hub.subscribe(self._on_servo, ServoChanged)

    def _on_sample(self, sample: Sampled) -> None:
        if sample.key != "current_angle" or sample.value is None:
            return
        known = self._beyond.get(sample.uid)
        if abs(sample.value) > HALF_TURN_DEG:
            servo = self._find(sample.uid)
            if servo is not None and (known is None or known.boot_count == servo.boot_count):
                self._beyond[sample.uid] = _Beyond(sample.value, servo.boot_count)
        elif known is not None and known.within_since is None:
            known.within_since = sample.t

    def _on_servo(self, change: ServoChanged) -> None:
        known = self._beyond.get(change.uid)
        servo = self._find(change.uid) if known is not None else None
        if known is None or servo is None or servo.boot_count == known.boot_count:
            return
        if not servo.identified or servo.status is None or servo.status_at is None:
            return  # its uptime may still be from before the restart
        del self._beyond[change.uid]
        started = servo.status_at - servo.status.uptime_sec
        if known.within_since is None or known.within_since >= started - UNCERTAIN_S:
            servo.turns_lost_deg = known.angle_deg
            params: dict[str, object] = {"servo": servo.title, "angle_deg": round(known.angle_deg, 1)}
            text = f"{servo.title} restarted at {known.angle_deg:.1f}° and lost its turn count (4.1)."
            self._hub.publish(LogEvent("warning", "turns_lost", text, servo.uid, params))
