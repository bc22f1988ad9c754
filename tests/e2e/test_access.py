"""Accessibility: axe on every page in both themes, touch targets, and the keyboard alone."""

import re
import time

import pytest
from playwright.sync_api import Page, expect

from e2e.cases import cases
from e2e.looks import complaints, loading, still, too_small
from e2e.servers import Demo
from e2e.state import WAIT_S, latched, read, servo_of, wait_for, write
from e2e.steps import chord

PAGES = (
    "servos",
    "servos/matrix",
    "commission",
    "servos/{uid}",
    "servos/{uid}/parameters",
    "servos/{uid}/motion",
    "servos/{uid}/tune",
    "faults",
    "scope?ch={uid}:current_angle,command_angle",
    "bus",
    "bus#nodes",
    "bus#ids",
    "records#snapshots",
    "records#snapshots/{uid}",
    "records#profiles",
    "records#reports",
    "recorder",
    "records#audit",
    "api-page",
)
"""Every page, and every part with its own link."""
MAIN = (
    "servos",
    "servos/{uid}",
    "servos/{uid}/parameters",
    "servos/{uid}/motion",
    "servos/{uid}/tune",
    "bus",
    "commission",
)
"""Pages of most work."""
SCENE = "servos/{uid}/parameters"
"""A page with a 3D view, checked in a Chromium with 3D."""

DIALOGS = (
    ("servos", "keys", "keys-dialog"),
    ("bus", "bus-disconnect", None),
    pytest.param("bus", "bus-change", None, marks=pytest.mark.release),
    pytest.param("bus", "bus-log", None, marks=pytest.mark.release),
    pytest.param("records#profiles", "profile-create", None, marks=pytest.mark.release),
    pytest.param("records#profiles", "profile-import", None, marks=pytest.mark.release),
)
"""Pages, and the button that opens a dialog there."""

TABLET = {"width": 820, "height": 1180}


def show(page: Page, demo: Demo, path: str) -> None:
    page.goto("about:blank")  # a link to another part of the same page would not reload it
    uid = servo_of(demo, "BLA21-12U-A0")
    with loading(page):
        page.goto(demo.url + path.format(uid=uid))
        expect(page.get_by_test_id("live-state")).to_have_attribute("data-state", "up")
        expect(page.locator("main h1").first).to_be_visible()


def touch(page: Page) -> None:
    """A tablet in portrait orientation, with touch."""
    page.set_viewport_size({"width": TABLET["width"], "height": TABLET["height"]})
    page.context.new_cdp_session(page).send("Emulation.setTouchEmulationEnabled", {"enabled": True})


RINGED = """() => {
    window.unseen = [];
    const ringed = (node, part = null) => {
        const style = getComputedStyle(node, part);
        return style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2;
    };
    const seen = one => {
        if (one.tagName === 'IFRAME') return true;  // the 3D view shows its own
        for (let node = one; node && node !== document.body; node = node.parentElement)
            if (ringed(node) && (node === one || node.matches(':focus-within'))) return true;
        if (ringed(one, '::after')) return true;  // the link of a row rings the row
        return Boolean(one.nextElementSibling && ringed(one.nextElementSibling));
    };
    window.focused = 0;
    document.addEventListener('focusin', () => {
        window.focused += 1;
        if (!seen(document.activeElement)) window.unseen.push(document.activeElement.outerHTML.slice(0, 120));
    });
}"""
"""Record every element that gets the focus without a visible ring."""


@pytest.mark.parametrize("path", cases(PAGES, usual=MAIN, scene=(SCENE,)))
def test_every_page_passes_axe_and_shows_the_focus(page: Page, demo: Demo, path: str) -> None:
    page.emulate_media(color_scheme="light", reduced_motion="reduce")
    show(page, demo, path)
    assert complaints(page) == [], "light, wide"
    page.emulate_media(color_scheme="dark", reduced_motion="reduce")
    assert complaints(page, "color-contrast") == [], "dark, wide: a theme is colours"

    page.evaluate(RINGED)
    for _ in range(25):
        page.keyboard.press("Tab")
    assert page.evaluate("() => window.unseen") == []
    assert page.evaluate("() => window.focused") > 5, "Tab leads nowhere"
    page.evaluate("() => document.activeElement.blur()")

    touch(page)
    still(page)
    assert complaints(page, without=("color-contrast",)) == [], "tablet"
    assert "\n".join(too_small(page)) == ""
    assert page.evaluate("() => document.documentElement.scrollWidth") <= TABLET["width"]


@pytest.mark.parametrize(("path", "opens", "dialog"), DIALOGS)
def test_a_dialog_has_a_name_traps_and_returns_the_focus(
    page: Page, demo: Demo, path: str, opens: str, dialog: str | None
) -> None:
    page.emulate_media(color_scheme="light", reduced_motion="reduce")
    show(page, demo, path)
    page.get_by_test_id(opens).focus()
    page.keyboard.press("Enter")
    box = page.get_by_test_id(dialog) if dialog else page.get_by_role("dialog")
    with loading(page):
        expect(box).to_be_visible()
    assert complaints(page) == [], "light"
    page.emulate_media(color_scheme="dark", reduced_motion="reduce")
    assert complaints(page, "color-contrast") == [], "dark"
    stops = box.evaluate("box => box.querySelectorAll('button, input, select, textarea, a, [tabindex]').length")
    for _ in range(stops + 2):
        page.keyboard.press("Tab")
        assert box.evaluate("box => box.contains(document.activeElement)"), "the focus left the dialog"
    page.keyboard.press("Shift+Tab")
    assert box.evaluate("box => box.contains(document.activeElement)")
    touch(page)
    still(page)
    assert "\n".join(too_small(page)) == ""
    box.get_by_role("button", name=re.compile("Close|Cancel|Keep")).last.click()
    expect(box).to_have_count(0)
    expect(page.get_by_test_id(opens)).to_be_focused()


def test_the_first_tab_skips_bar_and_rail(page: Page, demo: Demo) -> None:
    show(page, demo, "servos")
    page.keyboard.press("Tab")
    skip = page.get_by_role("button", name="Skip to content")
    expect(skip).to_be_focused()
    expect(skip).to_be_in_viewport()
    page.keyboard.press("Enter")
    expect(page.locator("main")).to_be_focused()
    page.keyboard.press("Tab")
    assert page.evaluate("() => document.querySelector('main').contains(document.activeElement)")


def test_every_page_has_a_two_key_shortcut_and_a_title(page: Page, demo: Demo) -> None:
    show(page, demo, "servos")
    for letter, path, name in (
        ("c", "/commission", "Commission"),
        ("v", "/servos/[0-9a-f]{32}", "Overview, "),
        ("p", "/parameters", "Parameters, "),
        ("m", "/motion", "Motion, "),
        ("t", "/tune", "Tune, "),
        ("f", "/faults", "Faults"),
        ("b", "/bus", "Bus"),
        ("r", "/records", "Records"),
        ("o", r"/scope(\?ch=.*)?", "Scope"),
        ("a", "/api-page", "API"),
        ("e", "/servos/matrix", "Matrix"),
        ("s", "/servos", "Servos"),
    ):
        chord(page, "g", letter)
        expect(page).to_have_url(re.compile(f"{path}$"))
        expect(page).to_have_title(re.compile(f"^{name}"))
        expect(page.locator("main h1").first).to_be_visible()
        expect(page.locator("main")).to_be_focused()


def test_the_list_of_keys_matches_the_page(page: Page, demo: Demo) -> None:
    show(page, demo, "servos/{uid}/parameters")
    page.keyboard.press("?")
    keys = page.get_by_test_id("keys-dialog")
    expect(keys).to_contain_text("Nothing is written before you confirm")
    for word in ("Commission", "Records", "API", "Stop"):
        expect(keys).to_contain_text(word)
    expect(keys.get_by_role("button", name="Close")).to_be_focused()
    page.keyboard.press("Enter")
    expect(keys).to_have_count(0)
    chord(page, "g", "f")
    page.keyboard.press("?")
    expect(keys).to_be_visible()
    expect(keys).not_to_contain_text("Nothing is written before you confirm")


def tab_to(page: Page, testid: str) -> None:
    """Press Tab until the control has the focus; start over while it is not yet enabled."""
    until = time.monotonic() + WAIT_S
    while page.evaluate("() => document.activeElement?.dataset.testid ?? ''") != testid:
        assert time.monotonic() < until, f"{testid} is not reached with Tab"
        page.keyboard.press("Tab")


def test_keyboard_alone_changes_a_limit_jogs_and_stops(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    before = read(demo, uid, "temperature_limit_upper")
    wanted = before - 1
    show(page, demo, "servos")
    for _ in range(300):  # the row of this servo, by Tab
        if uid in page.evaluate("() => document.activeElement?.getAttribute('href') ?? ''"):
            break
        page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile(f"/servos/{uid}$"))
    tab_to(page, "servo-tab-parameters")
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile(f"/servos/{uid}/parameters"))
    expect(page.get_by_role("searchbox")).to_be_visible()
    page.keyboard.press("/")
    page.keyboard.type("temperature")
    tab_to(page, "input-temperature_limit_upper")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("row-temperature_limit_upper")).to_have_attribute("data-state", "staged")
    tab_to(page, "apply")
    page.keyboard.press("Enter")

    wait_for(lambda: read(demo, uid, "temperature_limit_upper") == wanted, "the limit is not written")
    write(demo, uid, "temperature_limit_upper", before)

    page.locator("h1").first.evaluate("one => document.activeElement.blur()")
    chord(page, "g", "m")
    tab_to(page, "enable-motion")
    page.keyboard.press("Enter")
    tab_to(page, "jog-value")
    page.keyboard.press("Control+a")
    page.keyboard.type("12")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("jog-go")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("jog-angle")).to_contain_text(re.compile(r"\+1[12]\.\d°"))
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("stop-band")).to_be_visible()
    wait_for(lambda: latched(demo), "Esc did not stop")
    tab_to(page, "clear-stop")
    page.keyboard.press("Enter")
    tab_to(page, "confirm-clear")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("stop-band")).to_have_count(0)


@pytest.mark.release
def test_reduced_motion_disables_animations(page: Page, demo: Demo) -> None:
    page.emulate_media(reduced_motion="reduce")
    for path in ("servos", "bus", "servos/{uid}/parameters"):
        show(page, demo, path)
        moving = page.evaluate(
            """() => document.getAnimations().filter(one => one.effect.getTiming().iterations === Infinity).length"""
        )
        assert moving == 0


def test_forced_colors_still_mark_the_selected_page_and_segment(page: Page, demo: Demo) -> None:
    page.emulate_media(forced_colors="active")
    show(page, demo, "records#profiles")
    colours = page.evaluate(
        """() => [...document.querySelectorAll('.page-head .segments > *')]
            .map(one => [one.getAttribute('aria-pressed'), getComputedStyle(one).backgroundColor])"""
    )
    chosen = {colour for pressed, colour in colours if pressed == "true"}
    assert chosen
    assert not chosen & {colour for pressed, colour in colours if pressed != "true"}
    edge = page.locator('.rail-item[aria-current="page"]').evaluate("one => getComputedStyle(one).borderLeftColor")
    assert edge != page.locator(".rail-item").first.evaluate("one => getComputedStyle(one).borderLeftColor")
