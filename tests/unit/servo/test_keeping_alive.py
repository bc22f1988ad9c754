"""Whether a servo that missed a command has restarted: what whole seconds of uptime prove, however late they come."""

import asyncio
from types import SimpleNamespace
from typing import Any, cast

from hypothesis import given
from hypothesis import strategies as st

from hornbill.servo.motion.keeping_alive import KeepingAlive
from hornbill.servo.runtime.hub import Hub
from hornbill.servo.runtime.timebase import TimeBase

AGE_S = st.floats(0, 3, allow_nan=False)


def runs_on(*, uptime_s: float, age_s: float, way_s: float, restarted_after_s: float | None = None) -> bool:
    """What is made of a servo whose last status, at `uptime_s`, is `age_s` old when it is asked, and whose answer
    takes `way_s` to reach us; it may have restarted so long after that status.
    """
    now = 1000.0
    status = SimpleNamespace(uptime_sec=int(uptime_s))
    servo = SimpleNamespace(status=status, status_at=now - age_s, node_id=10, boot_count=1)

    async def node_info(node: int) -> object:
        nonlocal now
        true = uptime_s + age_s if restarted_after_s is None else age_s - restarted_after_s
        now += way_s
        return SimpleNamespace(status=SimpleNamespace(uptime_sec=int(true)))

    never = cast(Any, None)
    base = TimeBase(lambda: now)
    keeping = KeepingAlive(cast(Any, SimpleNamespace(node_info=node_info)), Hub(), base, never, never, never)
    return asyncio.run(keeping._has_not_restarted(cast(Any, servo), 1))  # pyright: ignore[reportPrivateUsage]


@given(uptime_s=st.floats(3, 1e6), age_s=AGE_S, way_s=st.floats(0, 1.9))
def test_a_servo_that_ran_on_is_known_to_however_late_we_hear_its_answer(
    uptime_s: float, age_s: float, way_s: float
) -> None:
    assert runs_on(uptime_s=uptime_s, age_s=age_s, way_s=way_s)


@given(uptime_s=st.floats(0, 1e6), age_s=AGE_S, way_s=AGE_S, share=st.floats(0, 1))
def test_one_that_restarted_since_is_never_taken_for_one_that_ran_on(
    uptime_s: float, age_s: float, way_s: float, share: float
) -> None:
    assert not runs_on(uptime_s=uptime_s, age_s=age_s, way_s=way_s, restarted_after_s=age_s * share)
