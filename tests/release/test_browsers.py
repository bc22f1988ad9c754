"""Main workflow in Firefox, and in WebKit as in a tablet's Safari."""

from collections.abc import Iterator

import pytest

from e2e.servers import Server, running, until
from release import browsers
from release.browsers import Window


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    """One demo with its six servos ready."""
    with running("demo", "--servos", "6", "--seed", "1") as one:
        one.ready(6, within_s=60)
        yield one


@pytest.mark.parametrize("name", ["firefox", "webkit"])
def test_a_servo_is_found_changed_saved_moved_and_stopped(name: str, server: Server) -> None:
    if lacking := browsers.missing(name):
        pytest.skip(lacking)
    with browsers.opened(name) as window:
        everyone = server.servos()
        uid = next(str(one["uid"]) for one in everyone if one["model"] == "BLA21-12U-A0")
        window.go(server.url)
        for one in everyone:
            window.find(f"servo-row-{one['uid']}")
            window.text(f"servo-row-{one['uid']}", "°")

        # a limit is changed, written and saved
        _limit_is_saved(window, server, uid)

        # the horn moves with motion control, and Esc stops it
        window.go(f"{server.url}servos/{uid}/motion")
        window.click("enable-motion")
        window.find("motion-band")
        window.fill("jog-value", "30")
        window.click("jog-go")
        until(lambda: abs(_angle(server, uid) - 30) < 1.5, 10, "the horn does not reach 30°")
        window.text("jog-angle", "30")
        window.press(browsers.ESCAPE)
        window.find("stop-band")
        assert server.api.get("/stop").json()["latched"]
        until(lambda: _value(server, uid, "torque_mode") == "off", 5, "torque stays on")
        window.click("clear-stop")
        window.click("confirm-clear")
        window.wait("!document.querySelector('[data-testid=\"stop-band\"]')")
        assert window.complaints() == []


def _limit_is_saved(window: Window, server: Server, uid: str) -> None:
    wanted = 75 if _value(server, uid, "angle_limit_cw") != 75 else 70
    window.go(f"{server.url}servos/{uid}/parameters#angle_limit_cw")
    window.fill("input-angle_limit_cw", str(wanted))
    window.find("row-angle_limit_cw", 'one.dataset.state === "staged"')
    assert _value(server, uid, "angle_limit_cw") != wanted, "a staged value is not sent"
    window.click("apply")
    window.find("row-angle_limit_cw", 'one.dataset.state === "applied"')
    window.click("apply-save")
    window.find("save-dialog")
    if window.evaluate("document.querySelector('[data-testid=\"horn-free\"]') !== null"):
        window.click("horn-free")
    window.click("save-go")
    window.find("step-read_back", 'one.dataset.state === "done"')
    window.click("change-close")
    row = server.api.get(f"/servos/{uid}/parameters").json()["parameters"]["angle_limit_cw"]
    assert (row["value"], row["rom"]) == (wanted, wanted)


def _value(server: Server, uid: str, key: str) -> object:
    return server.api.get(f"/servos/{uid}/parameters/{key}").json()["value"]


def _angle(server: Server, uid: str) -> float:
    return float(server.api.get(f"/servos/{uid}").json()["angle_deg"] or 0)
