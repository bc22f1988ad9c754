"""Whether a servo that missed a command has restarted, from its uptime in whole seconds."""

import asyncio
from types import SimpleNamespace
from typing import Any, cast

from hypothesis import given
from hypothesis import strategies as st

from hornbill.servo.motion.keeping_alive import KeepingAlive
from hornbill.servo.runtime.hub import Hub
from hornbill.servo.runtime.timebase import TimeBase

AGE_S = st.floats(0, 3, allow_nan=False)


def has_not_restarted(*, uptime_s: float, age_s: float, delay_s: float, restarted_after_s: float | None = None) -> bool:
    """The verdict on a servo whose last status, at `uptime_s`, is `age_s` old at the request, and whose response takes
    `delay_s`; it may have restarted that long after the status.
    """
    now = 1000.0
    status = SimpleNamespace(uptime_sec=int(uptime_s))
    servo = SimpleNamespace(status=status, status_at=now - age_s, node_id=10, boot_count=1)

    async def node_info(node: int) -> object:
        nonlocal now
        true = uptime_s + age_s if restarted_after_s is None else age_s - restarted_after_s
        now += delay_s
        return SimpleNamespace(status=SimpleNamespace(uptime_sec=int(true)))

    never = cast(Any, None)
    base = TimeBase(lambda: now)
    keeping = KeepingAlive(cast(Any, SimpleNamespace(node_info=node_info)), Hub(), base, never, never, never)
    return asyncio.run(keeping._has_not_restarted(cast(Any, servo), 1))  # pyright: ignore[reportPrivateUsage]


@given(uptime_s=st.floats(3, 1e6), age_s=AGE_S, delay_s=st.floats(0, 1.9))
def test_a_servo_that_has_not_restarted_is_recognised(uptime_s: float, age_s: float, delay_s: float) -> None:
    assert has_not_restarted(uptime_s=uptime_s, age_s=age_s, delay_s=delay_s)


@given(uptime_s=st.floats(0, 1e6), age_s=AGE_S, delay_s=AGE_S, share=st.floats(0, 1))
def test_a_restarted_servo_is_always_recognised(uptime_s: float, age_s: float, delay_s: float, share: float) -> None:
    assert not has_not_restarted(uptime_s=uptime_s, age_s=age_s, delay_s=delay_s, restarted_after_s=age_s * share)
