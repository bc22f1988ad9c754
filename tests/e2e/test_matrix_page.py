"""The matrix: outliers, a cell, a row, a column, the plan, and the results."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from e2e.servers import Demo, running
from e2e.state import add, read, row, turn, uids_of, write

MODEL = "BLA21-06U-A0"


@pytest.fixture(scope="module")
def demo() -> Iterator[Demo]:
    """A demo of this file with four servos of one model, one of them with another gain."""
    with running("demo", "--servos", "1", "--seed", "1") as server:
        add(server, 3, model=MODEL)
        server.ready(4)
        write(server, uids_of(server)[2], "angle_p_gain", 61)
        yield Demo(server.url, server.api)


@pytest.fixture
def uids(demo: Demo) -> list[str]:
    return uids_of(demo)


def test_outliers_of_a_model_are_marked(page: Page, demo: Demo, uids: list[str]) -> None:
    write(demo, uids[1], "angle_p_gain", read(demo, uids[0], "angle_p_gain"))  # another test changes it
    page.goto(f"{demo.url}servos/matrix?uids={','.join(uids)}#angle_p_gain")
    cell = page.get_by_test_id(f"cell-{uids[2]}-angle_p_gain")
    expect(cell).to_have_attribute("data-odd", "outlier")
    expect(cell).to_contain_text("differs")
    expect(page.get_by_test_id(f"cell-{uids[0]}-angle_p_gain")).not_to_contain_text("differs")
    page.get_by_role("button", name="Differ").click()
    expect(page.get_by_test_id("line-angle_p_gain")).to_be_visible()
    expect(page.get_by_test_id("line-smoothing")).to_have_count(0)


def test_cells_are_edited_and_applied_by_keyboard(page: Page, demo: Demo, uids: list[str]) -> None:
    page.goto(f"{demo.url}servos/matrix?uids={','.join(uids)}#angle_p_gain")
    first = page.get_by_test_id(f"cell-{uids[0]}-angle_p_gain")
    expect(first).to_be_focused()
    page.keyboard.press("ArrowRight")
    expect(page.get_by_test_id(f"cell-{uids[1]}-angle_p_gain")).to_be_focused()
    page.keyboard.press("Enter")
    page.keyboard.type("33")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id(f"cell-{uids[1]}-angle_p_gain")).to_be_focused()
    expect(page.get_by_test_id(f"cell-{uids[1]}-angle_p_gain")).to_have_attribute("data-state", "staged")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Enter")
    page.keyboard.type("9999")
    page.keyboard.press("Enter")
    expect(first).to_have_attribute("data-state", "out_of_range")
    expect(page.get_by_test_id("matrix-bar")).to_contain_text("1 change on 1 servo")
    expect(page.get_by_test_id("matrix-bar")).to_contain_text("1 invalid value")

    page.get_by_test_id("matrix-review").click()
    plan = page.get_by_test_id(f"batch-{uids[1]}")
    expect(plan).to_contain_text("33")
    assert row(demo, uids[1], "angle_p_gain")["value"] == 40, "a plan writes nothing"
    page.get_by_test_id("batch-go").click()
    expect(page.get_by_test_id(f"turn-{uids[1]}")).to_have_attribute("data-state", "done")
    assert row(demo, uids[1], "angle_p_gain")["value"] == 33
    page.get_by_test_id("change-close").click()
    page.get_by_test_id("matrix-discard").click()


def test_a_row_is_set_on_all_servos_and_saved(page: Page, demo: Demo, uids: list[str]) -> None:
    # one horn is off 0°, where the restart turns it
    turn(demo, uids[0], 30)
    page.goto(f"{demo.url}servos/matrix?uids={','.join(uids)}")
    page.get_by_test_id("set-angle_d_gain").click()
    page.get_by_test_id("set-value").fill("44")
    page.get_by_test_id("set-go").click()
    expect(page.get_by_test_id("matrix-bar")).to_contain_text("4 changes on 4 servos")
    page.get_by_test_id("matrix-review").click()
    page.get_by_test_id("change-save").check()
    expect(page.get_by_test_id("batch-dialog")).to_contain_text("restarts")
    expect(page.get_by_test_id("batch-go")).to_be_disabled()
    page.get_by_test_id("horn-free").check()
    page.get_by_test_id("batch-go").click()
    for uid in uids:
        expect(page.get_by_test_id(f"turn-{uid}")).to_have_attribute("data-state", "done")
        expect(page.get_by_test_id(f"turn-{uid}")).to_contain_text("read back from ROM")
        assert row(demo, uid, "angle_d_gain")["rom"] == 44
    page.get_by_test_id("change-close").click()


def test_a_column_is_copied_without_identity(page: Page, demo: Demo, uids: list[str]) -> None:
    page.goto(f"{demo.url}servos/matrix?uids={','.join(uids)}")
    page.get_by_test_id(f"copy-{uids[2]}").click()
    page.get_by_test_id("copy-go").click()
    expect(page.get_by_test_id(f"cell-{uids[3]}-angle_p_gain")).to_contain_text("61")
    expect(page.get_by_test_id(f"cell-{uids[3]}-angle_p_gain")).to_have_attribute("data-state", "staged")
    for key in ("servo_id", "node_id", "torque_mode"):
        expect(page.get_by_test_id(f"cell-{uids[3]}-{key}")).not_to_have_attribute("data-state", "staged")
    page.get_by_test_id("matrix-discard").click()
    expect(page.get_by_test_id(f"cell-{uids[3]}-angle_p_gain")).to_contain_text("40")


def test_a_plan_that_could_switch_servos_off_needs_confirmation(page: Page, demo: Demo, uids: list[str]) -> None:
    before = row(demo, uids[0], "voltage_limit_lower")["value"]
    page.goto(f"{demo.url}servos/matrix?uids={','.join(uids[:2])}#voltage_limit_lower")
    page.get_by_test_id("set-voltage_limit_lower").click()
    page.get_by_test_id("set-value").fill("7.2")
    page.get_by_test_id("set-go").click()
    page.get_by_test_id("matrix-review").click()
    dialog = page.get_by_test_id("batch-dialog")
    for uid in uids[:2]:
        expect(page.get_by_test_id(f"batch-{uid}")).to_have_attribute("data-outcome", "rejected")
        expect(page.get_by_test_id(f"batch-{uid}")).to_contain_text("could switch the output off immediately")
    expect(dialog).not_to_contain_text("confirm")
    expect(page.get_by_test_id("batch-go")).to_have_count(0)
    expect(page.get_by_test_id("change-again")).to_be_disabled()
    assert [row(demo, uid, "voltage_limit_lower")["value"] for uid in uids[:2]] == [before, before]

    dialog.get_by_role("checkbox", name="I checked the supply").check()
    page.get_by_test_id("change-again").click()
    expect(page.get_by_test_id("batch-go")).to_be_enabled()
    assert [row(demo, uid, "voltage_limit_lower")["value"] for uid in uids[:2]] == [before, before]
    dialog.get_by_role("checkbox", name="I checked the supply").uncheck()
    expect(page.get_by_test_id("batch-go")).to_have_count(0)
    expect(page.get_by_test_id("change-again")).to_be_disabled()
    dialog.get_by_role("checkbox", name="I checked the supply").check()
    page.get_by_test_id("batch-go").click()
    for uid in uids[:2]:
        expect(page.get_by_test_id(f"turn-{uid}")).to_have_attribute("data-state", "done")
        assert row(demo, uid, "voltage_limit_lower")["value"] == 7.2
        write(demo, uid, "voltage_limit_lower", before)


def test_with_nothing_staged_the_bar_shows_unsaved_values(page: Page, demo: Demo, uids: list[str]) -> None:
    before = read(demo, uids[0], "angle_dead_band")
    write(demo, uids[0], "angle_dead_band", before + 0.5)
    page.goto(f"{demo.url}servos/matrix?uids={uids[0]}#angle_dead_band")
    expect(page.get_by_test_id("matrix-bar")).to_contain_text("in RAM only")
    expect(page.get_by_test_id("matrix-bar")).not_to_contain_text("0 changes")
    write(demo, uids[0], "angle_dead_band", before)


def test_headings_stay_visible_on_a_tablet(page: Page, demo: Demo, uids: list[str]) -> None:
    page.set_viewport_size({"width": 768, "height": 1024})
    page.goto(f"{demo.url}servos/matrix?uids={','.join(uids)}#voltage_limit_lower")
    cell = page.get_by_test_id(f"cell-{uids[0]}-voltage_limit_lower")
    expect(cell).to_be_focused()
    for _ in uids:
        page.keyboard.press("ArrowRight")
    last = page.get_by_test_id(f"cell-{uids[-1]}-voltage_limit_lower")
    expect(last).to_be_in_viewport()
    head = page.get_by_test_id("line-voltage_limit_lower").get_by_role("rowheader")
    expect(head).to_be_in_viewport(ratio=1)
    expect(page.get_by_test_id(f"column-{uids[-1]}")).to_be_in_viewport()
