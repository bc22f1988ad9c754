"""The full grids of which `make test` plays a part: resets, Stop during a save, and the angles of a full bus."""

import pytest

from behaviour.rig import Rig
from behaviour.scene import scene, settled
from behaviour.test_resetting import VARIANTS, Variant, check_reset, variant
from behaviour.test_staleness import check_angles, crowd
from behaviour.test_torque_in_rom import HOLDS, check_stop
from hornbill.servo.device.servo import Servo


@pytest.mark.parametrize("given", [*map(variant, range(2 ** len(VARIANTS)))], ids=lambda given: "-".join(sorted(given)))
def test_a_reset_succeeds_however_erase_behaves(monkeypatch: pytest.MonkeyPatch, given: Variant) -> None:
    check_reset(monkeypatch, given)


@pytest.mark.parametrize("after_ms", range(0, 120, 4))
@settled(HOLDS)
async def test_stop_during_a_save_leaves_rom_with_torque_on(rig: Rig, servo: Servo, after_ms: int) -> None:
    await check_stop(rig, servo, after_ms)


@pytest.mark.parametrize("count", [60, 125])
@scene(lambda count: crowd(count))
async def test_the_angle_of_a_healthy_servo_is_never_stale(rig: Rig, count: int) -> None:
    await check_angles(rig, count)
