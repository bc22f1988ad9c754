"""Whatever the document lets be sent, and much that it does not, a running demo answers as the document says."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from schemathesis import Case, GenerationMode
from schemathesis.openapi import from_dict
from schemathesis.specs.openapi import checks

from e2e.servers import Server, running

CHECKS: Any = [
    checks.status_code_conformance, checks.content_type_conformance, checks.response_schema_conformance,
]  # fmt: skip

LEFT_OUT = {
    "stop": "it latches: every motion after it is 423, and none of the other answers would be seen",
    "connect_bus": "it would take the bus away from everything after it",
    "disconnect_bus": "it would take the bus away from everything after it",
    "create_token": "from the first token on everybody needs one: 401 for everything after it",
    "stream_events": "it does not end by itself",
    "diagnose_bus": "it listens for some seconds",
    "create_recording": "it waits ten seconds for what happens next",
    "import_recording": "it takes a file of its own form, which is not made from a schema",
    "remove_sim_servo": "the servo of everything after it would be gone",
    "forget_servo": "the servo of everything after it would be gone",
}
MEANT = ("interrupted", "store_failed", "log_failed")
"""Codes of 500 that tell of a failed disk or a server that ended; any other 500 is a defect."""


@pytest.fixture
def server() -> Iterator[Server]:
    """A demo of two servos, a new one for each run; the requests are about one of them."""
    with running("demo", "--servos", "2", "--seed", "1") as found:
        found.ready(2)
        yield found


@pytest.mark.parametrize(("mode", "examples"), [(GenerationMode.POSITIVE, 2), (GenerationMode.NEGATIVE, 1)])
def test_every_answer_is_as_the_document_says(server: Server, mode: GenerationMode, examples: int) -> None:
    document: dict[str, Any] = server.api.get("/openapi.json").json()
    named = {str(one["operationId"]) for verbs in document["paths"].values() for one in verbs.values()}
    assert LEFT_OUT.keys() <= named
    for path, verbs in document["paths"].items():
        document["paths"][path] = {verb: one for verb, one in verbs.items() if one["operationId"] not in LEFT_OUT}
    uid = server.ready(1)[0]
    wrong: dict[str, str] = {}
    statuses: Counter[int] = Counter()

    def check(case: Case[Any]) -> None:
        name = f"{case.operation.method.upper()} {case.operation.path}"
        if "uid" in case.path_parameters:
            case.path_parameters["uid"] = uid
        case.headers.pop("Idempotency-Key", None)  # the same key would answer the same again
        answer = case.call(base_url=server.url.rstrip("/"), timeout=20)
        statuses[answer.status_code] += 1
        if answer.status_code == 500 and answer.json().get("code") not in MEANT:
            wrong[name] = answer.text[:500]
        try:
            case.validate_response(answer, checks=CHECKS)
        except BaseExceptionGroup as failures:
            told: list[Any] = [*failures.exceptions]
            wrong[name] = "; ".join(str(one)[:700] for one in told)

    schema: Any = from_dict(document)
    for operation in (one.ok() for one in schema.get_all_operations()):
        if mode is GenerationMode.NEGATIVE and not (operation.body or operation.query or operation.headers):
            continue
        run = settings(
            max_examples=examples, derandomize=True, database=None, deadline=None, phases=[Phase.generate],
            suppress_health_check=(HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large),
        )  # fmt: skip
        run(given(operation.as_strategy(generation_mode=mode))(check))()
    assert not wrong, "\n".join(f"{name}: {what}" for name, what in wrong.items())
    assert sum(statuses.values()) > 100
    assert {200, 404, 422} <= statuses.keys()
