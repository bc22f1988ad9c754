"""Checks every simulated servo at each frame: IDs that two share, and how far horns turn."""

from collections.abc import Sequence

from behaviour.rig import Rig
from hornbill.sim.device import ServoStage
from hornbill.wire.frame import Frame


class Watch:
    """IDs that two running servos shared so far, and the furthest any horn turned from where it started."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.clashes: set[tuple[str, int]] = set()
        self.furthest_deg = 0.0
        self._rest = {uid: sim.angle_deg for uid, sim in rig.bench.servos.items()}
        rig.bus.port("watch").listen(self.check)

    def check(self, _frames: Sequence[Frame]) -> None:
        """Check all servos now."""
        running = [sim for sim in self.rig.bench.servos.values() if sim.stage is ServoStage.RUNNING and sim.powered]
        self._unique("servo_id", [sim.servo_id for sim in running])
        self._unique("node_id", [int(sim.node_id) for sim in running])
        for uid, sim in self.rig.bench.servos.items():
            if uid not in self._rest or sim.soft_starting or sim.stage is not ServoStage.RUNNING:
                self._rest[uid] = sim.angle_deg
            self.furthest_deg = max(self.furthest_deg, abs(sim.angle_deg - self._rest[uid]))

    def _unique(self, kind: str, numbers: list[int]) -> None:
        given = [number for number in numbers if number]
        self.clashes |= {(kind, number) for number in given if given.count(number) > 1}
