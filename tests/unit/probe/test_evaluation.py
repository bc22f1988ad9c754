"""What a recording tells of a servo, judged from transfers that are written down here."""

import pytest

from hornbill.probe.evaluation import health_of_notifications
from hornbill.probe.evidence import Observed, ProbeEvidence
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, integer
from hornbill.wire.transfer import Transfer

HOST, SERVO = 127, 11
WORDS = ("0x19", "0x1A", "0x1B")


def status(at: float, health: NodeHealth) -> Observed:
    told = NodeStatus(5, health, Mode.OPERATIONAL)
    return Observed(Transfer(Kind.MESSAGE, told.TYPE.id, SERVO, 0, 16, 0, b"", at), told)


def read(at: float, name: str, raw: int) -> list[Observed]:
    request, answer = GetSetRequest(0, EMPTY, name), GetSetResponse(integer(raw), EMPTY, EMPTY, EMPTY, name)
    return [
        Observed(Transfer(Kind.REQUEST, request.TYPE.id, HOST, SERVO, 24, 3, b"", at), request),
        Observed(Transfer(Kind.RESPONSE, answer.TYPE.id, SERVO, HOST, 24, 3, b"", at + 0.001), answer),
    ]


def recording(words: tuple[int, int, int], *health: NodeHealth) -> ProbeEvidence:
    """Fault words that read these, and NodeStatus around them."""
    told = [one for at, (name, raw) in enumerate(zip(WORDS, words, strict=True)) for one in read(at / 100, name, raw)]
    told += [status(0.5 + at, one) for at, one in enumerate(health)]
    return ProbeEvidence(told, frozenset({SERVO}))


@pytest.mark.parametrize(
    ("words", "health", "answer"),
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
def test_health_beside_a_notification_alone(
    words: tuple[int, int, int], health: tuple[NodeHealth, ...], answer: bool | None
) -> None:
    found = health_of_notifications(recording(words, *health))
    assert (found.value, found.switch) == (answer, "health_of_notifications")
