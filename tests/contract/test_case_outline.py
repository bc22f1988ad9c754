"""The case that the page draws below a horn has the dimensions of the 3D view."""

import re
from pathlib import Path

import pytest

from hornbill.view.case import CASES, Case

PAGE = Path(__file__).parents[2] / "web/src/servo/case-outline.tsx"
NAMES = {
    "back": "back", "front": "front", "halfWidth": "half_width", "corner": "corner", "ear": "ear",
    "earHalfWidth": "ear_half_width", "hole": "hole", "boss": "boss",
}  # fmt: skip


@pytest.mark.parametrize("case", [one for one in CASES if one.key != "plain"], ids=lambda one: one.key)
def test_the_page_draws_the_same_case(case: Case) -> None:
    key = case.key.upper()
    (drawn,) = re.findall(rf"const {key}: Case = {{(.*?)}};", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    sizes = {name: float(value) for name, value in re.findall(r"(\w+): (-?[\d.]+),", drawn)}
    assert sizes == {ts: getattr(case, py) for ts, py in NAMES.items()}
    (holes,) = re.findall(r"holeY: \[(.*?)\]", drawn)
    assert [float(one) for one in holes.split(",")] == list(case.hole_y)
