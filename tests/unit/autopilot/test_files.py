"""Parameter files: from wanted ends through the formula of the autopilot and the wire to the simulated servo."""

import struct
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hornbill.autopilot.advice import OutputFacts, advice
from hornbill.autopilot.files import read, write
from hornbill.autopilot.plan import FIRST_ID, Plan, PlanOutput, Program, check
from hornbill.autopilot.scale import STEP_DEG
from hornbill.errors import HornbillError, InvalidValue, OutOfRange
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType

PROGRAMS: tuple[Program, ...] = ("ardupilot", "px4")


def plan_of(program: Program, **output: object) -> Plan:
    n = int(str(output.pop("output", 1)))
    given = {"output": n, "servo_id": n - 1 + FIRST_ID[program], "low_deg": -30, "high_deg": 25, **output}
    return Plan.model_validate({"program": program, "outputs": [given]})


def parameters(text: str) -> dict[str, int]:
    """As the autopilot loads them, without the reader under test."""
    found: dict[str, int] = {}
    for line in text.splitlines():
        if not line.startswith("#"):
            words = line.split("\t")[2:4] if "\t" in line else line.split(",")
            found[words[0]] = int(words[1])
    return found


def sent(program: Program, found: dict[str, int], n: int, demand: float) -> float:
    """The value that the autopilot sends for a demand of −1 to +1."""
    if program == "ardupilot":
        low, high, trim = (found[f"SERVO{n}_{key}"] for key in ("MIN", "MAX", "TRIM"))
        demand = -demand if found[f"SERVO{n}_REVERSED"] else demand
        us = trim + demand * (high - trim if demand > 0 else trim - low)
        value = (int(us) - 1000) / 500 - 1
    else:
        low, high = found[f"UAVCAN_SV_MIN{n}"], found[f"UAVCAN_SV_MAX{n}"]
        demand = -demand if found["UAVCAN_SV_REV"] >> n - 1 & 1 else demand
        value = round(low + (demand + 1) / 2 * (high - low)) / 500 - 1
    half: float = struct.unpack("<e", struct.pack("<e", value))[0]
    return half


@pytest.mark.parametrize("program", PROGRAMS)
def test_each_end_of_5000_fits_is_reached_within_one_step_and_never_exceeded(program: Program) -> None:
    random = Random(1)
    for _ in range(5000):
        low = random.randrange(-1800, 1780) / 10
        high = random.randrange(round(low * 10) + 20, 1801) / 10
        neutral, reverse, n = low + random.uniform(0.2, 0.8) * (high - low), random.random() < 0.5, random.randint(1, 8)
        plan = plan_of(program, output=n, low_deg=low, high_deg=high, neutral_deg=neutral, reversed=reverse)
        found = parameters(write(plan))
        first, last = (round(sent(program, found, n, demand) * 1800) / 10 for demand in (-1.0, 1.0))
        first, last = (last, first) if reverse else (first, last)
        assert low - 1e-6 <= first <= low + STEP_DEG + 0.05, plan
        assert high - STEP_DEG - 0.05 <= last <= high + 1e-6, plan


@pytest.mark.parametrize("program", PROGRAMS)
def test_the_simulated_servo_takes_the_exported_ends(program: Program) -> None:
    plan = plan_of(program, output=3, low_deg=-33.3, high_deg=21.7, neutral_deg=1.0)
    found = parameters(write(plan))
    for demand, wanted in ((-1.0, -33.3), (1.0, 21.7)):
        message = ArrayCommand(
            [ActuatorCommand(plan.outputs[0].servo_id, CommandType.UNITLESS, sent(program, found, 3, demand))]
        )
        wire = ArrayCommand.decode(message.encode())
        assert wire is not None
        held = round(wire.commands[0].command_value * 1800) / 10
        assert abs(held - wanted) <= STEP_DEG


@settings(max_examples=300, deadline=None)
@given(program=st.sampled_from(PROGRAMS), reversed_=st.booleans(), low=st.integers(-170, -5), high=st.integers(5, 170))
def test_a_written_file_is_read_back(program: Program, reversed_: bool, low: int, high: int) -> None:
    plan = plan_of(program, output=2, low_deg=low, high_deg=high, reversed=reversed_, function=4)
    (output,) = read(write(plan), program).outputs
    assert (output.output, output.reversed, output.function) == (2, reversed_, 4)
    assert output.low_deg == pytest.approx(low, abs=STEP_DEG)
    assert output.high_deg == pytest.approx(high, abs=STEP_DEG)


def test_missing_parameters_are_the_defaults_of_the_autopilot() -> None:
    (output,) = read("CAN_D1_UC_SRV_BM,4\n", "ardupilot").outputs
    assert (output.output, output.servo_id, output.low_deg, output.high_deg) == (3, 3, -144, 144)
    (output,) = read("1 1 UAVCAN_SV_FUNC2 202 6\n", "px4").outputs
    assert (output.output, output.servo_id, output.low_deg, output.high_deg) == (2, 1, -180, 180)


@pytest.mark.parametrize(
    ("text", "program", "part"),
    [
        ("CAN_D1_UC_SRV_BM", "ardupilot", "Line 1"),
        ("# comment\nSERVO1_MIN,many\n", "ardupilot", "Line 2"),
        ("SERVO1_MIN,1,2\n", "ardupilot", "Line 1"),
        ("SERVO1_MIN,nan\n", "ardupilot", "Line 1"),
        ("", "ardupilot", "No output"),
        ("1\t1\tUAVCAN_ENABLE\t3\t6\n", "px4", "No output"),
        ("x" * 2_000_001, "px4", "characters"),
    ],
)
def test_a_bad_file_is_refused_with_its_line(text: str, program: Program, part: str) -> None:
    with pytest.raises(InvalidValue, match=part):
        read(text, program)


@pytest.mark.parametrize(
    ("program", "output", "limits", "error", "part"),
    [
        ("ardupilot", {"servo_id": 5}, {}, InvalidValue, "commands servo ID 1, but its servo has 5"),
        ("px4", {"servo_id": 1}, {}, InvalidValue, "commands servo ID 0"),
        ("px4", {"output": 9, "servo_id": 8}, {}, OutOfRange, "1 to 8"),
        ("ardupilot", {"neutral_deg": 40}, {}, InvalidValue, "neutral 40°"),
        ("ardupilot", {"low_deg": 30, "high_deg": 30}, {}, InvalidValue, "30°"),
        ("ardupilot", {}, {1: (-20.0, 90.0)}, OutOfRange, "-30° is beyond the angle limit"),
        ("ardupilot", {}, {1: (-90.0, 20.0)}, OutOfRange, "25° is beyond the angle limit"),
    ],
)
def test_a_plan_that_no_linkage_could_take_is_refused_with_the_number(
    program: Program,
    output: dict[str, object],
    limits: dict[int, tuple[float | None, float | None]],
    error: type[HornbillError],
    part: str,
) -> None:
    with pytest.raises(error, match=part):
        check(plan_of(program, **output), limits)


def test_an_output_listed_twice_is_refused() -> None:
    one = PlanOutput(output=1, servo_id=1, low_deg=-10, high_deg=10)
    with pytest.raises(InvalidValue, match="listed twice"):
        check(Plan(program="ardupilot", outputs=[one, one]), {})


@pytest.mark.parametrize(
    ("program", "output", "facts", "codes"),
    [
        ("px4", {}, OutputFacts(), {"servo_id_zero"}),
        ("px4", {"output": 10, "servo_id": 9}, OutputFacts(), {"status_not_received"}),
        (
            "ardupilot",
            {"low_deg": -144, "high_deg": 144},
            OutputFacts(low_deg=-45, high_deg=45),
            {"throw_beyond_limits"},
        ),
        ("ardupilot", {}, OutputFacts(deadband_deg=0.3), {"step_above_deadband"}),
        ("ardupilot", {}, OutputFacts(deadband_deg=0.4), set[str]()),
        ("ardupilot", {}, OutputFacts(timeout_action=1, timeout_s=1.0), {"silent_when_unarmed"}),
        ("ardupilot", {}, OutputFacts(timeout_action=0, timeout_s=1.0), set[str]()),
        ("px4", {"output": 2}, OutputFacts(timeout_action=1, timeout_s=1.0), set[str]()),
        ("ardupilot", {}, OutputFacts(fixed_node_id=20), {"node_id_dynamic_range"}),
    ],
)
def test_advice(program: Program, output: dict[str, object], facts: OutputFacts, codes: set[str]) -> None:
    plan = plan_of(program, **output)
    found = {one.code for one in advice(plan, {plan.outputs[0].servo_id: facts})}
    assert found == codes | {"position_in_log"}
