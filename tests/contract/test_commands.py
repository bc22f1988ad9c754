"""What README and docs say of the command line is there, word by word; and every command is run by a test."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from commands.guides import ROOT, blocks, guides
from contract.test_reach import ASKING, COMMANDS
from hornbill.cli import app

LINE = re.compile(r"(?<![\w./-])hornbill (?=[a-z-])([^\n|;&>)`'\"]*(?:\"[^\"\n]*\"[^\n|;&>)`'\"]*)*)")
ELSEWHERE = {
    "decode": "tests/commands/test_command_line.py",
    "jobs wait": "tests/commands/test_command_line_records.py",
    "snapshots compare": "tests/commands/test_command_line_records.py",
    "demo": "tests/e2e/servers.py",
    "inventory annotate": "tests/commands/test_command_line_records.py",
    "lost-values restore": "tests/commands/test_command_line_records.py",
    "lost-values show": "tests/commands/test_command_line_records.py",
    "openapi": "tests/commands/test_command_line.py",
    "probe": "tests/commands/test_probe.py",
    "profiles apply": "tests/commands/test_command_line.py",
    "serve": "tests/e2e/test_reverse_proxy.py",
    "sim": "tests/socketcan/server/conftest.py",
    "tokens create": "tests/unit/cli/test_token.py",
    "tokens list": "tests/unit/cli/test_token.py",
    "tokens revoke": "tests/unit/cli/test_token.py",
}
"""Where a command is run that neither asks a server for one thing nor stands in a guide."""


def commands(found: Any, *words: str) -> Iterator[tuple[str, Any]]:
    """Every command by its words; groups left out."""
    for name, one in getattr(found, "commands", {}).items():
        if hasattr(one, "commands"):
            yield from commands(one, *words, name)
        else:
            yield " ".join((*words, name)), one


EVERY = dict(commands(typer.main.get_command(app)))
GROUPS = {name.split()[0] for name in EVERY if " " in name}


def named(words: list[str]) -> str | None:
    """The command that a line begins with; a group by itself is none."""
    return next((" ".join(words[:n]) for n in (2, 1) if " ".join(words[:n]) in EVERY), None)


def said(text: str) -> Iterator[list[str]]:
    """Every `hornbill …` of a page, inline or in a block, as words."""
    shown: list[str] = re.findall(r"`(hornbill [^`\n]+)`", text)
    shown += [one.group(0) for block in re.findall(r"^```bash\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
              for one in LINE.finditer(re.sub(r"(?m)(^|\s)#.*$", "", block))]  # fmt: skip
    for line in shown:
        found = LINE.match(line)
        if found:
            words = shlex.split(found[1])
            yield words[1:] if words[0] == "hornbill" else words  # a container of that name runs it


@pytest.mark.parametrize("guide", guides(), ids=lambda file: str(file.relative_to(ROOT)))
def test_every_command_and_every_flag_that_is_shown_exists(guide: Path) -> None:
    for words in said(guide.read_text(encoding="utf-8")):
        name = named(words)
        if name is None:
            assert words[0] in GROUPS or words[0].startswith("-"), f"hornbill {' '.join(words)}: no such command"
            assert len(words) == 1 or words[0].startswith("-"), f"hornbill {' '.join(words)}: no such command"
            continue
        known = {flag for one in EVERY[name].params for flag in (*one.opts, *one.secondary_opts)} | {"--help", "--"}
        flags = {word.split("=")[0] for word in words if re.match(r"--?[a-z]", word)} | ({"--"} & set(words))
        assert flags <= known, f"hornbill {' '.join(words)}: {name} has no {flags - known}"


def test_the_guides_show_commands_and_the_check_sees_them() -> None:
    seen = {named(words) for guide in guides() for words in said(guide.read_text(encoding="utf-8"))}
    assert {"list", "undo", "snapshots create", "factory-reset", "jobs report", "tokens create", "serve"} <= seen
    assert named(["snapshots"]) is None
    assert named(["nonsense", "list"]) is None


@pytest.mark.parametrize("name", sorted(EVERY))
def test_every_command_is_run_by_a_test(name: str) -> None:
    run = {named(words.split()) for words in (*COMMANDS.values(), *ASKING)}
    run |= {
        named(words)
        for guide in guides()
        for block in blocks(guide)
        if not block.needs
        for words in said(f"```bash\n{block.script}```\n")
    }
    if name in run:
        return
    assert name in ELSEWHERE, f"no test runs 'hornbill {name}'"
    source = (ROOT / ELSEWHERE[name]).read_text(encoding="utf-8")
    assert all(f'"{word}"' in source for word in name.split()), f"{ELSEWHERE[name]} does not run 'hornbill {name}'"
