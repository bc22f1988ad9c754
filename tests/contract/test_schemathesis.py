"""A running demo responds as documented to requests that the document allows, and to many that it does not."""

from collections import Counter
from collections.abc import Collection
from typing import Any

from hypothesis import HealthCheck, Phase, given, settings
from schemathesis import Case, GenerationMode
from schemathesis.openapi import from_dict
from schemathesis.specs.openapi import checks

from e2e.servers import Server, running
from hornbill.schema.catalog import Catalog

CHECKS: Any = [
    checks.status_code_conformance, checks.content_type_conformance, checks.response_schema_conformance,
]  # fmt: skip

EXCLUDED = {
    "stop": "it latches: every later motion would be 423",
    "connect_bus": "later requests would have no bus",
    "disconnect_bus": "later requests would have no bus",
    "create_token": "later requests would need the token: 401",
    "stream_events": "it does not end",
    "diagnose_bus": "it listens for some seconds",
    "create_recording": "it waits ten seconds",
    "import_recording": "it takes a file that has no schema",
    "remove_sim_servo": "later requests would have no servo",
    "forget_servo": "later requests would have no servo",
}
EXPECTED_500 = ("interrupted", "store_failed", "log_failed")
"""A failed disk, or a server that ended; any other 500 is a defect."""


LONGEST_URL = 1 << 16
"""Characters. The HTTP parser refuses longer ones before the API, in plain text."""

ROWS = ("current_angle", "angle_p_gain", "torque_mode")
"""Parameters whose own routes are requested in `make test`: those of all parameters are alike."""


def test_every_response_is_as_documented() -> None:
    with running("demo", "--servos", "1", "--seed", "1") as server:
        server.ready(1)
        for mode in (GenerationMode.POSITIVE, GenerationMode.NEGATIVE):
            check_responses(server, mode, examples=1, rows=ROWS)


def check_responses(server: Server, mode: GenerationMode, *, examples: int, rows: Collection[str]) -> None:
    """Send `examples` requests to each operation, of the routes per parameter those of `rows` only."""
    document: dict[str, Any] = server.api.get("/openapi.json").json()
    named = {str(one["operationId"]) for verbs in document["paths"].values() for one in verbs.values()}
    assert EXCLUDED.keys() <= named
    left_out = {f"{verb}_{key}" for key in Catalog.load().parameters if key not in rows for verb in ("get", "set")}
    for path, verbs in document["paths"].items():
        used = {verb: one for verb, one in verbs.items() if one["operationId"] not in EXCLUDED.keys() | left_out}
        document["paths"][path] = used
    uid = server.ready(1)[0]
    wrong: dict[str, str] = {}
    statuses: Counter[int] = Counter()

    def check(case: Case[Any]) -> None:
        name = f"{case.operation.method.upper()} {case.operation.path}"
        if "uid" in case.path_parameters:
            case.path_parameters["uid"] = uid
        case.headers.pop("Idempotency-Key", None)  # the same key would get the same response again
        response = case.call(base_url=server.url.rstrip("/"), timeout=60)
        statuses[response.status_code] += 1
        if response.status_code == 400 and len(str(response.request.url)) > LONGEST_URL:
            return
        if response.status_code == 500 and response.json().get("code") not in EXPECTED_500:
            wrong[name] = response.text[:500]
        try:
            case.validate_response(response, checks=CHECKS)
        except BaseExceptionGroup as failures:
            exceptions: list[Any] = [*failures.exceptions]
            wrong[name] = "; ".join(str(one)[:700] for one in exceptions)

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
