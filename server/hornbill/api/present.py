"""Conversion of servo-layer objects into domain models."""

import asyncio
import math
from typing import Any, Final, Literal

from pydantic import TypeAdapter

from hornbill.api.problems import problem
from hornbill.domain.bus import AdapterNote, AllocatorState, Bus, PendingAllocation, SerialLine
from hornbill.domain.job import Job, JobStep
from hornbill.domain.motion import (
    Lease,
    LeaseView,
    OutputRestorePreview,
    PendingRequest,
    RestorableOutput,
    Stop,
    StopNode,
    StopServo,
    TakeOverState,
)
from hornbill.domain.plan import PlanPreview, PlanServo, RunPlan
from hornbill.domain.servo import (
    Activity,
    Commander,
    FaultWords,
    LostValue,
    Output,
    PositionUnitState,
    Reading,
    TreatedAs,
)
from hornbill.domain.servo import Servo as ServoFacts
from hornbill.node.directory import Directory
from hornbill.schema.scale import to_value
from hornbill.servo.device.reading import reading
from hornbill.servo.device.servo import Servo
from hornbill.servo.host import Connection, Host
from hornbill.servo.monitoring.commanders import CommandStream
from hornbill.servo.motion.motion_control import TakeOverRequest
from hornbill.servo.runs.plans import PlanProspect
from hornbill.servo.runs.restore_output import Prospect
from hornbill.servo.runtime.jobs import RunningJob
from hornbill.servo.runtime.leases import HeldLease
from hornbill.units import Uid
from hornbill.virtual_time import speed_of
from hornbill.wire.messages import CommandType
from hornbill.wire.port import NO_PORT, CanPort, NoPort, PortState

COMMAND_TYPES: Final[dict[int, Any]] = {kind: kind.name.lower() for kind in CommandType}
"""Names of the command types of ArrayCommand (table 2-21)."""

_READING: Final = TypeAdapter(Reading)

FULL_FRAME_BITS = 140
"""Bits of an extended frame with 8 data bytes: 131 plus typical stuffing."""


def servo(host: Host, one: Servo) -> ServoFacts:
    """Servo with current ages."""
    now = host.base.now()
    model, status = one.model, one.status
    row = one.registers.get("command_angle")
    command = None
    if row is not None and row.raw is not None:
        value = to_value(row.parameter, row.raw)
        command = float(value) if isinstance(value, int | float) else None
    return ServoFacts(
        uid=one.uid,
        node_id=one.node_id,
        servo_id=one.servo_id,
        label=one.label,
        name=one.name,
        model=model.name if model else None,
        model_number=one.model_number,
        series=model.series if model else None,
        pwm=model.pwm if model else None,
        firmware=one.firmware_text,
        hardware_version=one.hardware_version,
        serial=one.serial,
        production_date=one.production_date,
        known_model=model is not None,
        treated_as=TreatedAs(model=one.treated_as[0], firmware=one.treated_as[1]),
        firmware_note=host.catalog.note_on(model, one.firmware),
        online=one.online,
        state=one.state.value,
        health=one.health.name.lower() if one.health is not None else None,  # pyright: ignore[reportArgumentType]
        mode=one.mode,
        uptime_s=status.uptime_sec if status else None,
        angle_deg=one.angle_deg,
        command_deg=command,
        age_s=None if one.angle_at is None else round(now - one.angle_at, 3),
        position_unit=position_unit(host, one),
        output=output(host, one),
        activity=activity(host, one),
        unsaved=one.unsaved(),
        drift=list(one.drift),
        commanded_by=commanders(host, one.uid, one.angle_deg),
        lost=[LostValue(key=key, value=value, at=at) for key, value, at in host.lost_values.shown(one)],
        owed=one.owed,
        faults=FaultWords(
            notification=one.raw("fault_notification"),
            warning=one.raw("fault_warning"),
            failure=one.raw("fault_failure"),
        ),
        unacknowledged=host.faults.unacknowledged(one.uid),
        bus=host.connection.port.address if host.connection and one.online else None,
    )


def reading_json(host: Host, one: Servo, key: str) -> bytes:
    """JSON of the reading of one row."""
    return _READING.dump_json(reading(one, key, host.base))


def output(host: Host, one: Servo) -> Output:
    """Output of the motor, and its reason."""
    found = one.output_state
    since = None if found.since is None else host.base.utc(found.since)
    return Output(state=found.state, reason=found.reason, by=found.by, since=since)


def output_restore(host: Host, found: list[Prospect]) -> OutputRestorePreview:
    """Effect of restoring outputs, servo by servo."""
    servos = [
        RestorableOutput(
            uid=one.servo.uid, title=one.servo.title, output=output(host, one.servo),
            torque_pct=one.servo.raw("current_torque"), under_load=one.under_load, needs_lease=one.needs_lease,
            problem=None if one.problem is None else problem(one.problem),
        )
        for one in found
    ]  # fmt: skip
    return OutputRestorePreview(clears_stop=host.stop.latched, servos=servos)


def plan(wanted: RunPlan, found: list[PlanProspect]) -> PlanPreview:
    """Result of the dry run of a test plan."""
    servos = [
        PlanServo(
            uid=one.servo.uid, title=one.servo.title, cautions=list(one.cautions),
            problem=None if one.problem is None else problem(one.problem),
        )
        for one in found
    ]  # fmt: skip
    least = sum(0.0 if one.do == "move" else one.for_s for one in wanted.steps)
    return PlanPreview(
        name=wanted.name, cycles=wanted.cycles, steps=len(wanted.steps), least_s=least * wanted.cycles,
        servos=servos, plan=wanted.model_dump(mode="json"),
    )  # fmt: skip


def activity(host: Host, one: Servo) -> Activity:
    """Current activity of motor and horn."""
    found = host.activities.of(one)
    return Activity(
        state=found.doing,
        since=host.base.utc(found.since),
        peak_to_peak_deg=found.peak_to_peak_deg,
        oscillation_hz=None if found.rate_hz is None else round(found.rate_hz, 1),
        torque_pct=found.torque_pct,
        torque_limit_pct=found.torque_limit_pct,
    )


def position_unit(host: Host, one: Servo) -> PositionUnitState:
    """Position unit and its evidence."""
    estimate = one.position_unit
    evidence = host.position_units.evidence(one)
    return PositionUnitState(
        unit=estimate.unit, state=estimate.state,
        evidence=evidence.text, evidence_code=evidence.code, evidence_params=evidence.params,
    )  # fmt: skip


def job(one: RunningJob) -> Job:
    """Job with its steps; a failed job includes its problem."""
    return Job(
        id=one.id,
        kind=one.kind,  # pyright: ignore[reportArgumentType]
        uid=one.uid,
        state=one.state,  # pyright: ignore[reportArgumentType]
        progress=one.progress,
        step=one.step,
        result=one.result,
        error=None if one.error is None else problem(one.error),
        steps=[JobStep.model_validate(step) for step in one.steps],
        created_at=one.created_at,
        ended_at=one.ended_at,
        resumable=one.resumable,
    )


def lease(host: Host, one: HeldLease) -> Lease:
    """Lease with its secret ID, for the holder."""
    every_s = one.ttl_s / 3 / speed_of(asyncio.get_running_loop())
    return Lease(id=one.id, heartbeat_s=every_s, **lease_view(host, one).model_dump())


def lease_view(host: Host, one: HeldLease) -> LeaseView:
    """Lease as visible to all clients."""
    request = host.motion_control.waiting
    return LeaseView(
        shown_id=one.shown_id,
        holder=one.holder,
        uids=None if one.uids is None else sorted(one.uids),
        ttl_s=one.ttl_s,
        expires_at=host.base.utc(one.expires_at),
        expires_in_s=_left(host, one.expires_at),
        request=None
        if request is None or not one.overlaps(request.uids)
        else PendingRequest(
            id=request.shown_id, by=request.by, reason=request.reason, expires_in_s=_left(host, request.due)
        ),
    )


def take_over(host: Host, one: TakeOverRequest) -> TakeOverState:
    """Request for motion control, as visible to the client that made it."""
    now = host.base.now()
    current = host.leases.current(now, one.uids)
    live = one.lease is not None and one.lease is current
    return TakeOverState(
        id=one.id,
        by=one.by,
        reason=one.reason,
        state=one.state,
        expires_in_s=_left(host, one.due) if one.state == "waiting" else 0.0,
        lease_id=one.lease.id if live and one.lease is not None else None,
        holder=None if current is None or live else lease_view(host, current),
    )


def _left(host: Host, at: float) -> float:
    return round(max(0.0, at - host.base.now()), 3)


def stop(host: Host) -> Stop:
    """The stop latch."""
    latch = host.stop.latch
    if latch is None:
        return Stop(
            latched=False, mode=None, at=None, by=None, reason=None, servos=[], nodes=[], reach=host.stop.reach,
            reaches=[*host.stop.reached()],
        )  # fmt: skip
    return Stop(
        latched=True,
        mode=latch.mode,  # pyright: ignore[reportArgumentType]
        at=host.base.utc(latch.at),
        by=latch.by,
        reason=latch.reason,
        servos=[StopServo.model_validate(one) for one in latch.servos.values()],
        nodes=[StopNode.model_validate(one) for one in latch.nodes.values()],
        reach=host.stop.reach,
        reaches=[*host.stop.reached()],
    )


def commanders(host: Host, which: Uid | int, angle_deg: float | None) -> list[Commander]:
    """Other nodes that command a servo, or an unidentified actuator by its node ID, now. `angle_deg`: its angle."""
    now, found = host.base.now(), host.commanders.of(which)
    directory = None if host.connection is None else host.connection.directory
    return [_commander(host, directory, stream, angle_deg, now) for stream in found]


def _commander(
    host: Host, directory: Directory | None, stream: CommandStream, angle: float | None, now: float
) -> Commander:
    record = None if directory is None else directory.records.get(stream.node_id)
    degrees, rate = stream.degrees, stream.rate_hz
    return Commander(
        node_id=stream.node_id,
        name=None if record is None or record.info is None else record.info.name,
        type=COMMAND_TYPES.get(int(stream.command_type), "unknown"),
        value=stream.value if math.isfinite(stream.value) else None,
        command_deg=degrees,
        error_deg=None if angle is None or degrees is None else round(degrees - angle, 2),
        rate_hz=None if rate is None else round(rate, 1),
        since=host.base.utc(stream.since),
        age_s=round(now - stream.at, 3),
    )


def bus(host: Host) -> Bus:
    """Bus and its counters; state disconnected if there is none."""
    connection = host.connection
    port = NO_PORT if connection is None else connection.port
    seen = port.statistics
    reason = None if connection is None else connection.role_reason
    return Bus(
        state=port.state.value,
        address=port.address or None,
        bitrate=port.bitrate or None,
        role=None if connection is None else connection.role.value,
        role_reason=None if reason is None else reason.text,
        role_reason_params={} if reason is None else dict(reason.params),
        listen_only=None if connection is None else port.details.listen_only,
        sample_point=port.sample_point,
        trouble=None if port.trouble is None else port.trouble.detail,
        trouble_params={} if port.trouble is None else port.trouble.note_params,
        trouble_code=_trouble_code(port),
        notes=[AdapterNote.model_validate(one) for one in port.details.notes],
        serial_line=None if connection is None else _serial_line(connection),
        limited_by=None if connection is None else _limited_by(connection.port),
        frame_gap_ms=round(port.details.frame_gap_s * 1000, 3),
        retry_in_s=port.retry_in_s,
        reopened=seen.reopened,
        load_pct=None if connection is None else round(connection.load_pct, 2),
        load_cap_pct=round(host.polling.cap * 100, 2),
        rx_fps=0.0 if connection is None else round(connection.rx_fps, 1),
        tx_fps=0.0 if connection is None else round(connection.tx_fps, 1),
        rx_frames=seen.rx_frames,
        tx_frames=seen.tx_frames,
        rx_dropped=seen.rx_dropped,
        errors=seen.errors,
        error_frames=seen.error_frames,
        unacknowledged=seen.unacknowledged,
        ignored=seen.ignored,
        bus_offs=seen.bus_offs,
        allocator=None if connection is None else allocator(host),
    )


def _trouble_code(port: CanPort | NoPort) -> Any:
    if port.trouble is None:
        return None
    match port.state:
        case PortState.PASSIVE:
            return "nothing_received" if port.details.nothing_received else "error_passive"
        case PortState.BUS_OFF:
            return "bus_off"
        case PortState.ACTIVE:
            return "recording_over"
        case _:
            return "adapter_lost"


def _serial_line(connection: Connection) -> SerialLine | None:
    line, used = connection.port.details.serial_line, connection.line_pct
    if line is None:
        return None
    return SerialLine(
        baud=line.baud,
        budget=line.budget,
        load_pct=None if used is None else round(used, 1),
        found=line.found,
        confirmed=line.confirmed,
        serial_number=line.serial_number,
        latency_ms=line.latency_ms,
    )


def _limited_by(port: CanPort) -> Literal["can", "serial_line"]:
    """The slower of CAN bus and serial line, for frames of FULL_FRAME_BITS."""
    line = port.details.serial_line
    if line is None or line.budget is None:
        return "can"
    return "serial_line" if line.budget < port.bitrate / FULL_FRAME_BITS else "can"


def allocator(host: Host) -> AllocatorState:
    """State of the node ID allocator; without a bus, the state it would have."""
    one, now = host.allocating.allocator, host.base.now()
    return AllocatorState(
        state=one.state.value if host.allocating.serving else "off",
        mode=one.mode.value,
        granted=len(host.store.allocations.entries()),
        pending=len(one.pending(now)),
        free=one.free(now),
        competing_node_id=None if one.competitor is None else one.competitor.node_id,
        own_id_shared=one.own_id_shared,
    )


def pending(host: Host) -> list[PendingAllocation]:
    """Nodes that request a node ID and have none yet, longest waiting first."""
    now = host.base.now()
    return [
        PendingAllocation(
            uid_part=one.partial,
            stage=one.stage,
            attempts=one.attempts,
            waiting_s=round(now - one.first_seen, 2),
            age_s=round(now - one.last_seen, 2),
            refusal=one.refusal,
            refusal_code=None if one.refused is None else one.refused.code,
            refusal_params={} if one.refused is None else dict(one.refused.params),
        )
        for one in host.allocating.allocator.pending(now)
    ]
