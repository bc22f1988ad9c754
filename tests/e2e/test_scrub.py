"""A recording, imported as a .zip file or opened in a plot: its time and its horns, never confused with live servos."""

import csv
import re
import time
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from e2e.conftest import Watched
from e2e.servers import Demo, running
from e2e.state import no_lease, uids_of, wait_for
from e2e.test_technician import horn

pytestmark = [pytest.mark.scene, pytest.mark.release]

MOVES = (30, -45, 10)


@dataclass(frozen=True)
class Recorded:
    """A recording from another bus, and its content."""

    name: str
    data: bytes
    content: dict[str, Any]
    csv: bytes
    uid: str

    def samples(self, channel: str) -> list[tuple[float, float | None]]:
        """Samples of the servo that moved: times from the first mark, values."""
        zero = self.content["about"]["marks"][0]["at"]
        (found,) = [one for one in self.content["telemetry"] if one["uid"] == self.uid and one["channel"] == channel]
        return [(at - zero, value) for at, value in zip(found["t"], found["v"], strict=True)]


@pytest.fixture(scope="module")
def recorded() -> Recorded:
    """Three servos, the first of which moved to three angles. Their server has ended."""
    with running("demo", "--servos", "3", "--seed", "11") as server:
        uid = server.ready(3)[0]
        api = server.api
        lease = {"Lease": api.post("/leases", json={"holder": "Bench", "ttl_s": 60}).json()["id"]}
        time.sleep(2)
        api.post(f"/servos/{uid}/torque", json={"mode": "on"}, headers=lease).raise_for_status()
        for angle in MOVES:
            body = {"type": "angle", "value": angle, "wait": "settled"}
            api.post(f"/servos/{uid}/command", json=body, headers=lease).raise_for_status()
            time.sleep(0.6)
        api.post(f"/servos/{uid}/torque", json={"mode": "off"}, headers=lease).raise_for_status()
        made = api.post("/recorder/recordings", params={"wait": True}, json={"reason": "rattled", "before_s": 30})
        name = made.raise_for_status().json()["name"]
        return Recorded(
            name,
            api.get(f"/recorder/recordings/{name}").content,
            api.get(f"/recorder/recordings/{name}/content").json(),
            api.get(f"/servos/{uid}/telemetry.csv", params={"seconds": 60}).content,
            uid,
        )


@pytest.fixture
def brought(demo: Demo, recorded: Recorded) -> Iterator[Recorded]:
    """As `recorded`; recordings a test imports are removed."""
    yield recorded
    for one in demo.api.get("/recorder/recordings").json():
        if one["name"].startswith(recorded.name.removesuffix(".zip")):
            demo.api.delete(f"/recorder/recordings/{one['name']}")


def shows(page: Page, angle: float | None) -> None:
    """Wait until the horn is at this angle; without one, until no horn is shown."""

    def there() -> bool:
        found = horn(page)
        return found is None if angle is None else found is not None and abs(found - angle) < 0.2

    wait_for(there, f"the horn does not stand at {angle}")


def move(page: Page, *keys: str) -> float:
    """Press keys on the time line. Returns its position."""
    slider = page.get_by_test_id("scrub-slider")
    for key in keys:
        slider.press(key)
    return moment(page)


def moment(page: Page) -> float:
    return float(page.get_by_test_id("scrub").get_attribute("data-at") or "nan")


def bring(page: Page, demo: Demo, recorded: Recorded) -> None:
    """Import the .zip file on Recorder, open it and select the servo that moved."""
    page.goto(f"{demo.url}recorder")
    file = {"name": recorded.name, "mimeType": "application/zip", "buffer": recorded.data}
    page.get_by_test_id("recording-file").set_input_files(files=[file])  # pyright: ignore[reportArgumentType]
    page.get_by_role("button", name=f"Open {recorded.name}").click()
    page.get_by_test_id("recording-servo").select_option(recorded.uid)
    page.locator("[data-testid=view-replay][data-state=shown]").wait_for()


def heads(page: Page) -> list[tuple[float, float]]:
    """Position of the time line in each plot, and the width of the plot."""
    faces: list[Locator] = page.locator(".record-plot .u-over").all()
    boxes = [(face.bounding_box(), face.locator(".playhead").bounding_box()) for face in faces]
    return [(line["x"] + line["width"] / 2 - face["x"], face["width"]) for face, line in boxes if face and line]


def test_a_recording_is_imported_and_described(page: Page, demo: Demo, brought: Recorded) -> None:
    bring(page, demo, brought)
    assert brought.uid not in {one["uid"] for one in demo.api.get("/servos").json()}, "it is of another bus"
    about = brought.content["about"]
    expect(page.get_by_test_id("recording-why")).to_contain_text("Manual: rattled")
    expect(page.get_by_test_id("recording-marks").get_by_role("listitem")).to_have_count(len(about["marks"]))
    expect(page.get_by_test_id("recording-events")).to_contain_text(f"Events ({len(brought.content['events'])})")
    expect(page.get_by_test_id("recording-writes")).to_contain_text(f"Writes ({len(brought.content['writes'])})")
    expect(page.get_by_test_id("recording-servo").locator("option")).to_have_count(3)
    expect(page.get_by_test_id("plot-current_angle").locator("canvas")).to_be_visible()


def test_another_zip_file_is_rejected_and_not_stored(page: Page, watched: Watched, demo: Demo, tmp_path: Path) -> None:
    before = demo.api.get("/recorder/recordings").json()
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        file.writestr("bread.txt", "two")
    page.goto(f"{demo.url}recorder")
    wrong = {"name": "shopping.zip", "mimeType": "application/zip", "buffer": packed.getvalue()}
    page.get_by_test_id("recording-file").set_input_files(files=[wrong])  # pyright: ignore[reportArgumentType]
    expect(page.get_by_test_id("recorder-problem")).to_contain_text("shopping.zip")
    assert demo.api.get("/recorder/recordings").json() == before
    text = tmp_path / "notes.txt"
    text.write_text("x")
    page.get_by_test_id("recording-file").set_input_files(text)
    expect(page.get_by_test_id("recorder-problem")).to_contain_text("notes.txt is not a .zip file")
    (refused,) = watched.complaints
    assert "422" in refused, "the browser itself says that"
    watched.complaints.clear()


def test_scrubbing_moves_the_plots_and_the_horn(page: Page, demo: Demo, brought: Recorded) -> None:
    angles, commands = brought.samples("current_angle"), brought.samples("command_angle")
    bring(page, demo, brought)
    expect(page.get_by_test_id("replay-band")).to_have_text("Recording, not live")
    shown = page.get_by_test_id("replay-angle")

    assert move(page, "Home") == pytest.approx(brought.content["about"]["started_at"] - zero_of(brought))
    expect(shown).to_have_text("No angle recorded at this time yet")
    expect(shown).to_have_attribute("data-stale", "true")
    shows(page, None)

    first = move(page, "ArrowRight")
    assert first == pytest.approx(angles[0][0]), "to the first sample"
    assert move(page, "ArrowRight", "ArrowRight") == pytest.approx(angles[2][0]), "a sample each"
    assert move(page, "Shift+ArrowRight") == pytest.approx(angles[2][0] + 1), "a second"
    assert move(page, "ArrowLeft") == pytest.approx(max(at for at, _ in angles if at < angles[2][0] + 1))

    # Under way to the second angle: not yet there, its ghost is.
    turned = next(at for at, value in commands if value == MOVES[1])
    page.get_by_test_id("scrub-slider").fill(str(turned + 0.05))
    under_way = [value for at, value in angles if at <= turned + 0.05][-1]
    assert under_way is not None
    expect(shown).to_have_text(re.compile(rf"^{re.escape(degree(under_way))}, command −45\.0°$"))
    shows(page, under_way)
    across = heads(page)
    assert len(across) >= 2
    assert max(x for x, _ in across) - min(x for x, _ in across) < 1.5, "in every plot at the same time"

    assert move(page, "End") == pytest.approx(brought.content["about"]["ended_at"] - zero_of(brought))
    shows(page, [value for _, value in angles if value is not None][-1])
    expect(page.get_by_test_id("scrub-slider")).to_have_attribute(
        "aria-valuetext", re.compile(r"\+\d+\.\d\d.s, 20\d\d-")
    )


def zero_of(recorded: Recorded) -> float:
    return recorded.content["about"]["marks"][0]["at"]


def degree(value: float) -> str:
    return ("" if value == 0 else "+" if value > 0 else "−") + f"{abs(value):.1f}°"


MOMENTS = """() => {
    window.moments = [];
    const line = document.querySelector('[data-testid=scrub]');
    new MutationObserver(() => window.moments?.push([performance.now() / 1000, Number(line.dataset.at)]))
        .observe(line, { attributes: true, attributeFilter: ['data-at'] });
}"""
"""Note the time on the clock of the page of every new position of the time line."""


def pace(page: Page, seconds: float = 1) -> float:
    """Recorded seconds for each second on the clock of the page, from now on; a step of playback is at most 1 s."""
    page.evaluate("() => { window.moments = [] }")
    page.wait_for_function(
        "s => window.moments.length > 0 && window.moments.at(-1)[0] > window.moments[0][0] + s", arg=seconds
    )
    moments = page.evaluate("() => window.moments")
    return (moments[-1][1] - moments[0][1]) / sum(min(1, after - at) for (at, _), (after, _) in pairwise(moments))


def test_playback_takes_the_recorded_time(page: Page, demo: Demo, brought: Recorded) -> None:
    bring(page, demo, brought)
    move(page, "Home")
    page.evaluate(MOMENTS)
    page.get_by_test_id("scrub-play").click()
    assert pace(page) == pytest.approx(1, abs=0.1)
    page.get_by_test_id("scrub-speed").select_option("0.25")
    assert pace(page) == pytest.approx(0.25, abs=0.05)
    page.get_by_test_id("scrub-play").click()
    stood = moment(page)
    page.wait_for_timeout(300)
    assert moment(page) == stood, "it pauses"
    move(page, "End", "Shift+ArrowLeft")
    page.get_by_test_id("scrub-speed").select_option("4")
    page.get_by_test_id("scrub-play").click()
    expect(page.get_by_test_id("scrub-play")).to_have_text("Play")
    assert moment(page) == pytest.approx(brought.content["about"]["ended_at"] - zero_of(brought))


def test_reduced_motion_plays_at_two_frames_per_second(page: Page, demo: Demo, brought: Recorded) -> None:
    page.emulate_media(reduced_motion="reduce")
    bring(page, demo, brought)
    move(page, "Home")
    page.evaluate(MOMENTS)
    page.get_by_test_id("scrub-play").click()
    page.wait_for_function("() => window.moments.length >= 5")
    moments = page.evaluate("() => window.moments.map(one => one[0])")
    assert (moments[-1] - moments[0]) / (len(moments) - 1) > 0.4, moments


def test_scrubbing_sends_nothing_and_later_pages_are_live(page: Page, demo: Demo, brought: Recorded) -> None:
    sent: list[str] = []
    page.on("request", lambda one: sent.append(one.url) if one.method not in ("GET", "HEAD") else None)
    bring(page, demo, brought)
    before = {one["uid"]: (one["command_deg"], one["state"]) for one in demo.api.get("/servos").json()}
    writes = len(demo.api.get("/audit").json())
    sent.clear()
    move(page, "Home", "ArrowRight", "Shift+ArrowRight", "End", "ArrowLeft")
    page.get_by_test_id("scrub-play").click()
    page.wait_for_timeout(1000)
    assert sent == []
    assert len(demo.api.get("/audit").json()) == writes
    assert {one["uid"]: (one["command_deg"], one["state"]) for one in demo.api.get("/servos").json()} == before
    uid = next(iter(before))
    page.goto(f"{demo.url}servos/{uid}/parameters")
    page.locator("[data-testid=view-frame][data-state=shown][data-replay=false]").wait_for()
    expect(page.get_by_test_id("replay-band")).to_have_count(0)


def test_a_file_in_the_plot_drives_the_view_until_closed(
    page: Page, demo: Demo, recorded: Recorded, tmp_path: Path
) -> None:
    uid = uids_of(demo)[0]
    page.goto(f"{demo.url}servos/{uid}/parameters")
    view = page.get_by_test_id("view-frame")
    expect(view).to_have_attribute("data-state", "shown")
    expect(view).to_have_attribute("data-replay", "false")
    file = tmp_path / "arm.csv"
    file.write_bytes(recorded.csv)
    page.get_by_test_id("plot-channels").click()
    page.get_by_test_id("plot-file").set_input_files(file)
    expect(view).to_have_attribute("data-replay", "true")
    expect(page.get_by_test_id("replay-band")).to_be_in_viewport()
    move(page, "End")
    last = [value for _, value in recorded.samples("current_angle") if value is not None][-1]
    shows(page, last)
    expect(page.get_by_test_id("scrub-wall")).to_have_text(re.compile(r"^20\d\d-\d\d-\d\d \d\d:\d\d:\d\d\.\d\d$"))

    page.get_by_test_id("scrub-view").click()
    expect(view).to_have_attribute("data-replay", "false")
    shows(page, demo.api.get(f"/servos/{uid}").json()["angle_deg"])
    page.get_by_test_id("scrub-view").click()
    shows(page, last)
    page.get_by_test_id("plot-close-file").click()
    expect(view).to_have_attribute("data-replay", "false")
    expect(page.get_by_test_id("scrub")).to_have_count(0)
    shows(page, demo.api.get(f"/servos/{uid}").json()["angle_deg"])


def test_the_view_shows_the_servo_while_motion_is_on(
    page: Page, demo: Demo, recorded: Recorded, tmp_path: Path
) -> None:
    uid = uids_of(demo)[0]
    page.goto(f"{demo.url}servos/{uid}/motion")
    file = tmp_path / "arm.csv"
    rows = list(csv.DictReader(recorded.csv.decode().splitlines()))
    kept = ("t_utc", "t_s", "current_angle")
    file.write_text("\n".join([",".join(kept), *(",".join(row[key] for key in kept) for row in rows)]))
    page.get_by_test_id("plot-channels").click()
    page.get_by_test_id("plot-file").set_input_files(file)
    view = page.get_by_test_id("view-frame")
    expect(view).to_have_attribute("data-replay", "true")
    expect(page.get_by_test_id("replay-model")).to_have_text("Model not recorded: shown as BLA21")
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("motion-band")).to_be_visible()
    expect(view).to_have_attribute("data-replay", "false")
    expect(page.get_by_test_id("scrub-note")).to_contain_text("shows the servo, not the recording")
    page.get_by_role("link", name="Records").click()
    no_lease(demo)


def test_a_recording_opened_in_a_plot_is_imported(page: Page, demo: Demo, brought: Recorded) -> None:
    uid = uids_of(demo)[0]
    page.goto(f"{demo.url}servos/{uid}/parameters")
    page.get_by_test_id("plot-channels").click()
    file = {"name": brought.name, "mimeType": "application/zip", "buffer": brought.data}
    page.get_by_test_id("plot-file").set_input_files(files=[file])  # pyright: ignore[reportArgumentType]
    expect(page).to_have_url(re.compile(r"/recorder#" + re.escape(brought.name.removesuffix(".zip"))))
    expect(page.get_by_test_id("recording-why")).to_contain_text("rattled")
