"""Every line of `make bench` names what it is compared with."""

import ast
from pathlib import Path

BENCH = Path(__file__).parents[1] / "bench"
OPEN = {"load.py", "start.py"}
"""Modules with lines that have none yet."""


def test_every_line_has_a_peer_or_a_limit() -> None:
    without = [
        f"{path.name}:{call.lineno}"
        for path in sorted(BENCH.glob("*.py"))
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "line"
        if path.name not in OPEN and not {"peer", "limit"} & {keyword.arg for keyword in call.keywords}
    ]
    assert without == []
