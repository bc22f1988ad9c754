"""The animated picture of the README: a jog, from screenshots of the real page; part of `make shots`."""

import io
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

from PIL import Image  # noqa: E402
from playwright.sync_api import Page, sync_playwright  # noqa: E402

from e2e.chromium import find  # noqa: E402
from e2e.servers import running  # noqa: E402

PICTURE = Path(__file__).parents[2] / "docs" / "pictures" / "jog.webp"
WIDTH, MOST_BYTES = 960, 1_500_000
PATH = (36.0, -30.0, 0.0)
FRAMES_EACH, APART_MS = 9, 160


def frames(page: Page) -> list[Image.Image]:
    """Screenshots while the horn moves to three angles in turn."""
    found: list[Image.Image] = []
    for angle in PATH:
        page.get_by_test_id("jog-value").fill(f"{angle:g}")
        page.get_by_test_id("jog-go").click()
        for _ in range(FRAMES_EACH):
            shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
            found.append(shot.resize((WIDTH, round(shot.height * WIDTH / shot.width)), Image.Resampling.LANCZOS))
            page.wait_for_timeout(APART_MS)
    return found


def main() -> None:
    """Write docs/pictures/jog.webp."""
    with running("demo", "--servos", "3", "--seed", "2") as server, sync_playwright() as playwright:
        uid = server.ready(3)[0]
        browser = playwright.chromium.launch(executable_path=find(), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1440, "height": 900}, color_scheme="dark")
        page.goto(f"{server.url}servos/{uid}/motion")
        page.get_by_test_id("enable-motion").click()
        page.wait_for_timeout(5000)
        made = frames(page)
        browser.close()
    for quality in (70, 55, 40, 25):
        made[0].save(
            PICTURE, save_all=True, append_images=made[1:], duration=APART_MS + 60, loop=0, quality=quality, method=6
        )
        if PICTURE.stat().st_size <= MOST_BYTES:
            break
    print(f"{PICTURE.name}: {len(made)} frames, {PICTURE.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
