"""Output and exit code of `hornbill doctor`."""

import json
from typing import Any

import pytest
from typer.testing import CliRunner

from contract.test_doc_references import command_error
from hornbill.api.remedies import ADVISED as REQUESTS
from hornbill.api.remedies import remedy
from hornbill.cli import app
from hornbill.cli.remedies import ADVISED
from hornbill.client.sync.connection import Connection
from hornbill.domain.bus import Finding


def finding(severity: str, text: str, remedy: str | None = None, advice: str | None = None) -> dict[str, Any]:
    return {
        "code": text.casefold().replace(" ", "_"), "severity": severity, "text": text, "evidence": f"{text}: 3 times.",
        "remedy": remedy, "node_ids": [], "uids": [], "advice": advice,
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


def test_a_finding_names_a_command_for_each_advice_with_a_request() -> None:
    assert set(ADVISED) == {advice for advice, named in REQUESTS.items() if "/api/" in named}
    for commands in ADVISED.values():
        for one in commands.split(", "):
            assert command_error(one.split()[1:], complete=False) == "", one


@pytest.mark.parametrize("flags", [(), ("--json",)])
def test_the_command_replaces_the_request_of_the_server(
    flags: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    waiting = Finding("allocator_off", "warning", "It waits.", "For 9 s.", "Turn it on.", advice="turn_allocator_on")
    assert "PUT /api/v1/" in (remedy(waiting) or "")
    found = finding("warning", "It waits", remedy(waiting), waiting.advice)
    _, text = doctor([found], monkeypatch, *flags)
    assert "Turn it on. Use: hornbill node-ids set-allocator on." in text
    assert "/api/" not in text
