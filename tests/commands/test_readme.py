"""The commands of the README are run, and every guide is written so that its commands can be (`test_guides.py`)."""

import re
from pathlib import Path

from commands.guides import ROOT, WRITTEN, Rig, blocks, guides
from e2e.servers import Server


def test_the_curl_commands_of_the_readme_have_the_commented_results(
    bench: Server, serial: str, uids: list[str], tmp_path: Path
) -> None:
    (block,) = [one for one in blocks(ROOT / "README.md") if "API=" in one.script]
    rig = Rig(bench.url.rstrip("/"), serial)
    out = rig.bash(block.script, tmp_path).replace(": ", ":").replace(", ", ",")
    for expected in (
        '"code":"out_of_range"', '"outcome":"applied"', '"state":"succeeded"', '"settled":true', '"latched":true',
        '"code":"stopped"', '"latched":false',
    ):  # fmt: skip
        assert expected in out, expected
    rows = bench.api.get(f"/servos/{uids[0]}/parameters").json()["parameters"]
    assert rows["angle_limit_cw"]["rom"] == 75.0


def test_every_shell_block_is_run_and_serials_are_replaced() -> None:
    for guide in guides():
        text = guide.read_text(encoding="utf-8")
        found = re.findall(r"^ *```(?:sh|shell|console|zsh)\b.*|^ +```bash", text, re.MULTILINE)
        assert found == [], f"{guide}: write ```bash at the beginning of a line"
        assert set(re.findall(r"\b6[12]-\d{6}\b", text)) <= {WRITTEN}, guide
