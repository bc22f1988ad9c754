"""What `make release` looks at: each thing that would make a release wrong is named, and nothing else is."""

import subprocess
from pathlib import Path

import pytest

import release

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
        ("pyproject.toml", '[project]\nversion = "1.2"\n', "no semantic version"),
        ("pyproject.toml", '[project]\nversion = "1.2.4"\n', "dist/ holds"),
        ("note.txt", "", "not committed"),
    ],
)
def test_what_is_in_the_way_is_named(checkout: Path, file: str, text: str, told: str) -> None:
    (checkout / file).write_text(text)
    assert any(told in one for one in release.faults(checkout))


def test_a_version_that_was_released_is_not_released_again(checkout: Path) -> None:
    git(checkout, "tag", "v1.2.3")
    assert any("tagged already" in one for one in release.faults(checkout))
