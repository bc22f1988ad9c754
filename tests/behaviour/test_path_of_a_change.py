"""Measures the way of one change: which functions of ours lie between the route of PATCH, the bus and the response.

Counted is every function that calls, or awaits, what comes after it on the way of the write: from the route down to the
adapter's port, and from there back to the request that waits. Each counts once; what returns before the next step
begins (a check, a property, a codec) does not. The middleware before the route is every request's and counted apart.
The bus and the servo behind the port are not ours to count.
"""

import asyncio
import sys
from collections.abc import Coroutine
from pathlib import Path
from types import FrameType
from typing import Any

import hornbill
from behaviour.rig import Rig, json, play
from hornbill.wire.services import GetSetRequest, ValueKind

PACKAGE = str(Path(hornbill.__file__).parent)
BEYOND_THE_PORT = ("bus/embedded/memory.py", "sim/")

Step = tuple[str, str]
"""File in the package, and the function's qualified name."""


def steps(frame: FrameType | None) -> list[Step]:
    """What of ours is on the stack, the caller first."""
    found: list[Step] = []
    while frame is not None:
        if frame.f_code.co_filename.startswith(PACKAGE):
            file = frame.f_code.co_filename[len(PACKAGE) + 1 :]
            if not file.startswith(BEYOND_THE_PORT):
                found.append((file, frame.f_code.co_qualname))
        frame = frame.f_back
    return found[::-1]


class Way:
    """The steps of the first write that is asked for while this is watched."""

    def __init__(self) -> None:
        self.steps: list[Step] = []
        self._began: dict[asyncio.Task[Any], list[Step]] = {}
        self._awaited = ["Requests.ask", "MemoryPort.send", "Requests.answered"]

    def task(self, loop: asyncio.AbstractEventLoop, work: Coroutine[Any, Any, Any], **named: Any) -> asyncio.Task[Any]:
        """Task factory: who starts a task is on the way of what the task does."""
        began = steps(sys._getframe())  # pyright: ignore[reportPrivateUsage]
        made = asyncio.Task(work, loop=loop, **named)
        current = asyncio.current_task(loop)
        self._began[made] = [*(self._began.get(current, []) if current else []), *began]
        return made

    def look(self, frame: FrameType, event: str, _value: object) -> None:
        """Profile function: note the stack where the way passes from one part to the next."""
        if event != "call" or not self._awaited or frame.f_code.co_qualname != self._awaited[0]:
            return
        if self._awaited[0] == "Requests.ask":
            request = frame.f_locals["request"]
            if not isinstance(request, GetSetRequest) or request.value.kind is ValueKind.EMPTY:
                return
            task = asyncio.current_task()
            self.steps += self._began.get(task, []) if task else []
        self.steps += steps(frame)
        del self._awaited[0]


def measured(values: dict[str, object]) -> list[Step]:
    """The way of this change, in order, each function once."""

    async def scene(rig: Rig) -> list[Step]:
        (servo,) = await rig.ready()
        await asyncio.sleep(5)
        way, loop = Way(), asyncio.get_running_loop()
        loop.set_task_factory(way.task)  # pyright: ignore[reportArgumentType]
        sys.setprofile(way.look)
        try:
            answer = await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values})
        finally:
            sys.setprofile(None)
            loop.set_task_factory(None)
        assert json(answer)["outcome"] == "applied"
        return list(dict.fromkeys(way.steps))

    return play(scene)


MOST_FUNCTIONS = 14
MOST_FILES = 9


def test_a_change_passes_few_functions_on_its_way_to_the_bus_and_back() -> None:
    way = measured({"angle_p_gain": 50})
    route = next(at for at, (file, _) in enumerate(way) if file.startswith("api/routes/"))
    middleware, own = way[:route], way[route:]
    assert own[0][1].endswith("change_parameters")
    assert ("servo/configuration/writing.py", "Writing.all_or_nothing") in own
    assert own[-1] == ("node/requests.py", "Requests.answered")
    assert len(own) <= MOST_FUNCTIONS, own
    assert len({file for file, _ in own}) <= MOST_FILES, own
    assert len(middleware) <= 4, middleware


def test_no_change_of_a_row_passes_what_switches_torque() -> None:
    assert not [step for step in measured({"angle_p_gain": 50}) if step[0].startswith(("servo/motion", "servo/torque"))]
