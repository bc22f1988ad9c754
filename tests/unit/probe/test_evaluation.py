"""Results of a probe, derived from given recordings."""

import pytest

from hornbill.probe.evaluation import array_command, health_of_notifications
from hornbill.probe.evidence import Observed, ProbeEvidence
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType, Mode, NodeHealth, NodeStatus
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, Value, integer
from hornbill.wire.transfer import Transfer

HOST, SERVO = 127, 11
WORDS = ("0x19", "0x1A", "0x1B")


def status(at: float, health: NodeHealth) -> Observed:
    message = NodeStatus(5, health, Mode.OPERATIONAL)
    return Observed(Transfer(Kind.MESSAGE, message.TYPE.id, SERVO, 0, 16, 0, b"", at), message)


def read(at: float, name: str, raw: int, *, write: Value = EMPTY) -> list[Observed]:
    request, response = GetSetRequest(0, write, name), GetSetResponse(integer(raw), EMPTY, EMPTY, EMPTY, name)
    return [
        Observed(Transfer(Kind.REQUEST, request.TYPE.id, HOST, SERVO, 24, 3, b"", at), request),
        Observed(Transfer(Kind.RESPONSE, response.TYPE.id, SERVO, HOST, 24, 3, b"", at + 0.001), response),
    ]


def recording(words: tuple[int, int, int], *health: NodeHealth) -> ProbeEvidence:
    """Readings of the fault words, and NodeStatus around them."""
    seen = [one for at, (name, raw) in enumerate(zip(WORDS, words, strict=True)) for one in read(at / 100, name, raw)]
    seen += [status(0.5 + at, one) for at, one in enumerate(health)]
    return ProbeEvidence(seen, frozenset({SERVO}))


@pytest.mark.parametrize(
    ("words", "health", "response"),
    [
        ((1 << 8, 0, 0), (NodeHealth.OK, NodeHealth.OK), False),
        ((1 << 8, 0, 0), (NodeHealth.WARNING,), True),
        ((1 << 8, 0, 0), (NodeHealth.WARNING, NodeHealth.OK), None),
        ((0, 0, 0), (NodeHealth.OK,), None),
        ((1 << 8, 1 << 4, 0), (NodeHealth.WARNING,), None),
        ((1 << 8, 0, 1), (NodeHealth.ERROR,), None),
        ((1 << 8, 0, 0), (), None),
    ],
)
def test_health_during_a_notification_alone(
    words: tuple[int, int, int], health: tuple[NodeHealth, ...], response: bool | None
) -> None:
    found = health_of_notifications(recording(words, *health))
    assert (found.value, found.switch) == (response, "health_of_notifications")


@pytest.mark.parametrize(
    ("readings", "obeyed", "shows"),
    [
        ([(0.01, "0x00", 250), (0.02, "0x08", 240), (0.25, "0x08", 200)], True, False),
        ([(0.01, "0x00", 200), (0.02, "0x08", 240), (0.25, "0x08", 250)], False, True),
        ([(0.01, "0x00", 250), (0.1, "0x08", 250), (0.3, "0x00", 200)], None, True),
        ([], None, None),
    ],
)
def test_array_command_is_judged_before_the_keep_alive_writes_0x00(
    readings: list[tuple[float, str, int]], obeyed: bool | None, shows: bool | None
) -> None:
    message = ArrayCommand((ActuatorCommand(7, CommandType.POSITION, 0.2),))
    seen = read(0.9, "0x00", 250) + read(0.95, "0x08", 200)
    seen.append(Observed(Transfer(Kind.MESSAGE, message.TYPE.id, HOST, 0, 16, 0, b"", 1.0), message))
    for at, name, raw in readings:
        seen += read(1.0 + at, name, raw)
    seen += read(1.333, "0x00", 200, write=integer(200)) + read(1.5, "0x00", 200) + read(1.6, "0x08", 200)
    evidence = ProbeEvidence(seen, frozenset({SERVO}))
    assert [one.value for one in array_command(evidence, 7, 20.0)] == [obeyed, shows]
    assert [one.value for one in array_command(evidence, 8, 20.0)] == [None, None], "for another servo"
