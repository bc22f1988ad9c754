"""An overnight rig under chaos: everything the server reports, compared with what is true in the simulator.

One worker per servo moves, writes, saves and reads it over REST while faults are injected. The truth is read from the
simulator at the same virtual instant. A report that differs is a lie, unless a fault changed the servo during the
request, after the server could last know: then it is undecided. Unknown outcomes that are reported as such are honest.
"""

import asyncio
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count
from random import Random
from typing import Any, Final

from behaviour.rig import Rig, json, play
from hornbill.schema.scale import to_value
from hornbill.sim.bench.chaos import BUS_KINDS, KINDS, ChaosKind, Injection
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.units import Instant, Uid

RECIPES: Final = (
    Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11, rom={"soft_start": 0}),
    Recipe("BLA15-12U-A0", "1.200", servo_id=2, node_id=12, rom={"reverse": 1, "origin": 100, "timeout_action": 2}),
)
BAND_DEG: Final = 1.0
DWELL_S: Final = 0.3
ARRIVED_DEG: Final = 1.0
"""A soft start ends this close to 0°."""
NOISE_DEG: Final = 0.2
"""Resolution of readings and rounding, °."""
LATE_S: Final = 1.0
"""Greatest age of a reading on which a report may rest: a late response and a retry."""
QUIET_S: Final = 6.0
"""Time after the last fault of a servo by which the server must show its true state."""
UNSEEN_S: Final = 14.0
"""Time for which the server has read the angle of a horn that it did not see at 0°."""
SAMPLE_S: Final = 0.04
OFFLINE_S: Final = 5.0
STOP_EVERY: Final = 5
"""Leases between two stops."""

OUTPUT: Final = ("on", "off", "brake")
ROWS: Final = {"angle_p_gain": (40, 60), "smoothing": (False, True), "angle_dead_band": (0.0, 0.5)}
HARMLESS: Final = frozenset[ChaosKind](("slow_start", "refused_rows", "load"))
"""Kinds that change nothing that the server shows."""
RESTARTS: Final = frozenset[ChaosKind](("power_cut", "undervoltage", "restart", "rom_lost"))
HONEST: Final = frozenset(
    (
        "no_response",
        "busy",
        "torque_off",
        "stopped",
        "lease_required",
        "refused_by_servo",
        "configuration_lost",
        "needs_confirmation",
        "conflict",
        "mode_off",
        "interrupted",
        "commanded_elsewhere",
        "out_of_range",
        "lease_held",
        "not_in_this_model",
        "position_unit_unconfirmed",
    )
)
"""Codes that report that something was not done, or that its outcome is unknown."""
UNVERIFIED: Final = frozenset(("rom_unverified", "torque_unverified"))
"""Causes of an unexpected result that leave open what is in ROM."""


@dataclass
class Tally:
    """What happened, and every report that was not true."""

    outcomes: Counter[str] = field(default_factory=Counter[str])
    lies: list[str] = field(default_factory=list[str])
    checked: Counter[str] = field(default_factory=Counter[str])
    undecided: int = 0
    injected: Counter[ChaosKind] = field(default_factory=Counter[ChaosKind])


class Overnight:
    """The rig: one worker per servo, one lease for all, a stop now and then."""

    def __init__(self, rig: Rig, seed: int) -> None:
        self._rig = rig
        self._random = Random(seed)
        self._seed = seed
        self._loop = asyncio.get_running_loop()
        self._began = self._loop.time()
        self._lease: str | None = None
        self._angles: dict[Uid, deque[tuple[Instant, float]]] = {uid: deque(maxlen=400) for uid in rig.bench.servos}
        self.tally = Tally()

    async def run(self, hours: float) -> Tally:
        """Run for this virtual time."""
        rig = self._rig
        await rig.ready(len(rig.bench.servos), within_s=60)
        await asyncio.sleep(5)
        rig.bench.chaos.start(self._seed)
        until = self._loop.time() + hours * 3600
        tasks = [asyncio.create_task(self._sample()), asyncio.create_task(self._watch())]
        tasks += [asyncio.create_task(self._work(uid, Random(f"{self._seed}/{uid}"))) for uid in rig.bench.servos]
        for cycle in count(1):
            if self._loop.time() >= until:
                break
            await self._shift(cycle)
            for task in tasks:
                if task.done():
                    task.result()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self.tally.injected.update(one.kind for one in rig.bench.chaos.injections)
        rig.bench.chaos.stop()
        return self.tally

    async def _shift(self, cycle: int) -> None:
        """One lease of half a minute, then its end, sometimes by Stop."""
        rig = self._rig
        rig.bus.history.clear()
        rig.changes.clear()
        if json(await rig.call("GET", "/stop"))["latched"]:
            json(await rig.call("DELETE", "/stop"))
        self._lease = await rig.lease(ttl_s=60)
        await asyncio.sleep(30)
        ended, self._lease = self._lease, None
        if cycle % STOP_EVERY == 0:
            json(await rig.call("POST", "/stop"))
            await asyncio.sleep(1)
            for one in json(await rig.call("GET", "/stop"))["servos"]:
                uid = Uid(one["uid"])
                if one["confirmed"] and self._calm(uid, 1.0):
                    self._expect("stop", uid, OUTPUT[self._sim(uid).output] != "on", "confirmed, and torque is on")
            self.tally.outcomes["stop"] += 1
        await rig.call("DELETE", f"/leases/{ended}")
        await asyncio.sleep(3)

    async def _work(self, uid: Uid, random: Random) -> None:
        act = (self._move, self._move, self._move, self._write, self._write, self._save, self._read)
        while True:
            await random.choice(act)(uid, random)
            await asyncio.sleep(random.uniform(0.5, 8.0))

    async def _move(self, uid: Uid, random: Random) -> None:
        path = f"/servos/{uid}"
        torque = await self._call("torque", "POST", f"{path}/torque", {"mode": "on"})
        if torque is None:
            return
        target = round(random.uniform(-50, 50), 1)
        wanted = {
            "type": "angle", "value": target, "wait": "settled", "timeout_s": 3.0, "confirm": ["turns", "turn_count"],
            "band_deg": BAND_DEG,
            "dwell_s": DWELL_S,
        }  # fmt: skip
        before = self._starts(uid)
        found = await self._call("move", "POST", f"{path}/command", wanted)
        if found is None:
            return
        self.tally.outcomes["settled" if found["settled"] else f"not settled: {found['unmet']}"] += 1
        near = [abs(angle - target) for _, angle in self._recent(uid, DWELL_S + LATE_S)]
        if found["settled"]:
            needed = int((DWELL_S - 0.1) / SAMPLE_S)
            self._expect("settled", uid, _longest(one <= BAND_DEG + NOISE_DEG for one in near) >= needed,
                         f"settled at {target}, and it was not there: {near[-20:]}")  # fmt: skip
        elif found["unmet"] == "band" and self._starts(uid) == before:
            self._expect("not settled", uid, any(one > BAND_DEG - NOISE_DEG for one in near),
                         f"outside the band of {target}, and it was inside: {near[-20:]}")  # fmt: skip

    async def _write(self, uid: Uid, random: Random) -> None:
        key = random.choice(sorted(ROWS))
        value = random.choice(ROWS[key])
        before, starts = self._ram(uid)[key], self._starts(uid)
        found = await self._call("write", "PATCH", f"/servos/{uid}/parameters", {"values": {key: value}})
        if found is None:
            return
        self.tally.outcomes[f"write {found['outcome']}"] += 1
        after = self._ram(uid)[key]
        if self._starts(uid) != starts or not self._sim(uid).powered:
            self.tally.undecided += 1
        elif found["outcome"] == "applied":
            self._expect("applied", uid, after == value, f"{key} = {value} applied, and it is {after}")
        elif found["outcome"] == "rolled_back":
            verdict = found["changes"][0]["verdict"]
            if verdict == "no_response":  # whether it was restored is unknown, and reported as such
                self.tally.undecided += 1
            else:
                kept = verdict in ("rolled_back", "refused")
                true = (after == before) == kept
                self._expect("rolled_back", uid, true, f"{key} was {before}, is {after}: reported as {verdict}")

    async def _save(self, uid: Uid, random: Random) -> None:
        path = f"/servos/{uid}"
        if await self._call("torque off", "POST", f"{path}/torque", {"mode": "off"}) is None:
            return
        since = self._loop.time()
        lost = self._rig.host.fleet.get(uid).rom_lost  # then only a save of the present values is allowed
        body = {"confirm": ["torque_off_in_rom"]} if lost else {"torque_on": True, "confirm": ["turn_count"]}
        response = await self._rig.call("POST", f"{path}/save?wait=true", body, **self._headers())
        found = response.json()
        if response.status_code != 200:
            self._honest("save", uid, found)
            return
        self.tally.outcomes[f"save {found['state']}"] += 1
        if found["state"] != "succeeded":
            if found["error"].get("cause") == "restarted_before_save":
                self._expect("restarted", uid, self._started(uid) >= since, found["error"]["detail"])
            else:
                self._honest("save", uid, found["error"])
            return
        if any(one.until >= since and one.kind in RESTARTS for one in self._injections(uid)):
            self.tally.undecided += 1
            return
        sim = self._sim(uid)
        self._expect("saved", uid, sim.memory.rom_sound, "saved, and ROM cannot be read")
        await self._compare_rom(uid)

    async def _read(self, uid: Uid, random: Random) -> None:
        starts = self._starts(uid)
        found = await self._call("read", "GET", f"/servos/{uid}/parameters?refresh=true")
        if found is None or self._starts(uid) != starts or not self._sim(uid).powered:
            return
        truth = self._ram(uid)
        now = self._rig.host.base.utc_now()
        for key, row in found["parameters"].items():
            if key in truth and row["at"] is not None and now - row["at"] < 2.0 and not key.startswith("command_"):
                self._expect("read", uid, row["value"] == truth[key], f"{key} reads {row['value']}, is {truth[key]}")

    def _rom(self, uid: Uid) -> dict[str, Any]:
        servo = self._sim(uid)
        raws = servo.stored()
        return {key: to_value(servo.model.parameters[key], raw, raws) for key, raw in raws.items()}

    async def _compare_rom(self, uid: Uid) -> None:
        """What is shown as known in ROM is in ROM."""
        rows = json(await self._rig.call("GET", f"/servos/{uid}/parameters"))["parameters"]
        for key, true in self._rom(uid).items():
            shown = rows.get(key, {}).get("rom")
            if shown is not None:
                self._expect("rom", uid, shown == true, f"{key} in ROM is shown as {shown}, is {true}")

    async def _sample(self) -> None:
        """The true angle of every horn."""
        while True:
            now = self._loop.time()
            for uid in self._rig.bench.servos:
                self._angles[uid].append((now, self._sim(uid).reported_angle_deg))
            await asyncio.sleep(SAMPLE_S)

    async def _watch(self) -> None:
        """State, output, faults and ROM of each servo that nothing has disturbed for a while, and presence."""
        while True:
            await asyncio.sleep(2.5)
            for uid in self._rig.bench.servos:
                shown, servo = json(await self._rig.call("GET", f"/servos/{uid}")), self._sim(uid)
                silent = [one for one in self._active(uid) if one.kind in ("mute", "power_cut")]
                if any(self._loop.time() - one.at > OFFLINE_S for one in silent):
                    self._expect("offline", uid, not shown["online"], "silent, and shown as online")
                if not self._calm(uid, QUIET_S) or servo.stage.value != "running" or self._working(uid):
                    continue
                if self._loop.time() - self._started(uid) < QUIET_S:
                    continue
                self._expect("online", uid, shown["online"], "undisturbed, and shown as offline")
                if shown["state"] != "ready":
                    self.tally.outcomes[f"state {shown['state']}"] += 1
                    continue
                output, true = shown["output"]["state"], OUTPUT[servo.output]
                if not servo.commanded and servo.output != 0:
                    self.tally.undecided += 1  # whether 0x27 runs from the start is an open question
                else:
                    self._expect("output", uid, output in (true, "unknown"), f"output {output}, is {true}")
                faults = json(await self._rig.call("GET", f"/servos/{uid}/faults"))
                active = {one["key"] for one in faults if one["active"] and one["level"] != "notification"}
                real = {key for key in servo.faults.active if not key.endswith("_reached")} & self._levels(servo)
                self._expect("faults", uid, active == real, f"faults {active} shown, are {real}")
                if servo.memory.rom_sound:
                    await self._compare_rom(uid)

    # Requests.

    def _headers(self) -> dict[str, str]:
        return {} if self._lease is None else {"Lease": self._lease}

    async def _call(self, what: str, verb: str, path: str, body: object = None) -> Any:
        """The body of a response, or None for a problem, which must be an honest one."""
        response = await self._rig.call(verb, path, body, **self._headers())
        if response.status_code == 200:
            return response.json()
        self._honest(what, Uid(path.split("/")[2]), response.json())
        return None

    def _honest(self, what: str, uid: Uid, problem: dict[str, Any]) -> None:
        cause = problem.get("cause")
        self.tally.outcomes[f"{what}: {problem['code']}, {cause}"] += 1
        if cause == "rom_differs":
            rom = self._rom(uid)
            differs = any(rom[one["key"]] != one["wanted"] for one in problem["differences"])
            self._expect("differs", uid, differs, problem["detail"])
            return
        if cause == "soft_start_stuck":
            # it may have been there before the server could read its angle
            angles = [angle for _, angle in self._recent(uid, UNSEEN_S)]
            self._expect("stuck", uid, all(abs(one) > ARRIVED_DEG - NOISE_DEG for one in angles), problem["detail"])
            return
        if cause in UNVERIFIED:
            return
        self._expect("problem", uid, problem["code"] in HONEST, f"{what}: {problem['code']}: {problem.get('detail')}")

    def _expect(self, what: str, uid: Uid, true: bool, text: str) -> None:
        self.tally.checked[what] += 1
        if not true:
            at_s = self._loop.time() - self._began
            near = [f"{one.kind} {one.at - self._began:.2f}..{one.until - self._began:.2f}" for one in
                    self._injections(uid) if one.until > self._loop.time() - 15]  # fmt: skip
            self.tally.lies.append(f"{at_s:.2f} s, {uid[:6]}: {what}: {text} {near}")

    # Truth.

    def _sim(self, uid: Uid) -> SimulatedServo:
        return self._rig.bench.servo(uid)

    def _starts(self, uid: Uid) -> int:
        return self._sim(uid).starts

    def _started(self, uid: Uid) -> Instant:
        return self._sim(uid).started_at

    def _ram(self, uid: Uid) -> dict[str, Any]:
        servo = self._sim(uid)
        raws = servo.in_use()
        return {key: to_value(servo.model.parameters[key], raw, raws) for key, raw in raws.items()}

    def _levels(self, servo: SimulatedServo) -> set[str]:
        return {one.key for one in self._rig.host.catalog.faults_of(servo.model.pwm) if one.level != "notification"}

    def _recent(self, uid: Uid, within_s: float) -> list[tuple[Instant, float]]:
        since = self._loop.time() - within_s
        return [one for one in self._angles[uid] if one[0] >= since]

    def _working(self, uid: Uid) -> bool:
        """Whether a job restarts the servo."""
        return self._rig.host.jobs.running(uid) is not None

    def _injections(self, uid: Uid) -> list[Injection]:
        return [one for one in self._rig.bench.chaos.injections if one.uid == uid or one.kind in BUS_KINDS]

    def _active(self, uid: Uid) -> list[Injection]:
        return [one for one in self._injections(uid) if one.active]

    def _calm(self, uid: Uid, for_s: float) -> bool:
        """Whether no fault that shows has acted for this time."""
        since = self._loop.time() - for_s
        return not any(one.until >= since for one in self._injections(uid) if one.kind not in HARMLESS)


def _longest(given: Iterator[bool]) -> int:
    """The longest run of true values."""
    longest = run = 0
    for one in given:
        run = run + 1 if one else 0
        longest = max(longest, run)
    return longest


def night(hours: float, *, seed: int, store: str) -> Tally:
    """Play this many virtual hours with the faults of `seed`. `store`: a folder."""
    return play(lambda rig: Overnight(rig, seed).run(hours), *RECIPES, store=store, seed=seed, fast=True)


PER_HOUR: Final = {
    "settled": 250, "applied": 200, "saved": 60, "rom": 10_000, "read": 2000, "online": 600, "output": 500,
    "faults": 600, "stop": 6,
}  # fmt: skip
"""Reports that each hour must at least have, for a night to mean something."""


def check(tally: Tally, hours: float) -> None:
    """Assert that no report of a night of this length was untrue, and that enough happened."""
    assert tally.lies == []
    assert {key: tally.checked[key] for key, least in PER_HOUR.items() if tally.checked[key] < least * hours} == {}
    assert {*KINDS} == {*tally.injected}
    assert tally.undecided < tally.checked["online"] / 5
