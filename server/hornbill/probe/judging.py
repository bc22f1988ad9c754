"""The answers: each is taken from the recording alone, with the figures that make it so."""

import itertools
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from hornbill.domain.servo import PositionUnit
from hornbill.probe.evidence import Exchange, ProbeEvidence
from hornbill.schema.catalog import Catalog
from hornbill.servo.device.position_estimate import DEGREES, NAMES
from hornbill.units import Instant
from hornbill.wire.messages import AllocationMessage, NodeHealth
from hornbill.wire.services import (
    ExecuteOpcodeRequest,
    ExecuteOpcodeResponse,
    GetSetRequest,
    Opcode,
    RestartNodeRequest,
    RestartNodeResponse,
)

DUMMY: Final = 555_555_555
LEAST_TENTHS: Final = 20
"""An angle below 2° tells no unit: rounding alone would be a tenth of it."""
APART_S: Final = 0.15
AGREES: Final = 0.1
"""A unit is told when the ratio is within a tenth of it; the closest two are 1.7 apart."""
NEAR_S: Final = 2.0
"""A fault word read so long before or after a NodeStatus stands beside it: the server reads those that are set about
once a second."""
STILL_DEG: Final = 1.0


@dataclass(frozen=True)
class ProbeAnswer:
    """One answer. `value` for programs, `text` for people; None says that the recording does not tell, and why."""

    key: str
    question: str
    value: object
    text: str
    evidence: str = ""
    switch: str | None = None
    """The setting of the simulator it decides (hornbill.sim.behaviour)."""


def answers(seen: ProbeEvidence) -> list[ProbeAnswer]:
    """Every question, in the order of the report."""
    return [judge(seen) for judge in _JUDGES]


def position_unit(seen: ProbeEvidence) -> ProbeAnswer:
    """0x08, in tenths of a degree for certain, beside the position of the Status next to it."""
    ratios: list[float] = []
    statuses = [(at, one.position) for at, one in seen.statuses()]
    for at, raw in seen.readings("0x08"):
        near = min(statuses, key=lambda one: abs(one[0] - at), default=None)
        if raw is None or near is None or abs(raw) < LEAST_TENTHS or abs(near[0] - at) > APART_S or not near[1]:
            continue
        ratios.append(raw / 10 / near[1])
    question = "What does position 1.0 in Status mean?"
    if len(ratios) < 3:
        why = "The horn stood within 2° of zero, where every unit looks alike: turn it, or let it move."
        return ProbeAnswer("position_unit", question, None, why, f"{len(ratios)} usable pairs", "position_unit")
    ratio = statistics.median(ratios)
    unit: PositionUnit = min(DEGREES, key=lambda one: abs(abs(ratio) / DEGREES[one] - 1))
    evidence = f"0x08 / position is {ratio:.4g}° at the median of {len(ratios)} pairs"
    if abs(ratio / DEGREES[unit] - 1) > AGREES:
        return ProbeAnswer("position_unit", question, None, "None of the four units fits.", evidence, "position_unit")
    return ProbeAnswer("position_unit", question, unit, f"{NAMES[unit]}: 1.0 is {DEGREES[unit]:.4g}°", evidence,
                  "position_unit")  # fmt: skip


def status_interval(seen: ProbeEvidence) -> ProbeAnswer:
    """Time between two Status; 100 ms by table 2-2."""
    return _interval("status_interval_s", "How often does Status come?", [at for at, _ in seen.statuses()])


def node_status_interval(seen: ProbeEvidence) -> ProbeAnswer:
    """Time between two NodeStatus; 1000 ms by table 2-2."""
    times = [at for at, _ in seen.node_statuses()]
    return _interval("node_status_interval_s", "How often does NodeStatus come?", times)


def unused_fields(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether force, speed and power of Status are ever anything but 0 (table 2-22: not used)."""
    question = "Are force, speed and power of Status used?"
    values = {(one.force, one.speed, one.power_rating_pct) for _, one in seen.statuses()}
    if not values:
        return ProbeAnswer("status_unused_zero", question, None, "No Status was heard.")
    zero = all(not any(one) for one in values)
    shown = ", ".join(str(one) for one in sorted(values, key=str)[:3])
    return ProbeAnswer("status_unused_zero", question, zero, "No: all are 0." if zero else f"Yes: {shown}",
                  f"{len(seen.statuses())} Status")  # fmt: skip


def latency(seen: ProbeEvidence) -> ProbeAnswer:
    """From a GetSet request to its answer, both as whole transfers on the bus."""
    question = "How soon is a parameter answered?"
    asked = seen.asked(GetSetRequest)
    took = sorted(one.took_s for one in asked if one.took_s is not None)
    if not took:
        return ProbeAnswer("latency_s", question, None, "No answer was recorded.")
    most = took[-1]
    typical = statistics.median(took)
    evidence = f"{len(took)} of {len(asked)} requests answered, at the latest after {most * 1000:.2f} ms"
    return ProbeAnswer("latency_s", question, round(typical, 6), f"{typical * 1000:.2f} ms at the median", evidence)


def identity(seen: ProbeEvidence) -> ProbeAnswer:
    """What 0x50 to 0x53 answer: model, product number, firmware, hardware (4.40 to 4.43)."""
    found = {name: _last(seen, name) for name in ("0x50", "0x51", "0x52", "0x53")}
    shown = ", ".join(f"{name} = {'no value' if raw is None else raw}" for name, raw in found.items())
    return ProbeAnswer("identity", "What do 0x50 to 0x53 answer?", found, shown)


def dummies(seen: ProbeEvidence) -> ProbeAnswer:
    """Which of 0x00 to 0x02 ever answered 555,555,555 (4.1 to 4.3)."""
    found = {name: any(raw == DUMMY for _, raw in seen.readings(name)) for name in ("0x00", "0x01", "0x02")}
    asked = sum(len(seen.readings(name)) for name in found)
    names = [name for name, is_one in found.items() if is_one]
    text = f"{', '.join(names)} did." if names else "None did."
    question = "Does a command that is not in force read 555,555,555?"
    return ProbeAnswer(
        "dummies", question, found if asked else None, text if asked else "Not read.", f"{asked} readings"
    )


def refused_rows(seen: ProbeEvidence) -> ProbeAnswer:
    """Registers that answered without a value: they exist in the tables for this model, and not in this servo."""
    asked: dict[str, bool] = {}
    for request, answer in seen.asked(GetSetRequest):
        if isinstance(request.structure, GetSetRequest) and answer is not None:
            name = request.structure.name
            asked[name] = any(raw is not None for _, raw in seen.readings(name)) if name not in asked else asked[name]
    names = sorted(name for name, has in asked.items() if not has)
    text = ", ".join(names) or "None: every register of this model and firmware has a value."
    return ProbeAnswer("refused_rows", "Which registers answer without a value?", names if asked else None, text,
                  f"{len(asked)} registers asked")  # fmt: skip


def health_of_notifications(seen: ProbeEvidence) -> ProbeAnswer:
    """The health in NodeStatus beside a notification with neither a warning nor a failure (table 2-18, 4.12)."""
    key, question = "health_of_notifications", "Does a notification alone make NodeStatus say WARNING?"
    words = {name: seen.readings(name) for name in ("0x19", "0x1A", "0x1B")}
    found: list[NodeHealth] = []
    for at, one in seen.node_statuses():
        told = [_nearest(readings, at) for readings in words.values()]
        if told[0] and told[1:] == [0, 0]:
            found.append(one.health)
    if not found:
        why = "No notification was set, or not alone: move the horn to one of its angle limits and probe again."
        return ProbeAnswer(key, question, None, why, switch=key)
    does = all(health == NodeHealth.WARNING for health in found)
    if len(set(found)) > 1:
        return ProbeAnswer(key, question, None, "Now and then: probe again.", f"{len(found)} NodeStatus seen", key)
    text = "Yes." if does else "No: health stays OK."
    return ProbeAnswer(key, question, does, text, f"{len(found)} NodeStatus beside a notification", key)


def answers_restart(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether RestartNode is answered before the restart (table 2-10)."""
    return _answered("answers_restart", "Is RestartNode answered?", _restart(seen), "restart")


def restart_time(seen: ProbeEvidence) -> ProbeAnswer:
    """From RestartNode to the first NodeStatus of the new life."""
    return _time_away("restart_time_s", "How long does a restart take?", seen, _restart(seen), "restart")


def answers_save(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether the opcode SAVE is answered before the silence of the ROM write (4.11)."""
    return _answered("answers_save", "Is SAVE answered?", _save(seen), "save")


def save_restarts(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether the opcode SAVE ends in a restart by itself (4.11 promises it for 0x12)."""
    question = "Does the opcode SAVE restart the servo?"
    save = _save(seen)
    if save is None:
        return ProbeAnswer("save_opcode_restarts", question, None, "No save was made.", switch="save_opcode_restarts")
    again = _new_life(seen, save.request.at)
    helped = [one for one in seen.asked(RestartNodeRequest) if save.request.at < one.request.at < (again or 1e18)]
    does = again is not None and not helped
    text = "Yes, by itself." if does else "No: it had to be asked to." if again else "No restart was seen."
    return ProbeAnswer("save_opcode_restarts", question, does, text, switch="save_opcode_restarts")


def save_time(seen: ProbeEvidence) -> ProbeAnswer:
    """From SAVE to the first NodeStatus of the new life: the ROM write and the restart."""
    return _time_away("save_time_s", "How long is a servo away for a save?", seen, _save(seen), "save")


def soft_start_time(seen: ProbeEvidence) -> ProbeAnswer:
    """From the first Status of a new life until the horn stays where it ends (4.14); the longest in the recording."""
    question = "How long does soft start take?"
    unit = position_unit(seen).value
    if not isinstance(unit, str) or unit not in DEGREES:
        return ProbeAnswer("soft_start_time_s", question, None, "Not told while the position unit is not known.")
    scale = DEGREES[unit]
    found: list[tuple[float, float]] = []
    for begin in _new_lives(seen):
        path = [(at, one.position * scale) for at, one in seen.statuses() if begin - 0.5 <= at < begin + 20]
        if len(path) < 2:
            continue
        last = path[-1][1]
        moving = [at for at, angle in path if abs(angle - last) > STILL_DEG]
        if moving:
            found.append((moving[-1] - path[0][0], path[0][1] - last))
    if not found:
        return ProbeAnswer("soft_start_time_s", question, None, "No horn was seen to travel after a restart.")
    took, way = max(found)
    evidence = f"{abs(way):.1f}° at {abs(way) / max(took, 0.05):.0f} °/s, by Status every 100 ms"
    return ProbeAnswer("soft_start_time_s", question, round(took, 2), f"{took:.1f} s", evidence)


def soft_start_shows(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether rows read temporary values while the horn travels after a start (4.14)."""
    question = "What do the speed and torque limits read during soft start?"
    took = soft_start_time(seen).value
    changed: list[str] = []
    within = 0
    names = [row.name for row in Catalog.load().parameters.values() if row.soft_start is not None]
    lives = _new_lives(seen) if isinstance(took, float) else []
    for begin in lives:
        for name in names:
            after = [(at - begin, raw) for at, raw in seen.readings(name) if begin <= at < begin + 20]
            during = [raw for at, raw in after if at < float(str(took))]
            within += len(during)
            if during and during[0] != after[-1][1]:
                changed.append(f"{name}: {during[0]}, then {after[-1][1]}")
    if not within:
        why = "None was read while it lasted." if took else "No soft start was seen."
        return ProbeAnswer("soft_start_shows", question, None, why, switch="soft_start_shows")
    text = "Temporary values." if changed else "What is stored."
    return ProbeAnswer("soft_start_shows", question, "temporary" if changed else "stored", text, "; ".join(changed),
                  "soft_start_shows")  # fmt: skip


def node_id(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether the servo asked for its node id again after a restart, and got the same (table 2-7, 4.38)."""
    question = "Does it keep its node id over a restart?"
    lives = _new_lives(seen)
    if not lives:
        return ProbeAnswer("keeps_node_id", question, None, "No restart was made.")
    asked = [one for one in seen.told if isinstance(one.structure, AllocationMessage) and not one.transfer.source]
    before = {one.transfer.source for one in seen.told if one.at < lives[0]} & seen.nodes
    after = {one.transfer.source for one in seen.told if one.at >= lives[0]} & seen.nodes
    kept = before == after
    how = "It asked for it again" if asked else "It did not ask: the id is its own"
    shown = f"{_ids(before)} before, {_ids(after)} after"
    return ProbeAnswer("keeps_node_id", question, kept, f"{'Yes' if kept else 'No'}: {shown}.",
                  f"{how} ({len(asked)} requests on the bus)")  # fmt: skip


def _interval(key: str, question: str, times: list[Instant]) -> ProbeAnswer:
    between = [later - sooner for sooner, later in itertools.pairwise(times)]
    if len(between) < 3:
        return ProbeAnswer(key, question, None, "Too few were heard.", f"{len(times)} heard")
    typical = statistics.median(between)
    evidence = f"{len(times)} heard, {min(between) * 1000:.1f} to {max(between) * 1000:.1f} ms apart"
    return ProbeAnswer(key, question, round(typical, 4), f"every {typical * 1000:.1f} ms at the median", evidence)


def _nearest(readings: list[tuple[Instant, int | None]], at: Instant) -> int | None:
    """The reading next to an instant; None where there is none within NEAR_S."""
    near = min(readings, key=lambda one: abs(one[0] - at), default=None)
    return near[1] if near is not None and abs(near[0] - at) <= NEAR_S else None


def _last(seen: ProbeEvidence, name: str) -> int | None:
    found = seen.readings(name)
    return found[-1][1] if found else None


def _restart(seen: ProbeEvidence) -> Exchange | None:
    return next(iter(seen.asked(RestartNodeRequest)), None)


def _save(seen: ProbeEvidence) -> Exchange | None:
    for one in seen.asked(ExecuteOpcodeRequest):
        if isinstance(one.request.structure, ExecuteOpcodeRequest) and one.request.structure.opcode == Opcode.SAVE:
            return one
    return None


def _answered(key: str, question: str, asked: Exchange | None, what: str) -> ProbeAnswer:
    if asked is None:
        return ProbeAnswer(key, question, None, f"No {what} was made.", switch=key)
    if asked.answer is None or asked.took_s is None:
        return ProbeAnswer(key, question, False, "No answer came.", switch=key)
    said = asked.answer.structure
    ok = said.ok if isinstance(said, (RestartNodeResponse, ExecuteOpcodeResponse)) else None
    return ProbeAnswer(key, question, True, f"Yes, ok = {ok}.", f"after {asked.took_s * 1000:.2f} ms", key)


def _time_away(key: str, question: str, seen: ProbeEvidence, asked: Exchange | None, what: str) -> ProbeAnswer:
    if asked is None:
        return ProbeAnswer(key, question, None, f"No {what} was made.")
    again = _new_life(seen, asked.request.at)
    if again is None:
        return ProbeAnswer(key, question, None, "It was not heard again with a younger uptime.")
    heard = [one.at for one in seen.told if one.transfer.source in seen.nodes and asked.request.at < one.at < again]
    silent = again - max([*heard, asked.request.at])
    took = again - asked.request.at
    return ProbeAnswer(key, question, round(took, 3), f"{took * 1000:.0f} ms until its first NodeStatus",
                  f"silent for {silent * 1000:.0f} ms before it")  # fmt: skip


def _new_lives(seen: ProbeEvidence) -> list[Instant]:
    """When uptime went back: the first NodeStatus of each new life."""
    told = seen.node_statuses()
    return [
        at for (_, before), (at, now) in itertools.pairwise(told) if now.uptime_sec < before.uptime_sec
    ]  # fmt: skip


def _new_life(seen: ProbeEvidence, after: Instant) -> Instant | None:
    return next((at for at in _new_lives(seen) if at > after), None)


def _ids(nodes: set[int]) -> str:
    return ", ".join(map(str, sorted(nodes))) or "none"


_JUDGES: Final[tuple[Callable[[ProbeEvidence], ProbeAnswer], ...]] = (
    position_unit, identity, status_interval, node_status_interval, unused_fields, latency, dummies, refused_rows,
    health_of_notifications, answers_restart, restart_time, soft_start_time, soft_start_shows, node_id, answers_save,
    save_restarts, save_time,
)  # fmt: skip
