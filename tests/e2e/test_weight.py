"""What a browser has to fetch before the page is there."""

import gzip
import re
from pathlib import Path

DIST = Path(__file__).parents[2] / "web" / "dist"
FIRST_BYTES = 80_000


def packed(path: Path) -> int:
    return len(gzip.compress(path.read_bytes(), 9))


def test_the_first_script_stays_within_80_kb_and_brings_no_page_that_is_fetched_later() -> None:
    page = (DIST / "index.html").read_text(encoding="utf-8")
    first = set(re.findall(r'(?:src|href)="\.?/(assets/[^"]+\.js)"', page))
    assert first, "the page names no script"
    entry = (DIST / re.findall(r'<script type="module"[^>]* src="\.?/(assets/[^"]+)"', page)[0]).read_text(
        encoding="utf-8"
    )
    languages = {f"assets/{name}" for name in re.findall(r"(?<![\w.-])(?:en|ja)-[\w-]+\.js", entry)}
    assert languages, "the language is fetched besides, and counts"
    weight = sum(packed(DIST / name) for name in first) + max(packed(DIST / name) for name in languages)
    assert weight <= FIRST_BYTES, f"{weight} bytes of script, gzip"
    later = {f"assets/{file.name}" for file in (DIST / "assets").glob("*.js")} - first
    assert [name for name in later if name.startswith("assets/bus-")], "the Bus page comes with the first script"
