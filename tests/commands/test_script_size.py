"""The size of the scripts that a browser fetches first."""

import gzip
import re
from pathlib import Path

DIST = Path(__file__).parents[2] / "web" / "dist"
# Japanese is larger: it compresses less, and contains the names of rows.
FIRST_BYTES = {"en": 60_000, "ja": 63_000}


def packed(path: Path) -> int:
    return len(gzip.compress(path.read_bytes(), 9))


def imported(path: Path) -> list[str]:
    """Scripts that this one imports."""
    return re.findall(r'from"\./([^"]+\.js)"', path.read_text(encoding="utf-8"))


def test_the_first_scripts_are_small_and_other_pages_are_loaded_later() -> None:
    page = (DIST / "index.html").read_text(encoding="utf-8")
    first = set(re.findall(r'(?:src|href)="\.?/(assets/[^"]+\.js)"', page))
    assert first, "the page names no script"
    entry = (DIST / re.findall(r'<script type="module"[^>]* src="\.?/(assets/[^"]+)"', page)[0]).read_text(
        encoding="utf-8"
    )
    for language, limit in FIRST_BYTES.items():
        words = {f"assets/{name}" for name in re.findall(rf"(?<![\w.-]){language}-[\w-]+\.js", entry)}
        assert words, "no script of the language"
        words |= {f"assets/{file}" for name in words for file in imported(DIST / name)}
        weight = sum(packed(DIST / name) for name in first | words)
        assert weight <= limit, f"{weight} bytes of script, gzip, in {language}"
    later = {f"assets/{file.name}" for file in (DIST / "assets").glob("*.js")} - first
    assert [name for name in later if name.startswith("assets/bus-")], "the Bus page is in the first script"
