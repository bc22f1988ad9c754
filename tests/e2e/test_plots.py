"""Plots: subscribed channels, pause, cursors, files, recordings, several servos."""

import csv
import re
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from e2e.servers import Demo
from e2e.state import row, servo, sim, uids_of, wait_for, write
from e2e.steps import box

SERVOS = 4
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def uid(demo: Demo) -> str:
    """A servo with a plot."""
    return next(one["uid"] for one in demo.api.get("/servos").json() if one["model"] == "BLA21-12U-A0")


def opened(page: Page, demo: Demo, uid: str, seconds: float = 0) -> Locator:
    """The plot of a servo, after enough samples."""
    page.goto(f"{demo.url}servos/{uid}/parameters")
    plot = page.get_by_test_id("plot-angle")
    plot.locator("canvas").first.wait_for()
    expect(page.get_by_test_id("plot-rate")).to_have_text(re.compile(r"\d+ of 20"))
    page.wait_for_timeout(1000 * seconds)
    return plot


def subscribed(demo: Demo, uid: str) -> set[str]:
    subscriptions = demo.api.get(f"/servos/{uid}/telemetry").json()["subscriptions"]
    return {key for one in subscriptions for key in one["channels"]}


SEEN = """one => {
    one.scrollIntoView({ block: "center" });
    const { x, y, width, height } = one.getBoundingClientRect();
    return one.contains(document.elementFromPoint(x + width / 2, y + height / 2));
}"""


def drag(page: Page, plot: Locator, start: float, end: float) -> None:
    """A point over the first lane that nothing covers."""
    lanes = plot.locator(".u-over")
    wait_for(lambda: any(one.evaluate(SEEN) for one in lanes.all()), "every lane is covered")
    face = box(next(one for one in lanes.all() if one.evaluate(SEEN)))
    y = face["y"] + face["height"] / 2
    page.mouse.move(face["x"] + face["width"] * start, y)
    page.mouse.down()
    page.mouse.move(face["x"] + face["width"] * end, y, steps=6)
    page.mouse.up()


def test_a_selected_channel_is_plotted_and_polled_until_the_page_is_left(page: Page, demo: Demo, uid: str) -> None:
    plot = opened(page, demo, uid)
    expect(plot).to_have_attribute("data-lanes", "1")
    page.get_by_test_id("plot-channels").click()
    page.get_by_test_id("plot-channel-command_torque").check()
    expect(plot).to_have_attribute("data-lanes", "2")
    wait_for(lambda: "command_torque" in subscribed(demo, uid), "the channel is not subscribed")
    page.get_by_test_id("plot-hz").select_option("50")
    expect(page.get_by_test_id("plot-rate")).to_have_text(re.compile(r"\d+ of 50"))
    page.get_by_test_id("plot-channel-command_torque").uncheck()
    page.get_by_test_id("plot-hz").select_option("20")
    expect(plot).to_have_attribute("data-lanes", "1")
    wait_for(lambda: "command_torque" not in subscribed(demo, uid), "the channel is not unsubscribed")
    page.get_by_role("link", name="Records").click()
    wait_for(lambda: "current_speed" not in subscribed(demo, uid), "leaving does not unsubscribe")


def test_dragging_zooms_and_the_export_contains_the_visible_part(page: Page, demo: Demo, uid: str) -> None:
    plot = opened(page, demo, uid, seconds=3)
    expect(page.get_by_test_id("plot-live")).to_have_count(0)
    drag(page, plot, 0.8, 0.6)
    expect(page.get_by_test_id("plot-live")).to_have_text("Back to live")
    with page.expect_download() as kept:
        page.get_by_test_id("plot-csv").click()
    assert re.fullmatch(r"hornbill-[\w.-]+-\d{4}-\d\d-\d\d-\d{6}\.csv", kept.value.suggested_filename)
    rows = list(csv.DictReader(Path(kept.value.path()).read_text(encoding="utf-8").splitlines()))
    times = [float(row["t_s"]) for row in rows]
    assert list(rows[0]) == ["t_utc", "t_s", "current_angle", "command_angle"]
    assert times == sorted(times)
    assert 1 < times[-1] - times[0] <= 2.1, "a fifth of ten seconds was chosen; a busy server may sample less"
    with page.expect_download() as kept:
        page.get_by_test_id("plot-png").click()
    assert kept.value.suggested_filename.endswith(".png")
    assert Path(kept.value.path()).read_bytes().startswith(PNG)
    page.get_by_test_id("plot-live").click()
    expect(page.get_by_test_id("plot-live")).to_have_count(0)
    page.get_by_test_id("plot-window").select_option("300")
    page.get_by_test_id("plot-pause").click()
    expect(page.get_by_test_id("plot-live")).to_be_visible()


@pytest.mark.release
def test_cursors_are_placed_by_pointer_and_moved_by_keys(page: Page, demo: Demo, uid: str) -> None:
    plot = opened(page, demo, uid, seconds=3)
    face = plot.locator(".u-over").first
    width = box(face)["width"]
    face.click(position={"x": width * 0.75, "y": 30})
    first = page.get_by_test_id("plot-cursor-A")
    expect(first).to_be_visible()
    face.click(position={"x": width * 0.95, "y": 30})
    last = page.get_by_test_id("plot-cursor-B")
    expect(last).to_be_visible()
    apart = float(last.get_attribute("aria-valuenow") or "nan") - float(first.get_attribute("aria-valuenow") or "nan")
    assert 0 < apart < 5, "a fifth of ten seconds, at the next samples: fewer on a busy machine"
    shown = re.search(r"Δt \+([\d.]+)", page.get_by_test_id("plot-delta-t").inner_text())
    assert shown is not None
    assert float(shown[1]) == pytest.approx(apart, abs=0.06)
    expect(page.get_by_test_id("plot-delta-current_angle")).to_contain_text("°")
    before = float(first.get_attribute("aria-valuenow") or "nan")
    first.focus()
    first.press("ArrowRight")
    first.press("ArrowRight")
    after = float(first.get_attribute("aria-valuenow") or "nan")
    assert 0.02 < after - before < 5, "two samples of at most 20 Hz, less on a busy machine"
    first.press("Home")
    expect(first).to_have_attribute("aria-valuenow", "-10")
    page.get_by_test_id("plot-zoom-cursors").click()
    page.get_by_test_id("plot-live").click()
    expect(first).to_have_count(0)
    # without a pointer
    page.get_by_test_id("plot-cursors-button").press("Enter")
    expect(page.get_by_test_id("plot-cursor-B")).to_be_visible()


@pytest.mark.release
def test_a_recording_is_opened_from_disk_and_another_file_rejected(
    page: Page, demo: Demo, uid: str, tmp_path: Path
) -> None:
    opened(page, demo, uid)
    page.get_by_test_id("plot-channels").click()
    wrong = tmp_path / "shopping.csv"
    wrong.write_text("what,how many\nbread,2\n")
    page.get_by_test_id("plot-file").set_input_files(wrong)
    expect(page.get_by_test_id("plot-file-problem")).to_contain_text("not a telemetry.csv")
    right = tmp_path / "telemetry.csv"
    right.write_bytes(demo.api.get(f"/servos/{uid}/telemetry.csv", params={"seconds": 5}).content)
    page.get_by_test_id("plot-file").set_input_files(right)
    plot = page.get_by_test_id("plot-recording")
    plot.locator("canvas").first.wait_for()
    assert int(plot.get_attribute("data-lanes") or 0) >= 4
    expect(page.get_by_test_id("plot-live")).to_have_count(0)
    drag(page, plot, 0.2, 0.6)
    expect(page.get_by_test_id("plot-live")).to_have_text("Show all")
    page.get_by_test_id("plot-close-file").click()
    expect(page.get_by_test_id("plot-angle")).to_be_visible()


HEADS = """canvas => {
    const ratio = devicePixelRatio, high = Math.round(12 * ratio), left = Math.round(60 * ratio);
    const copy = document.createElement('canvas');
    const context = copy.getContext('2d', { willReadFrequently: true });
    copy.width = canvas.width - left;
    copy.height = high;
    context.drawImage(canvas, -left, 0);
    const { data, width } = context.getImageData(0, 0, copy.width, high);
    const columns = new Set();
    for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 120) columns.add((i / 4) % width);
    return columns.size;
}"""
"""Number of columns with marks or their texts in the strip above a lane, right of its axis."""


def heads(plot: Locator) -> int:
    return plot.locator(".plot-lane canvas").first.evaluate(HEADS)


@pytest.mark.release
def test_writes_and_faults_are_marked_in_the_plot(page: Page, demo: Demo, uid: str) -> None:
    """A mark alone is 8 columns wide; its word, "fault", makes it 15 to 17 (a write's is longer)."""
    plot = opened(page, demo, uid)
    page.get_by_test_id("plot-window").select_option("5")

    def marked(columns: int) -> None:
        wait_for(lambda: heads(plot) > columns, "it is not marked, or by no word")
        wait_for(lambda: heads(plot) == 0, "its mark stays")

    wait_for(lambda: heads(plot) == 0, "something before is still marked")
    held = row(demo, uid, "angle_p_gain")["value"]
    for value in (held - 1, held):
        write(demo, uid, "angle_p_gain", value)
    marked(20)
    other = next(one for one in uids_of(demo) if one != uid)
    write(demo, other, "angle_p_gain", row(demo, other, "angle_p_gain")["value"])
    page.wait_for_timeout(2500)
    assert heads(plot) == 0, "the write of another servo"
    for on in (True, False):
        sim(demo, uid, faults={"temperature_high": on})
        marked(11)


def test_several_servos_share_a_plot_with_own_subscriptions(page: Page, demo: Demo) -> None:
    uids = uids_of(demo)
    names = [servo(demo, uid)["label"] or servo(demo, uid)["serial"] for uid in uids]
    page.goto(demo.url + "servos")
    for each in uids[:3]:
        page.get_by_test_id(f"select-{each}").check()
    page.get_by_test_id("plot-selected").click()
    plot = page.get_by_test_id("plot-many")
    plot.locator("canvas").wait_for()
    expect(page.get_by_test_id("plot-rate")).to_have_text(re.compile(r"\d+ of 50"))
    curves = page.get_by_role("list", name="Curves").get_by_role("listitem")
    expect(curves).to_have_text(names[:3])
    page.get_by_test_id("many-commands").check()
    expect(curves, "a command has the colour of its servo and no line of its own").to_have_count(3)
    page.get_by_test_id(f"many-{uids[1]}").click()
    expect(page.get_by_test_id(f"many-{uids[1]}")).to_have_attribute("aria-pressed", "true")
    page.get_by_test_id("many-channel").select_option("current_voltage")
    wait_for(lambda: all("current_voltage" in subscribed(demo, one) for one in uids[:3]), "a servo is not polled")
    page.get_by_test_id(f"select-{uids[0]}").uncheck()
    expect(curves).to_have_text(names[1:3])
    page.get_by_test_id(f"select-{uids[3]}").check()
    expect(curves).to_have_count(3)
    page.get_by_test_id("plot-selected").click()
    expect(plot).to_have_count(0)
    wait_for(lambda: not any("current_voltage" in subscribed(demo, one) for one in uids), "not unsubscribed")
