"""Every command of every guide is run, each guide from top to bottom in one shell."""

import re
import signal
import subprocess
from pathlib import Path

import pytest

from commands.guides import ENDLESS, NEEDS, ROOT, Block, Rig, blocks, guides
from e2e.servers import Server

PAGES = [file for file in guides() if any(not one.marks for one in blocks(file))]
MARKED = [one for file in guides() for one in blocks(file) if one.marks]
pytestmark = pytest.mark.release  # `contract/test_doc_references.py` checks each command in `make test`
NO_HARDWARE = "needs hardware"


@pytest.mark.parametrize("guide", PAGES, ids=lambda file: str(file.relative_to(ROOT)))
def test_the_commands_of_a_guide_run_from_top_to_bottom(
    bench: Server, serial: str, tmp_path: Path, guide: Path
) -> None:
    run = [one for one in blocks(guide) if not one.marks]
    script = "\n".join(f"echo '== {one}' >&2\n{one.script}" for one in run)
    (tmp_path / "bench.toml").touch()
    findings = re.search(r"xit code 1 means at least one\s+warning", guide.read_text("utf-8"))
    Rig(bench.url.rstrip("/"), serial).bash(script, tmp_path, findings=findings is not None)


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
        assert process.wait(timeout=60) == 0
