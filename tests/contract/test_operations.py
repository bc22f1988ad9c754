"""What programs rely on in the OpenAPI document: names that stay, units, problems, and a key for each POST."""

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import pytest

from hornbill.api.document import document
from hornbill.api.http import create_api
from hornbill.api.once import EVERY_TIME
from hornbill.schema.catalog import Catalog

CATALOG = Catalog.load()

OPERATIONS = """
    accept_drift acknowledge_fault acknowledge_faults add_bundle add_sim_servo add_token apply_profile ask_for_lease
    begin_stream cancel_job change_matrix change_parameters change_sim_servo clear_stop command_servo command_servos
    commission compare connect_bus copy_configuration delete_bundle delete_log delete_profile disconnect_bus
    download_audit download_bundle download_inventory download_log drop_run drop_snapshot end_stream examine_bus
    export_profile export_telemetry_csv export_telemetry_parquet factory_reset forecast_restart forget_allocation
    forget_servo get_bundle get_bus get_cautions get_drift get_health get_job get_known_servo get_lease_request get_log
    get_position_unit get_profile get_recorder get_report get_run get_run_csv get_schema get_servo get_session
    get_sim_servo get_snapshot get_stop get_stream get_telemetry identify_servo import_profile label_known_servo
    label_servo list_adapters list_allocations list_audit list_bundles list_candidates list_faults list_inventory
    list_jobs list_leases list_logs list_nodes list_parameters list_profiles list_runs list_servos list_sim_servos
    list_snapshots list_streams list_tokens log_in log_out make_ticket overlay_runs pin_allocation
    preview_factory_reset put_profile put_stream_values read_matrix recycle_allocations refuse_lease_request
    release_lease remove_sim_servo renew_lease restart_servo restore_drift restore_snapshot resume_job revoke_token
    save_servo set_allocator set_position_unit set_telemetry set_torque start_log step_test stop stop_log stream_events
    take_lease take_snapshot withdraw_lease_request write_bundle
""".split()  # noqa: SIM905 - one a line would be a hundred lines
"""Without those of parameters. Add to them freely; whoever takes one away breaks somebody's generated client."""


@lru_cache
def made() -> dict[str, Any]:
    return document(create_api(CATALOG))


def operations() -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, verbs in made()["paths"].items():
        for verb, operation in verbs.items():
            yield verb, path, operation


def test_every_operation_has_a_name_of_its_own_and_none_has_changed() -> None:
    found = [operation["operationId"] for _, _, operation in operations()]
    assert len(found) == len(set(found))
    rows = {f"{verb}_{key}" for key in CATALOG.parameters for verb in ("get", "set")}
    others = sorted(set(found) - rows)
    assert others == sorted(OPERATIONS), "the names of operations are a contract: see OPERATIONS"


@pytest.mark.parametrize("key", [key for key, row in CATALOG.parameters.items() if row.readable])
def test_every_row_has_routes_with_type_unit_range_and_description(key: str) -> None:
    row = CATALOG.parameters[key]
    verbs = made()["paths"][f"/api/v1/servos/{{uid}}/parameters/{key}"]
    assert verbs["get"]["operationId"] == f"get_{key}"
    assert verbs["get"]["summary"] == row.label
    assert row.description.strip()[:40] in verbs["get"]["description"]
    assert ("put" in verbs) == row.writable
    if row.writable:
        name = verbs["put"]["requestBody"]["content"]["application/json"]["schema"]["$ref"].rsplit("/", 1)[-1]
        value = made()["components"]["schemas"][name]["properties"]["value"]
        assert {"type", "anyOf", "oneOf", "enum"} & value.keys(), value
        if row.unit and row.unit_when is None:
            assert row.unit in str(value) + verbs["put"]["description"]


def test_every_operation_says_what_it_answers_and_problems_have_one_shape() -> None:
    for verb, path, operation in operations():
        place = f"{verb} {path}"
        assert operation.get("summary"), place
        assert operation.get("description"), place
        assert any(status.startswith("2") for status in operation["responses"]), place
        for status, answer in operation["responses"].items():
            if status.startswith(("4", "5")):
                assert answer["content"]["application/problem+json"]["schema"]["$ref"].endswith("/Problem"), place
                assert "`" in answer["description"], f"{place} {status} names no code"


def test_every_post_takes_a_key_and_those_that_do_not_say_why() -> None:
    without: set[str] = set()
    for verb, path, operation in operations():
        named = {one["name"] for one in operation.get("parameters", ())}
        assert verb == "post" or "Idempotency-Key" not in named
        if verb == "post" and "Idempotency-Key" not in named:
            without.add(path)
    assert without == set(EVERY_TIME)


def test_everything_that_takes_time_can_be_waited_for() -> None:
    slow = [(path, operation) for _, path, operation in operations() if "202" in operation["responses"]]
    assert len(slow) > 8
    for path, operation in slow:
        named = {one["name"] for one in operation.get("parameters", ())}
        # Asking for motion control is the one thing whose end a person decides.
        assert "wait" in named or path == "/api/v1/leases/requests", path


def test_no_two_schemas_share_a_title() -> None:
    titles = [one["title"] for one in made()["components"]["schemas"].values() if "title" in one]
    assert sorted(titles) == sorted(set(titles))
    assert not [name for name in made()["components"]["schemas"] if "__" in name]


def test_it_is_openapi_3_1_and_every_reference_leads_somewhere() -> None:
    assert made()["openapi"].startswith("3.1")
    text = str(made())
    for part in text.split("#/components/schemas/")[1:]:
        name = part.split("'", 1)[0]
        assert name in made()["components"]["schemas"], name
