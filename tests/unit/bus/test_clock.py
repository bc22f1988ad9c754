"""JumpingLoop: time that jumps, exact timers, executors without threads, and deadlock detection."""

import asyncio
import os
import threading

import pytest

from jumping_clock import START, Deadlock, JumpingLoop, run


def test_timers_run_in_order_at_their_exact_instants() -> None:
    async def main() -> list[tuple[str, float]]:
        loop = asyncio.get_running_loop()
        seen: list[tuple[str, float]] = []
        for name, at in (("c", START + 0.3), ("a", START + 1e-6), ("b", START + 0.1 + 0.2)):
            loop.call_at(at, lambda name=name: seen.append((name, loop.time())))
        await asyncio.sleep(1)
        return seen

    # 0.1 + 0.2 is one bit above 0.3, which an event loop cannot tell apart: the timers run at one instant.
    assert run(main()) == [("a", START + 1e-6), ("c", START + 0.3), ("b", START + 0.3)]


def test_a_deadlock_names_the_waiting_tasks() -> None:
    async def main() -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, JumpingLoop)
        loop.stuck_after_s = 0.01
        await asyncio.Event().wait()

    with pytest.raises(Deadlock, match=r"test_a_deadlock_names_the_waiting_tasks\.<locals>\.main"):
        run(main())


def test_another_thread_can_wake_it_through_a_pipe() -> None:
    async def main() -> bytes:
        loop = asyncio.get_running_loop()
        read, write = os.pipe()
        event = asyncio.Event()
        loop.add_reader(read, event.set)
        thread = threading.Thread(target=os.write, args=(write, b"x"))
        thread.start()
        await event.wait()
        loop.remove_reader(read)
        thread.join()
        data = os.read(read, 1)
        os.close(read)
        os.close(write)
        return data

    assert run(main()) == b"x"
