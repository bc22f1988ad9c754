"""What `make release` looks at: each thing that would make a release wrong is named; and the hooks before a commit."""

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
    """A checkout that may be released, committed."""
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "hornbill"\nversion = "1.2.3"\n')
    (tmp_path / "CHANGELOG.md").write_text(CHANGES)
    (tmp_path / ".gitignore").write_text("dist/\n")
    (tmp_path / "dist").mkdir()
    for name in ("hornbill-1.2.3.tar.gz", "hornbill-1.2.3-py3-none-any.whl"):
        (tmp_path / "dist" / name).touch()
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--quiet", "-m", "all")
    return tmp_path


def git(folder: Path, *words: str) -> None:
    who = ("-c", "user.name=test", "-c", "user.email=test@localhost", "-c", "commit.gpgsign=false")
    subprocess.run(["git", *who, *words], cwd=folder, check=True)


def test_a_checkout_that_is_ready_is_released_and_told_the_steps(checkout: Path) -> None:
    assert release.faults(checkout) == []
    assert 'git tag -a v1.2.3 -m "hornbill 1.2.3"' in release.steps("1.2.3")


@pytest.mark.parametrize(
    ("file", "text", "told"),
    [
        ("CHANGELOG.md", CHANGES.replace("1.2.3", "1.2.2"), "no section '## 1.2.3"),
        ("CHANGELOG.md", CHANGES.replace("## Unreleased\n", "## Unreleased\n\n- More.\n"), "empty section"),
        ("CHANGELOG.md", CHANGES.replace("## Unreleased\n", ""), "empty section"),
        ("pyproject.toml", '[project]\nversion = "1.2"\n', "not a semantic version"),
        ("pyproject.toml", '[project]\nversion = "1.2.4"\n', "dist/ contains"),
        ("note.txt", "", "uncommitted"),
    ],
)
def test_what_is_in_the_way_is_named(checkout: Path, file: str, text: str, told: str) -> None:
    (checkout / file).write_text(text)
    assert any(told in one for one in release.faults(checkout))


def test_a_version_that_was_released_is_not_released_again(checkout: Path) -> None:
    git(checkout, "tag", "v1.2.3")
    assert any("already exists" in one for one in release.faults(checkout))


def test_every_hook_is_ours_and_has_what_pre_commit_asks_for() -> None:
    whole = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
    assert [one["repo"] for one in whole["repos"]] == ["local"], "a hook of elsewhere is another list of versions"
    assert len({hook["id"] for hook in HOOKS}) == len(HOOKS) >= 5
    for hook in HOOKS:
        assert hook["language"] == "system", hook["id"]
        assert hook["name"], hook["id"]
        assert set(hook) <= {"id", "name", "entry", "language", "files", "types_or", "pass_filenames"}, hook["id"]


@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
def test_a_hook_runs_a_program_of_the_checkout_on_files_that_are_there(hook: dict[str, Any]) -> None:
    program, *words = shlex.split(hook["entry"])
    if program == "npm":
        script = words[-1]
        scripts = json.loads((ROOT / "web" / "package.json").read_text(encoding="utf-8"))["scripts"]
        assert "run" in words, "npm exec runs in another folder than npm run"
        assert script in scripts
    else:
        folder, name = program.rsplit("/", 1)
        assert folder == ".venv/bin", "what make setup installs"
        assert (Path(sys.executable).parent / name).exists(), program
    assert all((ROOT / word).exists() for word in words if word.startswith(("tests/", "server/", "web/")))
    if "files" in hook:
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False).stdout
        if listed:
            assert any(re.search(hook["files"], one) for one in listed.splitlines()), hook["files"]


def test_the_hooks_run_what_make_check_runs() -> None:
    check = (ROOT / "Makefile").read_text(encoding="utf-8").split("\ncheck:")[1].split("\n\n")[0]
    check = check.replace("$(BIN)", ".venv/bin").replace("$(NPM)", "npm --prefix web")
    for hook in HOOKS:
        if hook["id"] != "generated":
            assert hook["entry"].removesuffix(" --force-exclude") in check, hook["entry"]


@pytest.mark.parametrize("hook", [one for one in HOOKS if "types_or" in one], ids=lambda hook: hook["id"])
def test_a_hook_for_python_passes_good_code_and_stops_bad(hook: dict[str, Any], tmp_path: Path) -> None:
    program, *words = shlex.split(hook["entry"])
    command = [str(Path(sys.executable).parent / program.rsplit("/", 1)[1]), *words]
    good, bad = tmp_path / "good.py", tmp_path / "bad.py"
    good.write_text('"""Nothing."""\n')
    bad.write_text("import os\nx = { 1:2 }\n")
    for file, code in ((good, 0), (bad, 1)):
        assert subprocess.run([*command, str(file)], cwd=ROOT, capture_output=True, check=False).returncode == code
