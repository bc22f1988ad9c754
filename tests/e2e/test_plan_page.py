"""A test plan on the page: checked, started after a confirmation, ended, resumed, and its reports downloaded."""

import xml.etree.ElementTree as ET

from playwright.sync_api import BrowserContext, FilePayload, Page, expect

from e2e.servers import Demo
from e2e.state import add, no_lease

PLAN = """
name = "Elevator endurance"
description = "Two servos back and forth."
servos = [{servos}]
cycles = 6

[limits]
position_error_deg = 2
temperature_c = 70

[[steps]]
do = "move"
angle_deg = 10
timeout_s = 3

[[steps]]
do = "wait"
for_s = 0.2

[[steps]]
do = "move"
angle_deg = -10
timeout_s = 3
"""
ROM = {"soft_start": 0, "timeout_action": 0}


def choose(page: Page, text: str) -> None:
    """Choose a plan file with this text."""
    file: FilePayload = {"name": "endurance.toml", "mimeType": "application/toml", "buffer": text.encode()}
    page.get_by_test_id("plan-file").set_input_files(file)


def test_a_plan_that_cannot_run_is_refused_with_the_reason(context: BrowserContext, demo: Demo) -> None:
    tab = context.new_page()  # not watched: the console logs the refused requests, as expected
    tab.goto(f"{demo.url}records#reports")
    for wrong, said in (("name =", "not TOML"), (PLAN.format(servos='"nobody"'), "nobody")):
        choose(tab, wrong)
        expect(tab.get_by_test_id("plan-refused")).to_contain_text(said)
    tab.close()


def test_a_plan_is_checked_run_ended_resumed_and_reported(page: Page, demo: Demo) -> None:
    uids = [*add(demo, servo_id=41, rom=ROM), *add(demo, servo_id=42, rom=ROM)]
    text = PLAN.format(servos=", ".join(f'"{uid}"' for uid in uids))
    page.goto(f"{demo.url}records#reports")

    choose(page, text)
    dialog = page.get_by_test_id("plan-dialog")
    for said in ("6 cycles of 3 steps", "1. Move to +10.0°", "2. Wait 0.2 s", "temperature 70", "Keep clear"):
        expect(dialog).to_contain_text(said)
    for uid in uids:
        expect(page.get_by_test_id(f"plan-{uid}")).to_have_attribute("data-able", "true")
    assert [job for job in demo.api.get("/jobs").json() if job["kind"] == "plan"] == [], "checking starts nothing"
    assert demo.api.get("/leases").json() == []

    page.get_by_test_id("plan-go").click()
    run = page.get_by_test_id("plan-run")
    expect(run).to_have_attribute("data-state", "running")
    expect(run).to_contain_text("1 of 6 cycles done")
    page.get_by_test_id("plan-end").click()
    expect(run).to_have_attribute("data-state", "cancelled")
    page.get_by_test_id("change-close").click()
    no_lease(demo)

    page.reload()  # the job, not the page, knows where it was
    (job,) = [job for job in demo.api.get("/jobs").json() if job["kind"] == "plan"]
    page.get_by_test_id(f"job-{job['id']}").get_by_role("button").first.click()
    page.get_by_test_id("plan-resume").click()
    assert demo.api.get(f"/jobs/{job['id']}").json()["state"] == "cancelled", "it asks first"
    page.get_by_test_id("plan-resume-go").click()
    progress = page.get_by_test_id("job-dialog")
    expect(progress.get_by_test_id("plan-run")).to_have_attribute("data-state", "succeeded", timeout=60_000)
    expect(progress).to_contain_text("6 of 6 cycles done")
    links = {form: progress.get_by_test_id(f"report-{form}").get_attribute("href") for form in ("csv", "junit", "html")}
    reports = {form: demo.api.get(str(link).removeprefix("/api/v1")).text for form, link in links.items()}
    assert len(list(ET.fromstring(reports["junit"]).iter("testcase"))) >= 2 * 3
    assert "Move to 10°" in reports["csv"]
    assert "<title>" in reports["html"]
    no_lease(demo)
    for uid in uids:
        demo.api.delete(f"/sim/servos/{uid}")
