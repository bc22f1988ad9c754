"""The path of one change: our functions between the PATCH route, the bus and the response, counted.

A function counts, once, if it calls or awaits what follows it on the path: from the route down to the port of the
adapter, and back to the request that waits. Functions that return earlier (checks, properties, codecs) do not count.
The middleware before the route serves every request and is counted separately.
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
    """Our functions on the stack, the caller first."""
    found: list[Step] = []
    while frame is not None:
        if frame.f_code.co_filename.startswith(PACKAGE):
            file = frame.f_code.co_filename[len(PACKAGE) + 1 :]
            if not file.startswith(BEYOND_THE_PORT):
                found.append((file, frame.f_code.co_qualname))
        frame = frame.f_back
    return found[::-1]


class Trace:
    """The steps of the first write that is requested while it is watched."""

    def __init__(self) -> None:
        self.steps: list[Step] = []
        self._began: dict[asyncio.Task[Any], list[Step]] = {}
        self._awaited = ["Requests.request", "MemoryPort.send", "Requests.receive"]

    def task(self, loop: asyncio.AbstractEventLoop, work: Coroutine[Any, Any, Any], **named: Any) -> asyncio.Task[Any]:
        """Task factory: the functions that start a task are on its path."""
        began = steps(sys._getframe())  # pyright: ignore[reportPrivateUsage]
        made = asyncio.Task(work, loop=loop, **named)
        current = asyncio.current_task(loop)
        self._began[made] = [*(self._began.get(current, []) if current else []), *began]
        return made

    def profile(self, frame: FrameType, event: str, _value: object) -> None:
        """Profile function: record the stack where the path passes from one part to the next."""
        if event != "call" or not self._awaited or frame.f_code.co_qualname != self._awaited[0]:
            return
        if self._awaited[0] == "Requests.request":
            request = frame.f_locals["request"]
            if not isinstance(request, GetSetRequest) or request.value.kind is ValueKind.EMPTY:
                return
            task = asyncio.current_task()
            self.steps += self._began.get(task, []) if task else []
        self.steps += steps(frame)
        del self._awaited[0]


def measured(values: dict[str, object]) -> list[Step]:
    """The path of this change, in order, each function once."""

    async def scene(rig: Rig) -> list[Step]:
        (servo,) = await rig.ready()
        await asyncio.sleep(5)
        trace, loop = Trace(), asyncio.get_running_loop()
        loop.set_task_factory(trace.task)  # pyright: ignore[reportArgumentType]
        sys.setprofile(trace.profile)
        try:
            response = await rig.call("PATCH", f"/servos/{servo.uid}/parameters", {"values": values})
        finally:
            sys.setprofile(None)
            loop.set_task_factory(None)
        assert json(response)["outcome"] == "applied"
        return list(dict.fromkeys(trace.steps))

    return play(scene)


MOST_FUNCTIONS = 14
MOST_FILES = 9


def test_a_change_passes_few_functions_and_none_that_switches_torque() -> None:
    path = measured({"angle_p_gain": 50})
    route = next(at for at, (file, _) in enumerate(path) if file.startswith("api/routes/"))
    middleware, own = path[:route], path[route:]
    assert own[0][1].endswith("change_parameters")
    assert ("servo/configuration/writing.py", "Writing.all_or_nothing") in own
    assert own[-1] == ("node/requests.py", "Requests.receive")
    assert len(own) <= MOST_FUNCTIONS, own
    assert len({file for file, _ in own}) <= MOST_FILES, own
    assert len(middleware) <= 5, middleware
    assert not [step for step in path if step[0].startswith(("servo/motion", "servo/torque"))]
