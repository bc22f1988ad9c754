"""Answers derived from the log alone, with the measurements."""

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
from hornbill.wire.messages import AllocationMessage, ArrayCommand, NodeHealth
from hornbill.wire.services import (
    EMPTY,
    ExecuteOpcodeRequest,
    ExecuteOpcodeResponse,
    GetSetRequest,
    GetSetResponse,
    Opcode,
    RestartNodeRequest,
    RestartNodeResponse,
)

DUMMY: Final = 555_555_555
LEAST_TENTHS: Final = 20
"""Below 2° the unit cannot be determined: rounding alone would be a tenth of the angle."""
APART_S: Final = 0.15
AGREES: Final = 0.1
"""Tolerance of the ratio for a unit. The closest two units differ by a factor of 1.7."""
NEAR_S: Final = 2.0
"""A fault word is compared with a NodeStatus at most this far apart: the server reads set words about once a second."""
STILL_DEG: Final = 1.0
ARRIVAL_S: Final = 0.2
"""Time a small move takes at most, soft limits included."""


@dataclass(frozen=True)
class ProbeAnswer:
    """One answer. `value` for programs, `text` for users. A value of None means unknown; `text` is then the reason."""

    key: str
    question: str
    value: object
    text: str
    evidence: str = ""
    switch: str | None = None
    """The switch of the simulator it determines (hornbill.sim.behaviour)."""


def answers(seen: ProbeEvidence) -> list[ProbeAnswer]:
    """All answers, in the order of the report."""
    return [answer(seen) for answer in _QUESTIONS]


def position_unit(seen: ProbeEvidence) -> ProbeAnswer:
    """Ratio of 0x08, which is in tenths of a degree, to the position of the nearest Status."""
    ratios: list[float] = []
    statuses = [(at, one.position) for at, one in seen.statuses()]
    for at, raw in seen.readings("0x08"):
        near = min(statuses, key=lambda one: abs(one[0] - at), default=None)
        if raw is None or near is None or abs(raw) < LEAST_TENTHS or abs(near[0] - at) > APART_S or not near[1]:
            continue
        ratios.append(raw / 10 / near[1])
    question = "What does position 1.0 in Status mean?"
    if len(ratios) < 3:
        why = "The horn was within 2° of zero, where units cannot be distinguished. Turn it, or allow it to move."
        return ProbeAnswer("position_unit", question, None, why, f"{len(ratios)} usable pairs", "position_unit")
    ratio = statistics.median(ratios)
    unit: PositionUnit = min(DEGREES, key=lambda one: abs(abs(ratio) / DEGREES[one] - 1))
    evidence = f"0x08 / position is {ratio:.4g}° (median of {len(ratios)} pairs)"
    if abs(ratio / DEGREES[unit] - 1) > AGREES:
        return ProbeAnswer("position_unit", question, None, "No known unit matches.", evidence, "position_unit")
    return ProbeAnswer("position_unit", question, unit, f"{NAMES[unit]}: 1.0 is {DEGREES[unit]:.4g}°", evidence,
                  "position_unit")  # fmt: skip


def status_interval(seen: ProbeEvidence) -> ProbeAnswer:
    """Time between two Status; 100 ms by table 2-2."""
    return _interval("status_interval_s", "How often is Status sent?", [at for at, _ in seen.statuses()])


def node_status_interval(seen: ProbeEvidence) -> ProbeAnswer:
    """Time between two NodeStatus; 1000 ms by table 2-2."""
    times = [at for at, _ in seen.node_statuses()]
    return _interval("node_status_interval_s", "How often is NodeStatus sent?", times)


def unused_fields(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether force, speed and power of Status are ever other than 0 (table 2-22: not used)."""
    question = "Are force, speed and power of Status used?"
    values = {(one.force, one.speed, one.power_rating_pct) for _, one in seen.statuses()}
    if not values:
        return ProbeAnswer("status_unused_zero", question, None, "No Status was received.")
    zero = all(not any(one) for one in values)
    shown = ", ".join(str(one) for one in sorted(values, key=str)[:3])
    return ProbeAnswer("status_unused_zero", question, zero, "No: all are 0." if zero else f"Yes: {shown}",
                  f"{len(seen.statuses())} Status")  # fmt: skip


def latency(seen: ProbeEvidence) -> ProbeAnswer:
    """Time from a GetSet request to its response, both as complete transfers on the bus."""
    question = "What is the response time of parameters?"
    exchanges = seen.exchanges(GetSetRequest)
    took = sorted(one.took_s for one in exchanges if one.took_s is not None)
    if not took:
        return ProbeAnswer("latency_s", question, None, "No response was recorded.")
    longest = took[-1]
    typical = statistics.median(took)
    evidence = f"{len(took)} of {len(exchanges)} requests answered, maximum {longest * 1000:.2f} ms"
    return ProbeAnswer("latency_s", question, round(typical, 6), f"{typical * 1000:.2f} ms (median)", evidence)


def identity(seen: ProbeEvidence) -> ProbeAnswer:
    """Values of 0x50 to 0x53: model, product number, firmware, hardware (4.40 to 4.43)."""
    found = {name: _last(seen, name) for name in ("0x50", "0x51", "0x52", "0x53")}
    shown = ", ".join(f"{name} = {'no value' if raw is None else raw}" for name, raw in found.items())
    return ProbeAnswer("identity", "What are the values of 0x50 to 0x53?", found, shown)


def dummies(seen: ProbeEvidence) -> ProbeAnswer:
    """Which of 0x00 to 0x02 ever read 555,555,555 (4.1 to 4.3)."""
    found = {name: any(raw == DUMMY for _, raw in seen.readings(name)) for name in ("0x00", "0x01", "0x02")}
    reads = sum(len(seen.readings(name)) for name in found)
    names = [name for name, is_one in found.items() if is_one]
    text = f"{', '.join(names)} did." if names else "None did."
    question = "Do inactive commands read 555,555,555?"
    return ProbeAnswer(
        "dummies", question, found if reads else None, text if reads else "Not read.", f"{reads} readings"
    )


def refused_rows(seen: ProbeEvidence) -> ProbeAnswer:
    """Registers without a value: they are in the tables for this model, but not in this servo."""
    reads: dict[str, bool] = {}
    for request, response in seen.exchanges(GetSetRequest):
        if isinstance(request.structure, GetSetRequest) and response is not None:
            name = request.structure.name
            reads[name] = any(raw is not None for _, raw in seen.readings(name)) if name not in reads else reads[name]
    names = sorted(name for name, has in reads.items() if not has)
    text = ", ".join(names) or "None: all registers of this model and firmware have a value."
    return ProbeAnswer("refused_rows", "Which registers have no value?", names if reads else None, text,
                  f"{len(reads)} registers read")  # fmt: skip


def health_of_notifications(seen: ProbeEvidence) -> ProbeAnswer:
    """Health in NodeStatus during a notification without warnings and failures (table 2-18, 4.12)."""
    key, question = "health_of_notifications", "Does a notification alone set the health in NodeStatus to WARNING?"
    words = {name: seen.readings(name) for name in ("0x19", "0x1A", "0x1B")}
    found: list[NodeHealth] = []
    for at, one in seen.node_statuses():
        nearest = [_nearest(readings, at) for readings in words.values()]
        if nearest[0] and nearest[1:] == [0, 0]:
            found.append(one.health)
    if not found:
        why = "No notification was set, or not alone. Move the horn to one of its angle limits and probe again."
        return ProbeAnswer(key, question, None, why, switch=key)
    does = all(health == NodeHealth.WARNING for health in found)
    if len(set(found)) > 1:
        return ProbeAnswer(key, question, None, "Inconsistent: probe again.", f"{len(found)} NodeStatus seen", key)
    text = "Yes." if does else "No: health remains OK."
    return ProbeAnswer(key, question, does, text, f"{len(found)} NodeStatus during a notification", key)


def acknowledges_restart(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether RestartNode is acknowledged before the restart (table 2-10)."""
    return _acknowledged("acknowledges_restart", "Is RestartNode acknowledged?", _restart(seen), "restart")


def restart_time(seen: ProbeEvidence) -> ProbeAnswer:
    """Time from RestartNode to the first NodeStatus after the restart."""
    return _time_away("restart_time_s", "How long does a restart take?", seen, _restart(seen), "restart")


def acknowledges_save(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether the opcode SAVE is acknowledged before the silence of the ROM write (4.11)."""
    return _acknowledged("acknowledges_save", "Is SAVE acknowledged?", _save(seen), "save")


def save_restarts(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether the opcode SAVE restarts the servo (4.11 states this for 0x12)."""
    question = "Does the opcode SAVE restart the servo?"
    save = _save(seen)
    if save is None:
        return ProbeAnswer("save_opcode_restarts", question, None, "No save was made.", switch="save_opcode_restarts")
    again = _next_start(seen, save.request.at)
    helped = [one for one in seen.exchanges(RestartNodeRequest) if save.request.at < one.request.at < (again or 1e18)]
    does = again is not None and not helped
    text = "Yes." if does else "No: it needed a restart request." if again else "No restart was detected."
    return ProbeAnswer("save_opcode_restarts", question, does, text, switch="save_opcode_restarts")


def save_time(seen: ProbeEvidence) -> ProbeAnswer:
    """Time from SAVE to the first NodeStatus after the restart: ROM write and restart."""
    return _time_away("save_time_s", "How long does a save take?", seen, _save(seen), "save")


def soft_start_time(seen: ProbeEvidence) -> ProbeAnswer:
    """Time from the first Status after a start until the horn stops (4.14). The longest in the log."""
    question = "How long does soft start take?"
    unit = position_unit(seen).value
    if not isinstance(unit, str) or unit not in DEGREES:
        return ProbeAnswer("soft_start_time_s", question, None, "Unknown while the position unit is unknown.")
    scale = DEGREES[unit]
    found: list[tuple[float, float]] = []
    for begin in _starts(seen):
        path = [(at, one.position * scale) for at, one in seen.statuses() if begin - 0.5 <= at < begin + 20]
        if len(path) < 2:
            continue
        last = path[-1][1]
        moving = [at for at, angle in path if abs(angle - last) > STILL_DEG]
        if moving:
            found.append((moving[-1] - path[0][0], path[0][1] - last))
    if not found:
        return ProbeAnswer("soft_start_time_s", question, None, "No motion was detected after a restart.")
    took, distance = max(found)
    evidence = f"{abs(distance):.1f}° at {abs(distance) / max(took, 0.05):.0f} °/s, from Status every 100 ms"
    return ProbeAnswer("soft_start_time_s", question, round(took, 2), f"{took:.1f} s", evidence)


def soft_start_shows(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether rows read temporary values during soft start (4.14)."""
    question = "What do the speed and torque limits read during soft start?"
    took = soft_start_time(seen).value
    changed: list[str] = []
    within = 0
    names = [row.name for row in Catalog.load().parameters.values() if row.soft_start is not None]
    starts = _starts(seen) if isinstance(took, float) else []
    for begin in starts:
        for name in names:
            after = [(at - begin, raw) for at, raw in seen.readings(name) if begin <= at < begin + 20]
            during = [raw for at, raw in after if at < float(str(took))]
            within += len(during)
            if during and during[0] != after[-1][1]:
                changed.append(f"{name}: {during[0]}, then {after[-1][1]}")
    if not within:
        why = "None was read during soft start." if took else "No soft start was detected."
        return ProbeAnswer("soft_start_shows", question, None, why, switch="soft_start_shows")
    text = "Temporary values." if changed else "The stored values."
    return ProbeAnswer("soft_start_shows", question, "temporary" if changed else "stored", text, "; ".join(changed),
                  "soft_start_shows")  # fmt: skip


def node_id(seen: ProbeEvidence) -> ProbeAnswer:
    """Whether the servo requested its node ID again after a restart and got the same (table 2-7, 4.38)."""
    question = "Does it keep its node ID after a restart?"
    starts = _starts(seen)
    if not starts:
        return ProbeAnswer("keeps_node_id", question, None, "No restart was made.")
    allocations = [one for one in seen.transfers if isinstance(one.structure, AllocationMessage)]
    requests = [one for one in allocations if not one.transfer.source]
    before = {one.transfer.source for one in seen.transfers if one.at < starts[0]} & seen.nodes
    after = {one.transfer.source for one in seen.transfers if one.at >= starts[0]} & seen.nodes
    same = before == after
    how = "It requested it again" if requests else "It did not request it: the ID is fixed"
    shown = f"{_ids(before)} before, {_ids(after)} after"
    return ProbeAnswer("keeps_node_id", question, same, f"{'Yes' if same else 'No'}: {shown}.",
                  f"{how} ({len(requests)} requests on the bus)")  # fmt: skip


def array_command(seen: ProbeEvidence, servo_id: int, target_deg: float) -> list[ProbeAnswer]:
    """Whether the last ArrayCommand to the servo was executed, and whether 0x00 reads its value (table 2-20, 4.1).

    Only readings before the next write of 0x00 count: the server keeps a command alive by writing it to this register.
    """
    obeyed = ("array_command_obeyed", "Is ArrayCommand executed, in that unit?")
    shows = ("array_command_shows", "Does 0x00 read the value of ArrayCommand?")
    sent = [
        one.at
        for one in seen.transfers
        if isinstance(one.structure, ArrayCommand) and servo_id in {each.actuator_id for each in one.structure.commands}
    ]
    if not sent:
        return [ProbeAnswer(*obeyed, None, "None was sent."), ProbeAnswer(*shows, None, "None was sent.", "", shows[0])]
    after = [one for one in seen.exchanges(GetSetRequest) if one.request.at > sent[-1]]
    written = next((one.request.at for one in after if _writes(one, "0x00")), float("inf"))
    before = [one for one in after if one.request.at < written]
    angles, commands = _values(before, "0x08"), _values(before, "0x00")
    measured = f"commanded {target_deg:.1f}°, measured {angles[-1][1] / 10:.1f}°" if angles else ""
    if any(abs(raw / 10 - target_deg) < STILL_DEG for _, raw in angles):
        first = ProbeAnswer(*obeyed, True, "Yes.", measured)
    elif angles and angles[-1][0] - sent[-1] >= ARRIVAL_S:
        first = ProbeAnswer(*obeyed, False, "No.", measured)
    else:
        first = ProbeAnswer(*obeyed, None, "The angle was not read in time, before 0x00 was written.", measured)
    if not commands:
        return [first, ProbeAnswer(*shows, None, "0x00 was not read before it was written again.", "", shows[0])]
    command = commands[-1][1] / 10
    shown = abs(command - target_deg) < 0.2
    return [first, ProbeAnswer(*shows, shown, "Yes." if shown else "No.", f"it reads {command:.1f}°", shows[0])]


def _writes(exchange: Exchange, name: str) -> bool:
    request = exchange.request.structure
    return isinstance(request, GetSetRequest) and request.name == name and request.value != EMPTY


def _values(exchanges: list[Exchange], name: str) -> list[tuple[Instant, int]]:
    """Values of a register in these exchanges, with the times of the responses."""
    found: list[tuple[Instant, int]] = []
    for request, response in exchanges:
        if isinstance(request.structure, GetSetRequest) and request.structure.name == name and response is not None:
            value = response.structure.value.value if isinstance(response.structure, GetSetResponse) else None
            if isinstance(value, int):
                found.append((response.at, int(value)))
    return found


def _interval(key: str, question: str, times: list[Instant]) -> ProbeAnswer:
    between = [later - sooner for sooner, later in itertools.pairwise(times)]
    if len(between) < 3:
        return ProbeAnswer(key, question, None, "Too few were received.", f"{len(times)} received")
    typical = statistics.median(between)
    evidence = f"{len(times)} received, {min(between) * 1000:.1f} to {max(between) * 1000:.1f} ms apart"
    return ProbeAnswer(key, question, round(typical, 4), f"every {typical * 1000:.1f} ms (median)", evidence)


def _nearest(readings: list[tuple[Instant, int | None]], at: Instant) -> int | None:
    """The reading nearest to `at`. None if none is within NEAR_S."""
    near = min(readings, key=lambda one: abs(one[0] - at), default=None)
    return near[1] if near is not None and abs(near[0] - at) <= NEAR_S else None


def _last(seen: ProbeEvidence, name: str) -> int | None:
    found = seen.readings(name)
    return found[-1][1] if found else None


def _restart(seen: ProbeEvidence) -> Exchange | None:
    return next(iter(seen.exchanges(RestartNodeRequest)), None)


def _save(seen: ProbeEvidence) -> Exchange | None:
    for one in seen.exchanges(ExecuteOpcodeRequest):
        if isinstance(one.request.structure, ExecuteOpcodeRequest) and one.request.structure.opcode == Opcode.SAVE:
            return one
    return None


def _acknowledged(key: str, question: str, exchange: Exchange | None, what: str) -> ProbeAnswer:
    if exchange is None:
        return ProbeAnswer(key, question, None, f"No {what} was made.", switch=key)
    if exchange.response is None or exchange.took_s is None:
        return ProbeAnswer(key, question, False, "No response.", switch=key)
    content = exchange.response.structure
    ok = content.ok if isinstance(content, (RestartNodeResponse, ExecuteOpcodeResponse)) else None
    return ProbeAnswer(key, question, True, f"Yes, ok = {ok}.", f"after {exchange.took_s * 1000:.2f} ms", key)


def _time_away(key: str, question: str, seen: ProbeEvidence, exchange: Exchange | None, what: str) -> ProbeAnswer:
    if exchange is None:
        return ProbeAnswer(key, question, None, f"No {what} was made.")
    again = _next_start(seen, exchange.request.at)
    if again is None:
        return ProbeAnswer(key, question, None, "No NodeStatus with a lower uptime was received.")
    sent = [one.at for one in seen.transfers if one.transfer.source in seen.nodes]
    times = [at for at in sent if exchange.request.at < at < again]
    silent = again - max([*times, exchange.request.at])
    took = again - exchange.request.at
    return ProbeAnswer(key, question, round(took, 3), f"{took * 1000:.0f} ms until its first NodeStatus",
                  f"silent for {silent * 1000:.0f} ms before it")  # fmt: skip


def _starts(seen: ProbeEvidence) -> list[Instant]:
    """Times at which uptime went back: the first NodeStatus after each start."""
    statuses = seen.node_statuses()
    return [
        at for (_, before), (at, now) in itertools.pairwise(statuses) if now.uptime_sec < before.uptime_sec
    ]  # fmt: skip


def _next_start(seen: ProbeEvidence, after: Instant) -> Instant | None:
    return next((at for at in _starts(seen) if at > after), None)


def _ids(nodes: set[int]) -> str:
    return ", ".join(map(str, sorted(nodes))) or "none"


_QUESTIONS: Final[tuple[Callable[[ProbeEvidence], ProbeAnswer], ...]] = (
    position_unit, identity, status_interval, node_status_interval, unused_fields, latency, dummies, refused_rows,
    health_of_notifications, acknowledges_restart, restart_time, soft_start_time, soft_start_shows, node_id,
    acknowledges_save, save_restarts, save_time,
)  # fmt: skip
