"""The simulator alone: CPU time for a second of servos that all move, receive and send, without a bus.

The peer is the shortest loop that moves as many horns in as many steps: no friction, no limits, no messages.
"""

import heapq
import math
import statistics
import time
from collections.abc import Iterator
from typing import Any

from bench.line import cpu, line
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.mechanics.plant import STEP_S
from hornbill.sim.servo import SimulatedServo
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType
from hornbill.wire.transfer import Transfer, split

ROUNDS = 5
SECONDS = 2.0
"""Virtual time per round."""

BATCH_S = 0.001
"""Frames per batch of an adapter or the embedded bus."""

COMMANDS_HZ = 20.0
"""Rate of new angles of every servo. They move by ±60°, each in its own phase, and never settle."""

_HOST, _PER_MESSAGE, _STATION = 127, 15, 100.0
_FREE = {"soft_start": 0, "timeout_action": 0, "speed_torque_control": 1}


def figures() -> Iterator[dict[str, Any]]:
    """16 and 125 servos; `core` is CPU seconds for one of theirs."""
    catalog = Catalog.load()
    for count, must in ((16, 30), (125, 37)):  # 37 is half a core where the peer takes 13.5 ms
        pairs = [(Flock(catalog, count).cost(), cpu(lambda count=count: _shortest(count))) for _ in range(ROUNDS)]
        costs = sorted(ours for ours, _ in pairs)
        found = {
            "times": round(statistics.median(ours / theirs for ours, theirs in pairs), 1),
            "core": round(costs[ROUNDS // 2], 4),
            "worst_core": round(costs[-1], 4),
            "integration_hz": round(1.0 / STEP_S),
        }
        yield line(f"simulate {count} moving servos", found, must=must, of="times", peer="the shortest loop in Python")


def _shortest(count: int) -> None:
    """Move horns for a second: proportional control of a motor with viscous friction."""
    for _ in range(count):
        angle = speed = 0.0
        for _ in range(round(1.0 / STEP_S)):
            speed += (30.0 * (60.0 - angle) - 10.0 * speed) * STEP_S
            angle += speed * STEP_S


class Flock:
    """Servos with node and servo ids 1 to `count`, brought up and in motion."""

    def __init__(self, catalog: Catalog, count: int) -> None:
        self._servos: list[SimulatedServo] = []
        self._now = 0.0
        self._commanded_at = 0.0
        for number in range(1, count + 1):
            servo = Recipe(servo_id=number, node_id=number, rom=_FREE).build(catalog, number)
            servo.power_on(0.0)
            self._servos.append(servo)
        self._due = [(servo.next_due(), number) for number, servo in enumerate(self._servos)]
        heapq.heapify(self._due)
        self._run(1.0)

    def cost(self) -> float:
        """CPU seconds for one second in which all servos move."""
        began = time.process_time()
        self._run(SECONDS)
        spent = time.process_time() - began
        resting = sum(servo.asleep for servo in self._servos)
        if resting:
            raise AssertionError(f"{resting} servos rest: this figure would say nothing")
        return spent / SECONDS

    def _run(self, seconds: float) -> None:
        end = self._now + seconds
        while self._now < end:
            self._now += BATCH_S
            sent: list[tuple[int, list[Frame]]] = []
            while self._due[0][0] <= self._now:
                _, number = heapq.heappop(self._due)
                servo = self._servos[number]
                servo.advance(self._now)
                sent.append((number, servo.take_outbox()))
                heapq.heappush(self._due, (servo.next_due(), number))
            if self._commanded_at <= self._now:
                self._commanded_at += 1.0 / COMMANDS_HZ
                sent.append((-1, self._commands()))
            for source, frames in sent:
                for number, servo in enumerate(self._servos):
                    if number != source and frames:
                        servo.on_frames(frames, self._now)

    def _commands(self) -> list[Frame]:
        """The next angle of each servo, 15 per message; in the servo's unit 1.0 is 100°."""
        swing = [
            ActuatorCommand(number, CommandType.POSITION, 60.0 / _STATION * math.sin(5.0 * self._now + number))
            for number in range(1, len(self._servos) + 1)
        ]
        frames: list[Frame] = []
        for first in range(0, len(swing), _PER_MESSAGE):
            message = ArrayCommand(swing[first : first + _PER_MESSAGE])
            transfer = Transfer(Kind.MESSAGE, ArrayCommand.TYPE.id, _HOST, 0, 16, first & 31, message.encode())
            frames += split(transfer, ArrayCommand.TYPE)
        return frames
