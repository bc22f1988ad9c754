"""Every command of every guide is run, each guide from top to bottom in one shell."""

import re
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from commands.guides import ENDLESS, NEEDS, ROOT, WRITTEN, Block, Rig, blocks, guides
from e2e.servers import Server, as_in_rom, running

PAGES = [file for file in guides() if any(not one.marks for one in blocks(file))]
MARKED = [one for file in guides() for one in blocks(file) if one.marks]
NO_HARDWARE = "needs hardware"


@pytest.fixture(scope="module")
def shared() -> Iterator[Server]:
    """One demo for all guides, which may change values in ROM."""
    with running("demo", "--servos", "3", "--seed", "3") as server:
        server.ready(3)
        yield server


@pytest.fixture
def bench(shared: Server) -> Iterator[Server]:
    """The demo without stop, leases or unsaved values of the previous guide."""
    shared.ready(3)
    for one in shared.servos():
        as_in_rom(shared.api, str(one["uid"]))
    yield shared
    shared.api.delete("/stop")
    for lease in shared.api.get("/leases").json():
        shared.api.delete(f"/leases/{lease['id']}")


@pytest.mark.parametrize("guide", PAGES, ids=lambda file: str(file.relative_to(ROOT)))
def test_the_commands_of_a_guide_run_from_top_to_bottom(bench: Server, tmp_path: Path, guide: Path) -> None:
    serial = str(bench.servos()[0]["serial"])
    run = [one for one in blocks(guide) if not one.marks]
    script = "\n".join(f"echo '== {one}' >&2\n{one.script}" for one in run)
    (tmp_path / "bench.toml").touch()
    Rig(bench.url.rstrip("/"), serial).bash(script, tmp_path)


@pytest.mark.parametrize("block", MARKED, ids=str)
def test_a_marked_command_has_a_known_mark_or_starts_and_ends(tmp_path: Path, block: Block) -> None:
    assert set(block.marks) <= {*NEEDS, ENDLESS}, f"{block}: say one of {NEEDS} or {ENDLESS}"
    if block.needs:
        pytest.skip(f"{block}: {block.needs}: {block.script.strip().splitlines()[-1]}")
    command = block.script.replace(f"# {ENDLESS}\n", "exec ").strip()
    (tmp_path / "morning.log").write_text("(1700000000.000000) can0 1001550B#0000000000000000\n")
    environment = {**Rig("", "").environment, "HORNBILL_PORT": "0", "HORNBILL_DATA_DIR": str(tmp_path / "data")}
    del environment["HORNBILL_URL"]
    with subprocess.Popen(
        ["bash", "-c", command], stdout=subprocess.PIPE, text=True, env=environment, cwd=tmp_path
    ) as process:
        assert process.stdout is not None
        try:
            assert "http://" in process.stdout.readline(), command
        finally:
            process.send_signal(signal.SIGINT)
        assert process.wait(timeout=15) == 0


def test_the_curl_commands_of_the_readme_have_the_commented_results(bench: Server, tmp_path: Path) -> None:
    (block,) = [one for one in blocks(ROOT / "README.md") if "API=" in one.script]
    rig = Rig(bench.url.rstrip("/"), str(bench.servos()[0]["serial"]))
    out = rig.bash(block.script, tmp_path).replace(": ", ":").replace(", ", ",")
    for expected in (
        '"code":"out_of_range"', '"outcome":"applied"', '"state":"succeeded"', '"settled":true', '"latched":true',
        '"code":"stopped"', '"latched":false',
    ):  # fmt: skip
        assert expected in out, expected
    uid = bench.servos()[0]["uid"]
    rows = bench.api.get(f"/servos/{uid}/parameters").json()["parameters"]
    assert rows["angle_limit_cw"]["rom"] == 75.0


def test_every_shell_block_is_run_and_serials_are_replaced() -> None:
    for guide in guides():
        text = guide.read_text(encoding="utf-8")
        found = re.findall(r"^ *```(?:sh|shell|console|zsh)\b.*|^ +```bash", text, re.MULTILINE)
        assert found == [], f"{guide}: write ```bash at the beginning of a line"
        assert set(re.findall(r"\b6[12]-\d{6}\b", text)) <= {WRITTEN}, guide
