"""What `make release` checks, and the hooks before a commit."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from tools import release

ROOT = Path(__file__).parents[2]
HOOKS: list[dict[str, Any]] = [
    hook
    for repository in yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"]
    for hook in repository["hooks"]
    if repository["repo"] == "local"
]

CHANGES = "# Changelog\n\n## Unreleased\n\n## 1.2.3 - 2026-01-02\n\n- New.\n"


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A committed checkout that is ready for release."""
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "hornbill"\nversion = "1.2.3"\n')
    (tmp_path / "CHANGELOG.md").write_text(CHANGES)
    (tmp_path / ".gitignore").write_text("dist/\n")
    (tmp_path / "dist").mkdir()
    for name in ("hornbill-1.2.3.tar.gz", "hornbill-1.2.3-py3-none-any.whl", "hornbill_client-1.2.3-py3-none-any.whl"):
        (tmp_path / "dist" / name).touch()
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--quiet", "-m", "all")
    return tmp_path


def git(folder: Path, *words: str) -> None:
    who = ("-c", "user.name=test", "-c", "user.email=test@localhost", "-c", "commit.gpgsign=false")
    subprocess.run(["git", *who, *words], cwd=folder, check=True)


def test_a_ready_checkout_has_no_faults(checkout: Path) -> None:
    assert release.faults(checkout) == []
    assert 'git tag -a v1.2.3 -m "hornbill 1.2.3"' in release.steps("1.2.3")


@pytest.mark.parametrize(
    ("file", "text", "fault"),
    [
        ("CHANGELOG.md", CHANGES.replace("1.2.3", "1.2.2"), "no section '## 1.2.3"),
        ("CHANGELOG.md", CHANGES.replace("## Unreleased\n", "## Unreleased\n\n- More.\n"), "empty section"),
        ("CHANGELOG.md", CHANGES.replace("## Unreleased\n", ""), "empty section"),
        ("pyproject.toml", '[project]\nversion = "1.2"\n', "not a semantic version"),
        ("pyproject.toml", '[project]\nversion = "1.2.4"\n', "dist/ contains"),
        ("note.txt", "", "uncommitted"),
    ],
)
def test_a_fault_prevents_the_release(checkout: Path, file: str, text: str, fault: str) -> None:
    (checkout / file).write_text(text)
    assert any(fault in one for one in release.faults(checkout))


def test_an_existing_version_is_not_released_again(checkout: Path) -> None:
    git(checkout, "tag", "v1.2.3")
    assert any("already exists" in one for one in release.faults(checkout))


@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
def test_a_hook_runs_an_installed_program_on_existing_files(hook: dict[str, Any]) -> None:
    program, *words = shlex.split(hook["entry"])
    if program == "npm":
        script = words[-1]
        scripts = json.loads((ROOT / "web" / "package.json").read_text(encoding="utf-8"))["scripts"]
        assert "run" in words, "npm exec runs in another folder"
        assert script in scripts
    else:
        folder, name = program.rsplit("/", 1)
        assert folder == ".venv/bin", "where make setup installs programs"
        assert (Path(sys.executable).parent / name).exists(), program
    assert all((ROOT / word).exists() for word in words if word.startswith(("tests/", "server/", "web/")))
    if "files" in hook:
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False).stdout
        if listed:
            assert any(re.search(hook["files"], one) for one in listed.splitlines()), hook["files"]


def test_the_hooks_run_what_make_check_runs() -> None:
    check = (ROOT / "Makefile").read_text(encoding="utf-8").split("\ncheck:")[1].split("\ntest:")[0]
    check = check.replace("$(BIN)", ".venv/bin").replace("$(NPM)", "npm --prefix web")
    for hook in HOOKS:
        if hook["id"] != "generated":
            assert hook["entry"].removesuffix(" --force-exclude") in check, hook["entry"]
