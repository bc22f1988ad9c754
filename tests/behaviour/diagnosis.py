"""Conditions of a bus that the doctor must report, and foreign nodes to cause them."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from behaviour.rig import Rig, json, until
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import AllocationMessage
from hornbill.wire.port import CanPort
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.transfer import Transfer, split

CHECK_S = 0.2


def codes(rig: Rig) -> list[str]:
    """The codes of the current findings, the most severe first."""
    return [one.code for one in rig.host.doctor.findings()]


async def finds(
    rig: Rig, *expected: str, within_s: float, for_s: float = 0.0, evidence: str = "", remedy: str = "", **facts: object
) -> dict[str, Any]:
    """Wait until the doctor reports exactly these codes, check the first finding, and that all stay for `for_s` s.

    `evidence` and `remedy` are parts of these texts; `facts` are other fields. Returns the first finding of
    GET /bus/doctor.
    """
    try:
        await until(lambda: codes(rig) == list(expected), within_s, CHECK_S)
    except TimeoutError:
        raise AssertionError(f"not {expected} within {within_s} s, but {rig.host.doctor.findings()}") from None
    found: list[dict[str, Any]] = json(await rig.call("GET", "/bus/doctor"))
    assert [one["code"] for one in found] == list(expected)
    assert all(one["text"] and one["evidence"] and one["remedy"] for one in found)
    first = found[0]
    assert {key: first[key] for key in facts} == facts
    assert evidence in first["evidence"]
    assert remedy in first["remedy"]
    await stays(rig, *expected, for_s=for_s)
    return first


async def stays(rig: Rig, *expected: str, for_s: float) -> None:
    """Assert that the doctor reports exactly these codes at every check for `for_s` s."""
    loop = asyncio.get_running_loop()
    end = loop.time() + for_s
    while loop.time() < end:
        assert codes(rig) == list(expected), rig.host.doctor.findings()
        await asyncio.sleep(CHECK_S)


async def well(rig: Rig, within_s: float) -> None:
    """Wait until the doctor reports nothing, and assert that it stays so for 5 s."""
    try:
        await until(lambda: not codes(rig), within_s, CHECK_S)
    except TimeoutError:
        raise AssertionError(f"still found after {within_s} s: {rig.host.doctor.findings()}") from None
    assert json(await rig.call("GET", "/bus/doctor")) == []
    await stays(rig, for_s=5)


@dataclass
class Applicant:
    """A node that requests a node ID repeatedly, and sends no more than `stage` (1 to 3) of its three parts."""

    port: CanPort
    unique_id: bytes
    stage: int
    period_s: float = 0.8

    def __post_init__(self) -> None:
        self._reassembler = Reassembler()
        self._sent = 0
        self._timer: asyncio.TimerHandle | None = None
        self.port.listen(self._receive)
        self._request()

    async def leave(self) -> None:
        """Send no more requests."""
        if self._timer is not None:
            self._timer.cancel()
        await self.port.close()

    def _request(self) -> None:
        self._send(0, 6)
        self._timer = asyncio.get_running_loop().call_later(self.period_s, self._request)

    def _receive(self, frames: list[Frame]) -> None:
        for transfer in self._reassembler.feed(frames, asyncio.get_running_loop().time()):
            message = (
                AllocationMessage.decode(transfer.payload) if transfer.type_id == AllocationMessage.TYPE.id else None
            )
            if message is None or not transfer.source or not self.unique_id.startswith(message.unique_id):
                continue
            known = len(message.unique_id)
            if known == 6 and self.stage >= 2:
                self._send(6, 12)
            elif known == 12 and self.stage >= 3:
                self._send(12, 16)

    def _send(self, start: int, end: int) -> None:
        part = AllocationMessage(0, start == 0, self.unique_id[start:end]).encode()
        self._sent += 1
        transfer = Transfer(Kind.MESSAGE, AllocationMessage.TYPE.id, 0, 0, 24, self._sent & 31, part)
        self.port.send(split(transfer, AllocationMessage.TYPE, discriminator=self._sent & 0x3FFF))


class Every:
    """Calls a function every `period_s` seconds until it is stopped."""

    def __init__(self, period_s: float, act: Callable[[int], object]) -> None:
        self._task = asyncio.create_task(self._run(period_s, act))

    async def _run(self, period_s: float, act: Callable[[int], object]) -> None:
        number = 0
        while True:
            act(number)
            number += 1
            await asyncio.sleep(period_s)

    async def stop(self) -> None:
        """Call it no more."""
        self._task.cancel()
        (ended,) = await asyncio.gather(self._task, return_exceptions=True)
        if not isinstance(ended, asyncio.CancelledError):
            raise AssertionError(f"it ended early: {ended!r}")
