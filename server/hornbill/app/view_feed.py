"""Snapshots of the servos for the 3D view, readable from its thread."""

import asyncio

from hornbill.schema.scale import to_value
from hornbill.servo.device.reading import ANGLE_STALE_S
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Host
from hornbill.view.pose import Pose
from hornbill.view.viewer import Viewer

POSE_S = 0.04


class ViewFeed:
    """Snapshots for the 3D view, created on the event loop and read by the view's thread."""

    def __init__(self) -> None:
        self._snapshot: tuple[Pose, ...] = ()
        self._host: Host | None = None
        self._viewer: Viewer | None = None

    def follow(self, host: Host, viewer: Viewer) -> None:
        """Set the source of servos and the viewer."""
        self._host, self._viewer = host, viewer

    def poses(self) -> tuple[Pose, ...]:
        """Latest snapshot. Thread-safe."""
        return self._snapshot

    async def run(self) -> None:
        """Create snapshots: 25 per second while the view is open, otherwise 2."""
        while True:
            host, viewer = self._host, self._viewer
            if host is not None:
                now = host.base.now()
                self._snapshot = tuple(_pose(servo, now) for servo in host.fleet.all())
            await asyncio.sleep(POSE_S if viewer is not None and viewer.watched else 0.5)


def _pose(servo: Servo, now: float) -> Pose:
    def degrees(key: str) -> float | None:
        register = servo.registers.get(key)
        if register is None or register.raw is None:
            return None
        value = to_value(register.parameter, register.raw)
        return float(value) if isinstance(value, int | float) else None

    return Pose(
        uid=servo.uid,
        name=servo.title,
        series=servo.model.series if servo.model else "",
        angle_deg=servo.angle_deg,
        command_deg=degrees("command_angle"),
        limit_cw_deg=degrees("angle_limit_cw"),
        limit_ccw_deg=degrees("angle_limit_ccw"),
        stale=not servo.online or servo.angle_at is None or now - servo.angle_at > ANGLE_STALE_S,
    )
