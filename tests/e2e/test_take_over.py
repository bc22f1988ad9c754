"""Motion control between two browsers: requested, refused, handed over, taken with a reason."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect

from e2e.contexts import page_in
from e2e.looks import complaints, too_small
from e2e.servers import Demo
from e2e.state import latched, no_lease, read, servo_of, wait_for
from e2e.steps import box

SERVOS = 4
TABLET: ViewportSize = {"width": 820, "height": 1180}
"""Without the 3D view: two software renderers would be slower than the countdown."""


@pytest.fixture
def other(browser: Browser, demo: Demo) -> Iterator[Page]:
    """The browser of another client, without complaints."""
    said: list[str] = []
    with page_in(browser, TABLET) as page:
        page.on("console", lambda one: said.append(one.text) if one.type == "error" else None)
        yield page
    assert said == []


def in_english(holder: str) -> str:
    """The name of a page as shown."""
    return holder.replace("page-", "Page ")


def begin(page: Page, demo: Demo, uid: str) -> str:
    """Turn motion on. Returns its holder."""
    page.set_viewport_size(TABLET)
    page.goto(f"{demo.url}servos/{uid}/motion")
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("jog-pad")).to_be_visible()
    return demo.api.get("/leases").json()[0]["holder"]


def test_motion_control_is_requested_refused_and_handed_over(page: Page, other: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    holder = begin(page, demo, uid)
    other.goto(f"{demo.url}servos/{uid}/motion")
    expect(other.get_by_test_id("take-over")).to_contain_text(f"{in_english(holder)} has motion control")
    expect(other.get_by_test_id("bar-motion")).to_contain_text(re.compile(rf"\d.s left.*{in_english(holder)}"))
    expect(other.get_by_test_id("enable-motion")).to_be_disabled()
    assert complaints(other) == []

    other.get_by_test_id("request-reason").fill("to calibrate the tail")
    other.get_by_test_id("request-lease").click()
    band = page.get_by_test_id("request-band")
    expect(band).to_contain_text("to calibrate the tail")
    for one, where in ((page, "request-left"), (other, "take-over-left")):
        expect(one.get_by_test_id(where)).to_contain_text(re.compile(r"in [1-9]\d?.s unless"))
    for button in ("keep-lease", "hand-over"):
        at = box(page.get_by_test_id(button))
        assert at["x"] + at["width"] < box(page.get_by_test_id("stop"))["x"], "nothing that enables stands under Stop"
    page.get_by_test_id("keep-lease").click()
    expect(band).to_have_count(0)
    expect(other.get_by_test_id("motion-refusal")).to_contain_text(f"{in_english(holder)} keeps motion control.")
    assert read(demo, uid, "torque_mode") == "on", "a request ends nothing"

    other.get_by_test_id("request-lease").click()
    expect(other.get_by_test_id("request-withdraw")).to_be_visible()
    page.get_by_test_id("hand-over").click()
    expect(page.get_by_test_id("motion-refusal")).to_contain_text("handed over")
    expect(other.get_by_test_id("take-over")).to_contain_text("You have motion control")
    assert read(demo, uid, "torque_mode") == "off", "what was commanded before ends first"
    other.get_by_test_id("enable-motion").click()
    expect(other.get_by_test_id("jog-pad")).to_be_visible()
    other.get_by_test_id("disable-motion").click()
    no_lease(demo)


def test_taking_motion_control_needs_a_reason_and_ends_motion(page: Page, other: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    holder = begin(page, demo, uid)
    other.set_viewport_size({"width": 768, "height": 1024})
    other.goto(f"{demo.url}servos/{uid}/motion")
    other.get_by_test_id("take-lease").click()
    dialog = other.get_by_test_id("take-dialog")
    expect(dialog).to_contain_text(f"Take motion control from {in_english(holder)}?")
    expect(other.get_by_test_id("take-now")).to_be_disabled()
    assert too_small(other) == []
    dialog.get_by_test_id("take-reason").fill("it runs into the wing")
    other.get_by_test_id("take-now").click()
    expect(other.get_by_test_id("take-over")).to_contain_text("You have motion control")
    assert read(demo, uid, "torque_mode") == "off"
    mine = demo.api.get("/leases").json()[0]["holder"]
    expect(page.get_by_test_id("motion-refusal")).to_contain_text(f"{in_english(mine)} took motion control.")
    wait_for(lambda: "it runs into the wing" in demo.api.get("/audit").text, "the audit does not say why")
    other.get_by_test_id("give-back").click()
    no_lease(demo)


def test_two_rigs_have_servos_and_the_page_moves_a_third(page: Page, demo: Demo) -> None:
    free = servo_of(demo, "BLA21-12U-A0")
    others = [
        str(one["uid"]) for one in demo.api.get("/servos").json() if one["state"] == "ready" and one["uid"] != free
    ]

    def take(holder: str, *uids: str) -> dict[str, str]:
        body = {"holder": holder, "ttl_s": 60, "uids": uids}
        return {"Lease": demo.api.post("/leases", json=body).raise_for_status().json()["id"]}

    def gate(uid: str, holder: str) -> None:
        page.goto(f"{demo.url}servos/{uid}/motion")
        expect(page.get_by_test_id("take-over")).to_contain_text(f"{holder} has motion control")
        expect(page.get_by_test_id("enable-motion")).to_be_disabled()

    rig_a, rig_b = take("Rig A", *others[:2]), take("Rig B", others[2])
    page.set_viewport_size(TABLET)
    for uid, holder in zip(others, ("Rig A", "Rig A", "Rig B"), strict=False):
        gate(uid, holder)
    shown = page.get_by_test_id("bar-motion")
    expect(shown).to_contain_text("Rig A: 2, Rig B: 1")
    assert complaints(page) == []

    begin(page, demo, free)
    expect(shown).to_contain_text("Rig A: 2, Rig B: 1, You: 1")
    assert [row["uids"] for row in demo.api.get("/leases").json()][2:] == [[free]]
    page.get_by_test_id("disable-motion").click()

    gate(others[2], "Rig B")
    page.get_by_test_id("request-lease").click()
    expect(page.get_by_test_id("request-withdraw")).to_be_visible()
    requests = {row["holder"]: row["request"] for row in demo.api.get("/leases").json()}
    assert requests["Rig A"] is None, "the request concerns the lease that covers this servo"
    path = f"/leases/requests/{requests['Rig B']['id']}/refuse"
    demo.api.post(path, headers=rig_b).raise_for_status()
    expect(page.get_by_test_id("motion-refusal")).to_contain_text("Rig B keeps motion control.")
    page.get_by_test_id("take-lease").click()
    page.get_by_test_id("take-dialog").get_by_test_id("take-reason").fill("it runs into the wing")
    page.get_by_test_id("take-now").click()
    expect(page.get_by_test_id("take-over")).to_contain_text("You have motion control")
    found = [(row["holder"], row["uids"]) for row in demo.api.get("/leases").json()]
    assert [uids for _, uids in found] == [sorted(others[:2]), others[2:3]]
    assert found[0][0] == "Rig A", "it goes on"
    page.get_by_test_id("give-back").click()
    demo.api.delete(f"/leases/{rig_a['Lease']}").raise_for_status()
    no_lease(demo)


def test_a_copied_tab_is_another_client(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    holder = begin(page, demo, uid)
    kept = page.evaluate("() => JSON.stringify(sessionStorage)")
    twin = page.context.new_page()
    twin.add_init_script(
        f"Object.assign(sessionStorage, JSON.parse({kept!r})); localStorage.setItem('hornbill.language', 'ja')"
    )
    twin.goto(f"{demo.url}servos/{uid}/motion")
    shown = holder.replace("page-", "ページ")
    expect(twin.get_by_test_id("take-over")).to_contain_text(f"{shown}が動作権を持っています")
    expect(twin.get_by_test_id("bar-motion")).to_contain_text(shown)
    expect(page.get_by_test_id("jog-pad")).to_be_visible()
    twin.get_by_test_id("stop").click()
    wait_for(lambda: latched(demo), "it did not stop")
    latch = demo.api.get("/stop").json()
    assert re.fullmatch(r"page-\d+", latch["by"])
    assert latch["by"] != holder
    assert latch["reason"] == "stop_button"
    expect(page.get_by_test_id("stop-band")).to_contain_text("by " + latch["by"].replace("page-", "Page "))
    demo.api.delete("/stop").raise_for_status()
    twin.close()
