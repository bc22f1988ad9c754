"""Runs the commands of guides: their blocks of shell, what they need, and a server to run them with.

A block is ```bash. Its first line may be a comment that says why it is not run here, or how it is run:
`# needs hardware`, `# needs root`, `# needs Docker`, `# needs a checkout`, `# needs the wheel`, `# runs until Ctrl-C`;
several separated by commas.
"""

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
WRITTEN = "61-466861"
"""The serial in the guides."""
NEEDS = ("needs hardware", "needs root", "needs Docker", "needs a checkout", "needs the wheel")
ENDLESS = "runs until Ctrl-C"
DOCTOR = """hornbill() {
  command hornbill "$@" || { code=$?; [[ $1 == doctor && $code == 1 ]] || return $code; }
}
"""
"""Ends with 0 also if the doctor has findings, such as a busy computer. For guides that tell its exit code 1."""


@dataclass(frozen=True)
class Block:
    """One block of shell of a guide, from `line`."""

    file: Path
    line: int
    script: str

    @property
    def marks(self) -> list[str]:
        """The marks in its first line."""
        first = self.script.split("\n", 1)[0]
        found = [one.strip() for one in first.removeprefix("#").split(",")] if first.startswith("# ") else []
        return [one for one in found if one == ENDLESS or one.startswith("needs ")]

    @property
    def needs(self) -> str:
        """Why it is not run here; empty if it is run."""
        return ", ".join(one for one in self.marks if one != ENDLESS)

    def __str__(self) -> str:
        return f"{self.file.relative_to(ROOT)}:{self.line}"


def blocks(file: Path, language: str = "bash") -> list[Block]:
    """The blocks of one language in a guide, in order."""
    text = file.read_text(encoding="utf-8")
    found = re.finditer(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    return [Block(file, text.count("\n", 0, one.start()) + 1, one[1]) for one in found]


def guides() -> list[Path]:
    """Every page of documentation: README, CONTRIBUTING, docs/, and the README of each folder."""
    dist = ROOT / "docs" / "dist"
    pages = [file for file in (ROOT / "docs").rglob("*.md") if dist not in file.parents]
    return sorted([*ROOT.glob("*.md"), *ROOT.glob("[!.]*/README.md"), *pages])


class Rig:
    """A server with simulated servos, and programs that use it."""

    def __init__(self, url: str, serial: str) -> None:
        self.url = url
        self.serial = serial

    @property
    def environment(self) -> dict[str, str]:
        """The address of the server, and `hornbill` in the path."""
        bin_folder = str(Path(sys.executable).parent)
        path = f"{bin_folder}{os.pathsep}{os.environ['PATH']}"
        return {**os.environ, "HORNBILL_URL": self.url, "API": f"{self.url}/api/v1", "PATH": path}

    def run(self, *command: str | Path, folder: Path = ROOT, code: int | None = 0) -> str:
        """The output of a program that exits with `code`."""
        ran = subprocess.run(
            [str(word) for word in command], capture_output=True, text=True, cwd=folder, timeout=120, check=False,
            env={**self.environment, "HORNBILL_DATA_DIR": str(folder / "data")},
        )  # fmt: skip
        assert code is None or ran.returncode == code, ran.stdout + ran.stderr
        return ran.stdout + ran.stderr

    def bash(self, script: str, folder: Path, *, findings: bool = False) -> str:
        """Run a block of a guide with the serial of this rig. `findings`: the doctor may have some."""
        script = (DOCTOR if findings else "") + script.replace(WRITTEN, self.serial)
        return self.run("bash", "-euo", "pipefail", "-c", script, folder=folder)
