"""The requests that remedy a problem or a finding."""

import json
import re
from pathlib import Path

import pytest

from hornbill.api.remedies import REQUESTS, detail, remedy
from hornbill.domain.bus import Finding
from hornbill.errors import BusDisconnected, NeedsConfirmation, TorqueOff, Unknown


def test_a_problem_ends_with_the_request_that_remedies_it() -> None:
    assert detail(BusDisconnected("No bus is connected.", cause="no_bus")) == (
        "No bus is connected. Use: PUT /api/v1/bus."
    )
    assert detail(TorqueOff("Torque is off.", cause="torque_is_off", uid="00ff")) == (
        'Torque is off. Use: POST /api/v1/servos/00ff/torque {"mode": "on"}.'
    )
    assert detail(Unknown("unknown_log", "There is no log.", cause="file_not_found")) == "There is no log."


@pytest.mark.parametrize(
    ("facts", "end"),
    [
        ({"confirm": "turns"}, 'To confirm, repeat the request with confirm: ["turns"].'),
        (
            {"confirm": "turns", "words": ["turns", "far"]},
            'To confirm, repeat the request with confirm: ["turns", "far"].',
        ),
        ({"confirm": "off", "choices": ["on", "off"]}, 'Repeat the request with confirm: ["on"] or ["off"].'),
    ],
)
def test_a_required_confirmation_is_named(facts: dict[str, object], end: str) -> None:
    assert detail(NeedsConfirmation("It turns.", cause=None, **facts)) == f"It turns. {end}"


def test_the_remedy_of_a_finding_ends_with_its_request() -> None:
    found = Finding("allocator_off", "warning", "It waits.", "For 9 s.", "Switch it on.", advice="turn_allocator_on")
    assert remedy(found) == 'Switch it on. Use: PUT /api/v1/bus/allocator {"mode": "on"}.'
    assert remedy(Finding("no_traffic", "ok", "Frames come in", "9 a second.", None)) is None


DOCUMENT = Path(__file__).parents[3] / "schemas/generated/openapi.json"


def test_every_request_is_an_operation_of_the_document() -> None:
    paths = json.loads(DOCUMENT.read_text())["paths"]
    for verb, path in re.findall(r"(GET|PUT|POST|DELETE) (/[\w/{}-]+)", "\n".join(REQUESTS.values())):
        generic = re.sub(r"/parameters/[a-z_]+$", "/parameters/{key}", path)
        assert verb.lower() in paths[generic], path
