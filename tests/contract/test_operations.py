"""What programs rely on in the OpenAPI document: names that stay, units, problems, and a key for each POST."""

import asyncio
from collections.abc import Iterator
from typing import Any

import httpx

from contract.answering import document
from hornbill.api.http import create_api
from hornbill.api.openapi.sharing import parameters_of
from hornbill.api.routing import WITHOUT_KEY
from hornbill.api.security.access import Access
from hornbill.api.security.sessions import TRIES
from hornbill.schema.catalog import Catalog

CATALOG = Catalog.load()

OPERATIONS = """
    accept_drift acknowledge_fault acknowledge_faults import_recording add_sim_servo create_token apply_profile
    request_lease start_stream cancel_job change_matrix change_parameters change_sim_servo clear_stop command_servo
    command_servos commission compare connect_bus copy_configuration delete_log delete_profile delete_recording
    disconnect_bus dismiss_lost_values download_audit download_inventory download_log download_recording delete_run
    delete_snapshot end_stream diagnose_bus export_profile export_telemetry_csv export_telemetry_parquet factory_reset
    forecast_restart forget_allocation forget_servo get_bus get_cautions get_drift get_health get_job get_known_servo
    get_lease_request get_log get_parameter get_position_unit get_profile get_recorder get_recording get_report
    get_run get_run_csv get_schema get_servo get_session get_sim_servo get_snapshot get_stop get_stream get_telemetry
    identify_servo import_profile update_known_servo label_servo list_adapters list_allocations list_audit
    list_candidates list_faults list_inventory list_jobs list_leases list_logs list_nodes list_parameters
    list_profiles list_recordings list_runs list_servos list_sim_servos list_snapshots list_streams list_tokens log_in
    log_out create_ticket overlay_runs pin_allocation preview_factory_reset put_profile set_stream_values read_faults
    read_matrix recycle_allocations refuse_lease_request release_lease remove_sim_servo renew_lease restart_servo
    restore_drift restore_output restore_snapshot resume_job revoke_token save_servo set_allocator set_parameter
    set_position_unit set_telemetry set_torque start_log step_test stop stop_log stream_events take_lease
    take_snapshot withdraw_lease_request create_recording
""".split()  # noqa: SIM905 - one a line would be a hundred lines
"""Without those of parameters. Add to them freely; whoever takes one away breaks somebody's generated client."""


def operations() -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, verbs in document()["paths"].items():
        for verb, operation in verbs.items():
            yield verb, path, operation


def problem(answer: dict[str, Any]) -> dict[str, Any]:
    """The shared response that an operation refers to."""
    return document()["components"]["responses"][answer["$ref"].rpartition("/")[2]]


def test_every_operation_has_a_name_of_its_own_and_none_has_changed() -> None:
    found = [operation["operationId"] for _, _, operation in operations()]
    assert len(found) == len(set(found))
    rows = {f"{verb}_{key}" for key in CATALOG.parameters for verb in ("get", "set")}
    others = sorted(set(found) - rows)
    assert others == sorted(OPERATIONS), "the names of operations are a contract: see OPERATIONS"


def test_every_row_has_routes_of_its_own_name() -> None:
    for key, row in CATALOG.readable.items():
        verbs = document()["paths"][f"/api/v1/servos/{{uid}}/parameters/{key}"]
        assert {verb: one["operationId"] for verb, one in verbs.items()} == {
            verb: f"{word}_{key}" for verb, word in (("get", "get"), ("put", "set")) if verb == "get" or row.writable
        }
        assert verbs["get"]["summary"] == row.label


def test_every_operation_says_what_it_answers_and_problems_have_one_shape() -> None:
    for verb, path, operation in operations():
        place = f"{verb} {path}"
        assert operation.get("summary"), place
        assert operation.get("description"), place
        assert any(status.startswith("2") for status in operation["responses"]), place
        for status, answer in operation["responses"].items():
            if not status.startswith("2"):
                shape = problem(answer)["content"]["application/problem+json"]["schema"]
                assert shape["$ref"].endswith("/Problem"), place
            if status.startswith(("4", "5")):
                words = answer.get("description", problem(answer)["description"])
                assert "`" in words, f"{place} {status} names no code"


def test_every_operation_declares_its_problems_and_all_but_stop_that_wrong_tokens_are_limited() -> None:
    unlimited: list[str] = []
    for verb, path, operation in operations():
        common = problem(operation["responses"]["default"])
        assert "`forbidden_origin` (403)" in common["description"], f"{verb} {path}"
        if "`too_many_attempts` (429)" not in common["description"]:
            unlimited.append(operation["operationId"])
            continue
        assert common["headers"]["Retry-After"]["schema"]["type"] == "integer"
    assert unlimited == ["stop"]


def test_what_is_declared_of_wrong_tokens_is_what_the_guard_answers() -> None:
    async def ask() -> None:
        app = create_api(CATALOG, access=Access(given="the-one-that-is-right"))
        transport = httpx.ASGITransport(app, raise_app_exceptions=False, client=("192.0.2.9", 5000))
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as http:
            for at in range(TRIES):
                await http.get("/api/v1/servos", headers={"Authorization": f"Bearer wrong-{at}"})
            for verb, path, operation in operations():
                answer = await http.request(verb.upper(), path, headers={"Authorization": "Bearer wrong"})
                limited = operation["operationId"] != "stop"
                assert answer.status_code == (429 if limited else 401), f"{verb} {path}"
                assert ("retry-after" in answer.headers) == limited

    asyncio.run(ask())


def test_every_post_takes_a_key_and_those_that_do_not_say_why() -> None:
    without: set[str] = set()
    for verb, path, operation in operations():
        named = {one["name"] for one in parameters_of(document(), operation)}
        assert verb == "post" or "Idempotency-Key" not in named
        if verb == "post" and "Idempotency-Key" not in named:
            without.add(path)
    assert without == set(WITHOUT_KEY)


def test_everything_that_takes_time_can_be_waited_for() -> None:
    slow = [(path, operation) for _, path, operation in operations() if "202" in operation["responses"]]
    assert len(slow) > 8
    for path, operation in slow:
        named = {one["name"] for one in parameters_of(document(), operation)}
        # Asking for motion control is the one thing whose end a person decides.
        assert "wait" in named or path == "/api/v1/leases/requests", path


def test_no_two_schemas_share_a_title() -> None:
    titles = [one["title"] for one in document()["components"]["schemas"].values() if "title" in one]
    assert sorted(titles) == sorted(set(titles))
    assert not [name for name in document()["components"]["schemas"] if "__" in name]


def test_it_is_openapi_3_1_and_every_reference_leads_somewhere() -> None:
    assert document()["openapi"].startswith("3.1")
    text = str(document())
    for part in text.split("#/components/schemas/")[1:]:
        name = part.split("'", 1)[0]
        assert name in document()["components"]["schemas"], name


def test_every_parameter_and_field_is_described() -> None:
    parameters = [(path, each) for _, path, one in operations() for each in parameters_of(document(), one)]
    assert [(path, one["name"]) for path, one in parameters if not is_described(one)] == []
    schemas = document()["components"]["schemas"]
    fields = [(shape, name, one) for shape, each in schemas.items() for name, one in each.get("properties", {}).items()]
    assert [
        f"{shape}.{name}"
        for shape, name, one in fields
        if not is_described(one) and "const" not in one and not shape.endswith("Value")
    ] == []


def is_described(declared: dict[str, Any]) -> bool:
    """With a description of its own, or of the shape that it refers to."""
    shape = document()["components"]["schemas"].get(declared.get("$ref", "").rpartition("/")[2], {})
    return any("description" in one for one in (declared, declared.get("schema", {}), shape))
