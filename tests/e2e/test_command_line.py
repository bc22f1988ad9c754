"""The command line against a running server: what it prints, and that its exit code says whether it worked."""

import json
import re
import subprocess
import sys

import httpx
import pytest

from e2e.conftest import Demo, running_demo


def hornbill(demo: Demo | None, *words: str) -> subprocess.CompletedProcess[str]:
    server = ["--server", demo.url] if demo is not None else []
    command = [sys.executable, "-m", "hornbill", words[0], *server, *words[1:]]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


@pytest.fixture
def serial(demo: Demo) -> str:
    """The serial of the demo's servo that nobody else uses."""
    found = [one for one in demo.api.get("/servos").json() if one["model"] == "BLA21-28U-AB"]
    return str(found[0]["serial"])


def test_list_get_set_and_save(demo: Demo, serial: str) -> None:
    listed = hornbill(demo, "list")
    assert listed.returncode == 0
    assert serial in listed.stdout
    assert len(json.loads(hornbill(demo, "list", "--json").stdout)) == 6

    assert "angle_p_gain" in hornbill(demo, "get", serial).stdout
    applied = hornbill(demo, "set", serial, "angle_p_gain=47", "smoothing=false")
    assert applied.returncode == 0, applied.stderr
    assert "applied" in applied.stdout
    reading = json.loads(hornbill(demo, "get", serial, "angle_p_gain", "--json").stdout)
    assert (reading["value"], reading["rom"]) == (47, 40)
    saved = hornbill(demo, "save", serial)
    assert saved.returncode == 0, saved.stderr
    assert "read back" in saved.stdout
    assert json.loads(hornbill(demo, "get", serial, "angle_p_gain", "--json").stdout)["rom"] == 47


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("set", "SERIAL", "angle_p_gain=0"), "out_of_range: 0 is below the 1 this model allows"),
        (("set", "SERIAL", "0x49=1"), "forbidden_parameter"),
        (("get", "SERIAL", "nonsense"), "unknown_parameter"),
        (("get", "nobody"), "No servo is known as 'nobody'"),
    ],
)
def test_what_does_not_work_says_why_and_exits_with_1(
    demo: Demo, serial: str, words: tuple[str, ...], said: str
) -> None:
    failed = hornbill(demo, *(word.replace("SERIAL", serial) for word in words))
    assert failed.returncode == 1
    assert said in failed.stderr


def test_without_a_server_it_says_how_to_start_one() -> None:
    failed = subprocess.run(
        [sys.executable, "-m", "hornbill", "list", "--server", "http://127.0.0.1:9"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert failed.returncode == 1
    assert "hornbill demo" in failed.stderr


def test_openapi_prints_the_document() -> None:
    document = json.loads(hornbill(None, "openapi").stdout)
    assert "/api/v1/servos/{uid}/parameters/angle_limit_cw" in document["paths"]


def test_the_doctor_finds_nothing_in_the_demo(demo: Demo) -> None:
    examined = hornbill(demo, "doctor")
    assert examined.returncode == 0, examined.stdout + examined.stderr
    assert re.fullmatch(r"Nothing wrong found: 1\d checks passed\.\n", examined.stdout)
    as_json = hornbill(demo, "doctor", "--json")
    assert (as_json.returncode, json.loads(as_json.stdout)) == (0, [])


def test_the_doctor_without_a_bus_says_so_and_exits_with_1() -> None:
    with running_demo("--servos", "1") as (_, url):
        httpx.delete(f"{url}api/v1/bus").raise_for_status()
        lone = Demo(url, httpx.Client())
        examined = hornbill(lone, "doctor")
        assert examined.returncode == 1
        assert examined.stdout.startswith("Failure: No bus is connected\n")
        assert "PUT /api/v1/bus" in examined.stdout
        as_json = hornbill(lone, "doctor", "--json")
        assert as_json.returncode == 1
        assert [one["code"] for one in json.loads(as_json.stdout)] == ["no_bus"]
        lone.api.close()
