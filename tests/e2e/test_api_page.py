"""The API page: access for a rig, the last action as a command that works, and every operation."""

import re
import shutil
import subprocess
import sys
from typing import Any

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from e2e.servers import Demo
from e2e.state import WAIT_S, latched, no_lease, servo_of, sim, uids_of, wait_for
from e2e.steps import jog, stage


def test_the_api_page_names_this_server(page: Page, demo: Demo) -> None:
    page.goto(demo.url)
    page.get_by_role("link", name="API").click()
    expect(page).to_have_url(re.compile(r"/api-page$"))
    expect(page.get_by_test_id("api-page")).to_contain_text(demo.url + "api/v1")
    link = page.get_by_test_id("api-document").get_attribute("href")
    assert link is not None
    assert demo.api.get(link).json()["openapi"].startswith("3.")
    uids = uids_of(demo)
    examples = page.get_by_test_id("api-examples")
    expect(examples).to_contain_text("curl -sS")
    assert any(uid in examples.inner_text() for uid in uids)
    page.get_by_role("button", name="Python").click()
    expect(examples).to_contain_text("from hornbill.client import Hornbill")


def test_the_python_examples_run_unchanged(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "api-page")
    page.get_by_role("button", name="Python").click()
    shown = page.get_by_test_id("api-examples").locator("pre")
    expect(shown.first).to_contain_text("from hornbill.client import Hornbill")
    expect(shown).to_have_count(5)
    expect(page.get_by_test_id("api-examples"), "the servos are known").not_to_contain_text("<uid>")
    codes = shown.all_inner_texts()
    said: dict[str, Any] = {}
    exec("\n".join(codes[:3]), said)  # all but writing and stopping: other tests go on with these servos
    said["rig"].close()
    assert len(said["servos"]) == len(demo.api.get("/servos").json())


@pytest.mark.release
def test_the_last_actions_run_as_a_program(page: Page, demo: Demo, context: BrowserContext) -> None:
    uid = servo_of(demo, "BLA21-06U-A0")  # one that settles
    row = f"/servos/{uid}/parameters/temperature_limit_upper"
    before = demo.api.get(row).json()["value"]
    context.grant_permissions(["clipboard-read", "clipboard-write"])

    def program(action: str) -> str:
        page.locator('a[href="/api-page"]').click()
        sent = page.get_by_test_id("api-sent").locator("tbody tr").filter(has_text=re.compile(action)).first
        sent.get_by_test_id("api-copy-python").click()
        expect(sent.get_by_test_id("api-copy-python")).to_contain_text("Copied")
        return page.evaluate("() => navigator.clipboard.readText()")

    def run(code: str) -> None:
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=WAIT_S, check=False)
        assert done.returncode == 0, f"{code}\n{done.stderr}"

    try:
        page.goto(f"{demo.url}servos/{uid}/parameters#temperature_limit_upper")
        stage(page, "temperature_limit_upper", before - 1)
        page.get_by_test_id("apply").click()
        wait_for(lambda: demo.api.get(row).json()["value"] == before - 1, "not applied")
        write = program("PATCH /api/v1/servos/.*/parameters")
        demo.api.put(row, json={"value": before}).raise_for_status()
        run(write)
        assert demo.api.get(row).json()["value"] == before - 1

        page.locator('.rail a[href$="/motion"]').click()
        page.get_by_test_id("enable-motion").click()
        jog(page, 9)
        expect(page.get_by_test_id("jog-angle")).to_contain_text(re.compile(r"\+[89]\.\d°"))
        move, lease = program("POST /api/v1/servos/.*/command"), program("POST /api/v1/leases")
        no_lease(demo)
        sim(demo, uid, external_angle_deg=0)
        run(move)
        angle = demo.api.get(f"/servos/{uid}/parameters/current_angle").json()["value"]
        assert abs(angle - 9) < 5, "it coasts once its torque is off"
        assert demo.api.get(f"/servos/{uid}/parameters/torque_mode").json()["value"] == "off"
        run(lease)
        assert demo.api.get("/leases").json() == []

        page.get_by_test_id("stop").click()
        expect(page.get_by_test_id("stop-band")).to_be_visible()
        stop = program("POST /api/v1/stop")
        demo.api.delete("/stop").raise_for_status()
        run(stop)
        assert latched(demo)
        demo.api.delete("/stop").raise_for_status()
        expect(page.get_by_test_id("stop-band")).to_have_count(0)
    finally:
        demo.api.delete("/stop")
        demo.api.put(row, json={"value": before}).raise_for_status()


@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
def test_the_last_action_copied_as_curl_repeats_it(page: Page, demo: Demo, context: BrowserContext) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    row = f"/servos/{uid}/parameters/temperature_limit_upper"
    before = demo.api.get(row).json()["value"]
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.goto(f"{demo.url}servos/{uid}/parameters#temperature_limit_upper")
    stage(page, "temperature_limit_upper", before - 1)
    page.get_by_test_id("apply").click()
    wait_for(lambda: demo.api.get(row).json()["value"] == before - 1, "not applied")
    try:
        page.get_by_role("link", name="API").click()
        sent = page.get_by_test_id("api-sent").locator("tbody tr").filter(has_text="temperature_limit_upper").first
        expect(sent.get_by_test_id("api-status")).to_contain_text("200")
        sent.get_by_test_id("api-copy").click()
        expect(sent.get_by_test_id("api-copy")).to_contain_text("Copied")
        command: str = page.evaluate("() => navigator.clipboard.readText()")
        assert "$HORNBILL_TOKEN" in command
        demo.api.put(row, json={"value": before}).raise_for_status()
        revision = demo.api.get(f"/servos/{uid}/parameters").headers.get("etag", "")
        command = re.sub(r"(If-Match: )\"?[^'\"]*\"?", lambda found: found[1] + revision, command)
        subprocess.run(
            ["sh", "-c", command], check=True, capture_output=True, timeout=WAIT_S, env={"HORNBILL_TOKEN": "x"}
        )
        assert demo.api.get(row).json()["value"] == before - 1
    finally:
        demo.api.put(row, json={"value": before}).raise_for_status()
