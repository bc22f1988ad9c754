"""Parameter files: ArduPilot `.param` (NAME,VALUE) and PX4 `.params` (five columns), written and read."""

from collections.abc import Iterator, Mapping
from typing import Final

from hornbill.autopilot.plan import FIRST_ID, OUTPUTS, Plan, PlanOutput
from hornbill.autopilot.scale import SCALES, STEP_DEG, travel
from hornbill.domain.autopilot import Program
from hornbill.errors import InvalidValue

INT32: Final = 6
"""Type of an integer in a PX4 file (MAV_PARAM_TYPE_INT32)."""

_ARDUPILOT_DEFAULT: Final = (1100, 1900, 1500)
"""SERVOn_MIN, SERVOn_MAX and SERVOn_TRIM of ArduPilot: ±144°."""
_PX4_DEFAULT: Final = (0, 1000)
"""UAVCAN_SV_MINn and UAVCAN_SV_MAXn of PX4: ±180°."""
_LONGEST: Final = 2_000_000
_PX4_COLUMNS: Final = 5


def write(plan: Plan) -> str:
    """The parameter file of a checked plan, with comments."""
    return "\n".join((*_ardupilot(plan),) if plan.program == "ardupilot" else (*_px4(plan),)) + "\n"


def _comment(output: PlanOutput, program: Program) -> str:
    scale, found = SCALES[program], travel(program, output)
    ends = f"{scale.degrees(found.low):+.1f}° to {scale.degrees(found.high):+.1f}°"
    name = f", {output.label}" if output.label else ""
    return f"# Output {output.output}: servo ID {output.servo_id}{name}, {ends}"


def _ardupilot(plan: Plan) -> Iterator[str]:
    yield "# Servos on DroneCAN, for ArduPilot. Written by hornbill."
    yield "# 1 µs is 0.36°: the servo is commanded as UNITLESS, (µs - 1500) / 500 of 180°."
    yield "CAN_P1_DRIVER,1"
    yield "CAN_D1_PROTOCOL,1"
    yield f"CAN_D1_UC_SRV_BM,{sum(1 << one.output - 1 for one in plan.outputs)}"
    yield f"CAN_D1_UC_SRV_RT,{plan.rate_hz}"
    for one in sorted(plan.outputs, key=lambda output: output.output):
        found, name = travel("ardupilot", one), f"SERVO{one.output}"
        yield _comment(one, "ardupilot")
        if one.function is not None:
            yield f"{name}_FUNCTION,{one.function}"
        yield f"{name}_MIN,{found.low}"
        yield f"{name}_MAX,{found.high}"
        yield f"{name}_TRIM,{found.neutral}"
        yield f"{name}_REVERSED,{int(one.reversed)}"


def _px4(plan: Plan) -> Iterator[str]:
    def row(name: str, value: int) -> str:
        return f"1\t1\t{name}\t{value}\t{INT32}"

    yield "# Servos on DroneCAN, for PX4. Written by hornbill."
    yield "# One unit is 0.36°: the servo is commanded as UNITLESS, (output - 500) / 500 of 180°."
    yield "# PX4 numbers actuators from 0: output 1 commands servo ID 0."
    yield row("UAVCAN_ENABLE", 3)
    yield row("UAVCAN_SV_REV", sum(1 << one.output - 1 for one in plan.outputs if one.reversed))
    for one in sorted(plan.outputs, key=lambda output: output.output):
        found, n = travel("px4", one), one.output
        yield _comment(one, "px4")
        if one.function is not None:
            yield row(f"UAVCAN_SV_FUNC{n}", one.function)
        yield row(f"UAVCAN_SV_MIN{n}", found.low)
        yield row(f"UAVCAN_SV_MAX{n}", found.high)
        yield row(f"UAVCAN_SV_DIS{n}", found.neutral)
        yield row(f"UAVCAN_SV_FAIL{n}", found.neutral)


def read(text: str, program: Program) -> Plan:
    """The plan of a parameter file of the autopilot. Parameters that do not concern servos are skipped.

    Raises InvalidValue with the line that cannot be read, or if no output is on DroneCAN.
    """
    if len(text) > _LONGEST:
        raise InvalidValue(
            f"The file has {len(text)} characters; at most {_LONGEST} are read.", cause="parameter_file_too_long"
        )
    found = dict(_lines(text, program))
    outputs = _from_ardupilot(found) if program == "ardupilot" else _from_px4(found)
    if not outputs:
        which = "CAN_D1_UC_SRV_BM is 0 or missing" if program == "ardupilot" else "no UAVCAN_SV_FUNCn is set"
        raise InvalidValue(f"No output is on DroneCAN: {which}.", cause="parameter_file_no_output", which=which)
    return Plan(program=program, outputs=outputs, rate_hz=max(1, min(200, round(found.get("CAN_D1_UC_SRV_RT", 50)))))


def _lines(text: str, program: Program) -> Iterator[tuple[str, float]]:
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split("#", 1)[0].replace(",", " ").split()
        if not words:
            continue
        pair = words[2:4] if program == "px4" and len(words) == _PX4_COLUMNS else words
        try:
            name, value = pair[0], float(pair[1])
            if len(pair) > 2 or not abs(value) < 1e9:
                raise ValueError
        except (IndexError, ValueError):
            raise InvalidValue(
                f"Line {number} is not a parameter: {line.strip()[:60]!r}.",
                cause="parameter_file_line", line=number, text=line.strip()[:60],
            ) from None  # fmt: skip
        yield name.upper(), value


def _output(program: Program, n: int, low: float, high: float, neutral: float, **more: int | bool | None) -> PlanOutput:
    middle = SCALES[program].middle

    def degrees(number: float) -> float:
        return round(max(-180.0, min(180.0, (number - middle) * STEP_DEG)), 2)

    return PlanOutput.model_validate(
        {
            "output": n, "servo_id": n - 1 + FIRST_ID[program], "low_deg": degrees(low), "high_deg": degrees(high),
            "neutral_deg": degrees(neutral), **more,
        }
    )  # fmt: skip


def _from_ardupilot(found: Mapping[str, float]) -> list[PlanOutput]:
    mask = int(found.get("CAN_D1_UC_SRV_BM", 0))
    outputs: list[PlanOutput] = []
    for n in range(1, OUTPUTS["ardupilot"] + 1):
        if not mask >> n - 1 & 1:
            continue
        low, high, trim = (
            found.get(f"SERVO{n}_{key}", usual)
            for key, usual in zip(("MIN", "MAX", "TRIM"), _ARDUPILOT_DEFAULT, strict=True)
        )
        function = found.get(f"SERVO{n}_FUNCTION")
        outputs.append(
            _output(
                "ardupilot", n, low, high, trim, reversed=found.get(f"SERVO{n}_REVERSED", 0) == 1,
                function=None if function is None else int(function),
            )
        )  # fmt: skip
    return outputs


def _from_px4(found: Mapping[str, float]) -> list[PlanOutput]:
    mask = int(found.get("UAVCAN_SV_REV", 0))
    outputs: list[PlanOutput] = []
    for n in range(1, OUTPUTS["px4"] + 1):
        function = int(found.get(f"UAVCAN_SV_FUNC{n}", 0))
        ends = [found.get(f"UAVCAN_SV_{key}{n}") for key in ("MIN", "MAX")]
        if not function and ends == [None, None]:
            continue
        low, high = (usual if end is None else end for end, usual in zip(ends, _PX4_DEFAULT, strict=True))
        middle = (low + high) / 2
        outputs.append(
            _output("px4", n, low, high, middle, reversed=bool(mask >> n - 1 & 1), function=function or None)
        )
    return outputs
