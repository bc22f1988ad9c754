"""Owns `make shots`: the pictures of README and docs, taken from the real page with simulated servos."""

import sys
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

import httpx  # noqa: E402
from playwright.sync_api import Page, sync_playwright  # noqa: E402

from e2e.chromium import find  # noqa: E402
from e2e.conftest import running_demo  # noqa: E402

PICTURES = Path(__file__).parents[2] / "docs" / "pictures"
LABELS = ("Elevator L", "Antenna arm", "Throttle", "Gripper", "Rudder", "Spare, new")
WIDE, TABLET = {"width": 1440, "height": 900}, {"width": 820, "height": 1180}


def servos(page: Page, url: str, _uid: str) -> None:
    """The list."""
    page.goto(url + "servos")
    page.wait_for_timeout(2500)


def parameters(page: Page, url: str, uid: str) -> None:
    """Limits, some staged and one refused."""
    page.goto(f"{url}servos/{uid}/parameters#angle_limit_cw")
    for key, text in (("angle_limit_cw", "75"), ("temperature_limit_upper", "70"), ("torque_limit_cw", "120")):
        box = page.get_by_test_id(f"input-{key}")
        box.fill(text)
        box.press("Enter")
    page.keyboard.press("Tab")
    page.wait_for_timeout(9000)


def motion(page: Page, url: str, uid: str) -> None:
    """A jog."""
    page.goto(f"{url}servos/{uid}/motion")
    page.get_by_test_id("enable-motion").click()
    page.wait_for_timeout(4000)
    page.get_by_test_id("jog-value").fill("36")
    page.get_by_test_id("jog-go").click()
    page.wait_for_timeout(3000)


def bus(page: Page, url: str, _uid: str) -> None:
    """Load that rises to its limit as every servo is polled fast, and what that looks like in the monitor."""
    fast = {"channels": ["current_angle", "current_speed", "current_torque"], "rate_hz": 50}
    with httpx.Client(base_url=url + "api/v1", timeout=60) as api:
        uids = [one["uid"] for one in api.get("/servos").json()]
        page.goto(url + "bus")
        page.wait_for_timeout(22_000)
        for each in uids:
            api.put(f"/servos/{each}/telemetry", json=fast)
        page.wait_for_timeout(20_000)
        for each in uids:
            api.put(f"/servos/{each}/telemetry", json={"channels": [], "rate_hz": 1})


def main() -> None:
    """Every page, or those named, in both themes, wide; and as a tablet shows it, in one."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    scenes = [
        scene for scene in (servos, parameters, motion, bus) if scene.__name__ in sys.argv[1:] or not sys.argv[1:]
    ]
    with running_demo("--seed", "1") as (_, url), sync_playwright() as playwright:
        api = httpx.Client(base_url=url + "api/v1")
        while sum(one["state"] == "ready" for one in api.get("/servos").json()) < 6:
            time.sleep(0.2)
        for one, label in zip(api.get("/servos").json(), LABELS, strict=True):
            api.patch(f"/servos/{one['uid']}", json={"label": label})
        uid = next(one["uid"] for one in api.get("/servos").json() if one["label"] == "Elevator L")
        browser = playwright.chromium.launch(executable_path=find(), args=["--no-sandbox"])
        for theme, size, suffix in (("dark", WIDE, ""), ("light", WIDE, ""), ("light", TABLET, "-tablet")):
            for scene in scenes:
                context = browser.new_context(
                    viewport=size,  # pyright: ignore[reportArgumentType]
                    color_scheme=theme,  # pyright: ignore[reportArgumentType]
                    has_touch=size is TABLET,
                )
                page = context.new_page()
                scene(page, url, uid)
                name = f"{scene.__name__}-{theme}{suffix}.png"
                page.screenshot(path=PICTURES / name, timeout=60_000)
                sys.stdout.write(f"docs/pictures/{name}\n")
                context.close()
        browser.close()
        api.close()


if __name__ == "__main__":
    main()
