"""Chaos: faults injected into simulated servos at random, the same for the same seed."""

import asyncio
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from itertools import count
from random import Random
from typing import Final, Literal, NamedTuple, Protocol, TypeAlias, cast, get_args

from hornbill.sim.servo import SimulatedServo
from hornbill.units import Instant, Uid

INTERVAL_S: Final = 10.0
"""Default mean time between two injections, s."""
RECORDED: Final = 10_000
"""Injections retained."""

ChaosKind: TypeAlias = Literal[
    "power_cut", "undervoltage", "restart", "rom_lost", "slow_start", "mute", "lost_responses", "late_responses",
    "refused_rows", "fault_bit", "load", "heat", "frame_loss", "corrupted_frames",
]  # fmt: skip
KINDS: Final[tuple[ChaosKind, ...]] = cast("tuple[ChaosKind, ...]", get_args(ChaosKind))

Values: TypeAlias = Mapping[str, str | float]


class Wire(Protocol):
    """An embedded bus whose frames can be lost or corrupted."""

    def loss(self, pct: float, *, seed: int = 1) -> None:
        """Lose a share of frames for all receivers, %."""
        ...

    def corruption(self, pct: float, *, seed: int = 1) -> None:
        """Corrupt a share of transmissions, which are repeated, %."""
        ...


class Servos(Protocol):
    """The simulated servos."""

    @property
    def servos(self) -> dict[Uid, SimulatedServo]:
        """All servos by unique ID, in the order they were added."""
        ...

    def power(self, uid: Uid, on: bool) -> None:
        """Switch the supply of a servo."""
        ...


@dataclass(frozen=True, slots=True)
class Target:
    """What an injection acts on: a servo, its supply and the bus."""

    servo: SimulatedServo
    power: Callable[[bool], None]
    wire: Wire | None


_Fault: TypeAlias = Callable[[Target, Random], AbstractContextManager[Values]]


@contextmanager
def _power_cut(target: Target, _random: Random) -> Generator[Values]:
    target.power(False)
    yield {}
    target.power(True)


@contextmanager
def _restart(target: Target, random: Random) -> Generator[Values]:
    causes = sorted(key for key in target.servo.faults.keys if key.endswith("_restart"))
    cause = random.choice(causes)
    target.servo.faults.inject(cause, True)
    yield {"fault": cause}


@contextmanager
def _rom_lost(target: Target, _random: Random) -> Generator[Values]:
    target.power(False)
    target.servo.memory.rom_sound = False
    yield {}
    target.power(True)


def _condition(name: str, draw: Callable[[Random], float]) -> _Fault:
    """A fault that sets a field of the servo's conditions to a random value."""

    @contextmanager
    def fault(target: Target, random: Random) -> Generator[Values]:
        conditions = target.servo.conditions
        before = getattr(conditions, name)
        setattr(conditions, name, draw(random))
        yield {name: getattr(conditions, name)}
        setattr(conditions, name, before)

    return fault


_undervoltage = _condition("voltage_v", lambda random: round(random.uniform(1.5, 5.5), 1))
_slow_start = _condition("restart_delay_s", lambda random: round(random.uniform(0.5, 6.0), 2))
_lost_responses = _condition("drop_responses_pct", lambda random: round(random.uniform(5, 60)))
_late_responses = _condition("response_delay_s", lambda random: round(random.uniform(0.02, 0.6), 3))
_load = _condition("load_pct", lambda random: round(random.choice((-1, 1)) * random.uniform(10, 90)))
_heat = _condition("temperature_c", lambda random: round(random.uniform(60, 110)))


@contextmanager
def _mute(target: Target, _random: Random) -> Generator[Values]:
    target.servo.conditions.mute = True
    yield {}
    target.servo.conditions.mute = False


@contextmanager
def _refused_rows(target: Target, random: Random) -> Generator[Values]:
    servo = target.servo
    row = random.choice(sorted(row.key for row in servo.memory.rows.values() if row.rom and row.writable))
    servo.conditions.refuse_keys.add(row)
    yield {"key": row}
    servo.conditions.refuse_keys.discard(row)


@contextmanager
def _fault_bit(target: Target, random: Random) -> Generator[Values]:
    faults = target.servo.faults
    key = random.choice(sorted(key for key in faults.keys if not key.endswith(("_restart", "rom_lost"))))
    faults.inject(key, True)
    yield {"fault": key}
    faults.inject(key, False)


@contextmanager
def _frame_loss(target: Target, random: Random) -> Generator[Values]:
    assert target.wire is not None
    pct = round(random.uniform(1, 30))
    target.wire.loss(pct, seed=random.getrandbits(31))
    yield {"pct": pct}
    target.wire.loss(0)


@contextmanager
def _corrupted_frames(target: Target, random: Random) -> Generator[Values]:
    assert target.wire is not None
    pct = round(random.uniform(1, 8))  # more would drive the senders to bus-off
    target.wire.corruption(pct, seed=random.getrandbits(31))
    yield {"pct": pct}
    target.wire.corruption(0)


class _Row(NamedTuple):
    fault: _Fault
    shortest_s: float
    longest_s: float
    weight: int
    acts_on: str
    """Two injections never act on the same at the same time."""


_TABLE: Final[Mapping[ChaosKind, _Row]] = {
    "power_cut": _Row(_power_cut, 0.05, 6, 3, "supply"),
    "undervoltage": _Row(_undervoltage, 0.05, 4, 2, "voltage"),
    "restart": _Row(_restart, 1, 1, 2, "restart"),
    "rom_lost": _Row(_rom_lost, 0.2, 2, 1, "supply"),
    "slow_start": _Row(_slow_start, 5, 60, 1, "start"),
    "mute": _Row(_mute, 0.05, 6, 3, "mute"),
    "lost_responses": _Row(_lost_responses, 1, 20, 3, "responses"),
    "late_responses": _Row(_late_responses, 1, 20, 3, "delay"),
    "refused_rows": _Row(_refused_rows, 5, 60, 2, "rows"),
    "fault_bit": _Row(_fault_bit, 1, 30, 3, "faults"),
    "load": _Row(_load, 1, 15, 3, "load"),
    "heat": _Row(_heat, 2, 30, 2, "heat"),
    "frame_loss": _Row(_frame_loss, 0.5, 10, 2, "loss"),
    "corrupted_frames": _Row(_corrupted_frames, 0.5, 10, 2, "corruption"),
}
"""Fault, shortest and longest duration, weight."""

BUS_KINDS: Final = frozenset[ChaosKind](("frame_loss", "corrupted_frames"))
"""Kinds that act on the bus rather than on a servo."""


@dataclass(frozen=True, slots=True)
class Planned:
    """An injection of a plan. Times are seconds from its start; `servo` is an index, None for the bus."""

    number: int
    kind: ChaosKind
    servo: int | None
    at_s: float
    until_s: float
    seed: str


def plan(
    seed: int, servos: int, kinds: Sequence[ChaosKind] = KINDS, interval_s: float = INTERVAL_S
) -> Iterator[Planned]:
    """All injections of `seed` for a number of servos, in order, without end. Equal arguments give equal plans.

    `interval_s`: mean time between two injections.
    """
    busy: dict[tuple[int | None, str], float] = {}
    at_s = 0.0
    for number in count(1):
        random = Random(f"{seed}/{number}")
        at_s += random.expovariate(1 / interval_s)
        kind = random.choices(kinds, [_TABLE[one].weight for one in kinds])[0]
        row, servo = _TABLE[kind], None if kind in BUS_KINDS else random.randrange(servos)
        until_s = at_s + random.uniform(row.shortest_s, row.longest_s)
        if busy.get((servo, row.acts_on), 0.0) >= at_s:
            continue
        busy[servo, row.acts_on] = until_s
        yield Planned(number, kind, servo, at_s, until_s, f"{seed}/{number}/{kind}")


@dataclass(slots=True)
class Injection:
    """An injection that happened. `uid` is None for the bus. Times on the clock of the event loop."""

    number: int
    kind: ChaosKind
    uid: Uid | None
    values: Values
    at: Instant
    until: Instant
    active: bool = True


@dataclass(slots=True)
class _Run:
    """A running plan."""

    seed: int
    kinds: tuple[ChaosKind, ...]
    interval_s: float
    began: Instant
    uids: tuple[Uid, ...]
    planned: Iterator[Planned]
    timers: set[asyncio.TimerHandle] = field(default_factory=set[asyncio.TimerHandle])
    ending: dict[int, Callable[[], None]] = field(default_factory=dict[int, Callable[[], None]])


class Chaos:
    """Injects the faults of a plan into the servos of a bench, on the clock of the event loop."""

    def __init__(self, bench: Servos, wire: Wire | None) -> None:
        """`wire`: the embedded bus. Without one, only servos have faults."""
        self._bench = bench
        self._wire = wire
        self._run: _Run | None = None
        self.injections: deque[Injection] = deque(maxlen=RECORDED)
        """The last injections since the last start, oldest first."""
        self.injected = 0
        """Number of injections since the last start."""

    @property
    def running(self) -> bool:
        """Whether faults are being injected."""
        return self._run is not None

    @property
    def seed(self) -> int | None:
        """Seed of the running plan."""
        return None if self._run is None else self._run.seed

    @property
    def kinds(self) -> tuple[ChaosKind, ...]:
        """Kinds of the running plan."""
        return () if self._run is None else self._run.kinds

    @property
    def interval_s(self) -> float | None:
        """Mean time between two injections of the running plan, s."""
        return None if self._run is None else self._run.interval_s

    def start(self, seed: int, kinds: Sequence[ChaosKind] = KINDS, interval_s: float = INTERVAL_S) -> None:
        """Start the plan of `seed` for the present servos, in place of a running one.

        Without an embedded bus, its kinds are left out. Raises ValueError if there is nothing to inject into.
        """
        possible: list[ChaosKind] = [one for one in KINDS if self._wire is not None or one not in BUS_KINDS]
        usable: list[ChaosKind] = [one for one in possible if one in kinds]
        uids = tuple(self._bench.servos)
        if not usable or not uids:
            raise ValueError("There are no simulated servos." if usable else "None of these kinds is possible here.")
        self.stop()
        self.injections.clear()
        self.injected = 0
        now = asyncio.get_running_loop().time()
        self._run = _Run(seed, (*usable,), interval_s, now, uids, plan(seed, len(uids), usable, interval_s))
        self._next(self._run)

    def stop(self) -> None:
        """End all injections and inject no more. Idempotent."""
        run, self._run = self._run, None
        if run is not None:
            for timer in run.timers:
                timer.cancel()
            for end in [*run.ending.values()]:
                end()

    def _next(self, run: _Run) -> None:
        planned = next(run.planned)
        self._at(run, run.began + planned.at_s, lambda: self._inject(run, planned))

    def _at(self, run: _Run, when: Instant, act: Callable[[], None]) -> None:
        def due() -> None:
            run.timers.discard(timer)
            act()

        timer = asyncio.get_running_loop().call_at(when, due)
        run.timers.add(timer)

    def _inject(self, run: _Run, planned: Planned) -> None:
        self._next(run)
        uid = run.uids[planned.servo or 0]
        servo = self._bench.servos.get(uid)
        if servo is None:  # removed meanwhile
            return
        target = Target(servo, lambda on: self._power(uid, on), self._wire)
        fault = _TABLE[planned.kind].fault(target, Random(planned.seed))
        values = fault.__enter__()
        on = None if planned.servo is None else uid
        injection = Injection(
            planned.number, planned.kind, on, values, run.began + planned.at_s, run.began + planned.until_s
        )
        self.injections.append(injection)
        self.injected += 1

        def end() -> None:
            del run.ending[planned.number]
            injection.active = False
            injection.until = asyncio.get_running_loop().time()
            fault.__exit__(None, None, None)

        run.ending[planned.number] = end
        self._at(run, injection.until, end)

    def _power(self, uid: Uid, on: bool) -> None:
        if uid in self._bench.servos:
            self._bench.power(uid, on)
