"""Long runs of host and simulated servos: a thousand connections, and minutes of motion without an alarm."""

import gc

from behaviour.rig import CATALOG, Rig
from behaviour.scene import scene
from behaviour.test_activity import alarmless
from behaviour.test_bus_lost import connections
from hornbill.sim.bench.demo import demo_fleet

HEALTHY = [one for one in demo_fleet(CATALOG, 10, 1) if "hunts" not in one.story]


@scene(connect=False)
async def test_a_thousand_connections_leave_no_objects(rig: Rig) -> None:
    """Nor threads, files or tasks. A tenth of an object per connection is tolerated."""
    before = await connections(rig, 300)  # fills the list of recent events
    objects = len(gc.get_objects())
    assert await connections(rig, 1000) == before
    assert len(gc.get_objects()) - objects < 100
    assert rig.cable.openings == 1300


@scene(*HEALTHY)
async def test_ten_healthy_servos_raise_no_alarm_for_minutes(rig: Rig) -> None:
    await alarmless(rig, len(HEALTHY), moves=12, jogs=150, rest_s=60)
