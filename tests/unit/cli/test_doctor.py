"""Output and exit code of `hornbill doctor`."""

import json
from typing import Any

import pytest
from typer.testing import CliRunner

from hornbill.cli import app
from hornbill.client.sync.connection import Connection


def finding(severity: str, text: str, remedy: str | None = None) -> dict[str, Any]:
    return {
        "code": text.casefold().replace(" ", "_"), "severity": severity, "text": text, "evidence": f"{text}: 3 times.",
        "remedy": remedy, "node_ids": [], "uids": [],
    }  # fmt: skip


OK = [finding("ok", "Frames received"), finding("ok", "One allocator")]
NOTICE = finding("notice", "Unknown frames", "Ignore them.")
WARNING = finding("warning", "Errors increase", "Check the connectors.")
FAILURE = finding("failure", "No node seen", "Check the supply.")


def doctor(found: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch, *flags: str) -> tuple[int, str]:
    def request(_self: Connection, verb: str, path: str, body: object = None, **query: object) -> object:
        assert (verb, path, body, query) == ("GET", "/bus/doctor", None, {"all": True})
        return found

    monkeypatch.setattr(Connection, "request", request)
    result = CliRunner().invoke(app, ["doctor", *flags])
    return result.exit_code, result.stdout


def test_a_healthy_bus_is_one_line_and_exit_code_0(monkeypatch: pytest.MonkeyPatch) -> None:
    assert doctor(OK, monkeypatch) == (0, "0 findings, 2 checks passed.\n")


@pytest.mark.parametrize(("found", "code"), [([FAILURE], 1), ([WARNING], 1), ([NOTICE], 0), ([WARNING, NOTICE], 1)])
def test_warnings_and_failures_set_exit_code_1(
    found: list[dict[str, Any]], code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert doctor([*found, *OK], monkeypatch)[0] == code
    assert doctor([*found, *OK], monkeypatch, "--json")[0] == code


def test_a_finding_is_printed_with_evidence_and_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    _, text = doctor([FAILURE, WARNING, *OK], monkeypatch)
    assert text.splitlines() == [
        "Failure: No node seen",
        "  No node seen: 3 times.",
        "  → Check the supply.",
        "Warning: Errors increase",
        "  Errors increase: 3 times.",
        "  → Check the connectors.",
        "2 findings, 2 checks passed.",
    ]
    _, text = doctor([WARNING, *OK], monkeypatch, "--json")
    assert json.loads(text) == [WARNING]
