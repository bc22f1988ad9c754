"""Every folder says in one screen what lives in it, what does not, and how it is tested; and what it names is there."""

import re
import subprocess
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "server" / "hornbill"
NOT_OURS = {"node_modules", "dist", "build", "__pycache__"}
FOLDERS = sorted(
    one for one in ROOT.iterdir() if one.is_dir() and not one.name.startswith(".") and one.name not in NOT_OURS
)
PACKAGES = sorted(one.parent for one in PACKAGE.glob("*/__init__.py"))
SCREEN = 75
ENDINGS = (
    "css",
    "html",
    "js",
    "json",
    "lock",
    "md",
    "py",
    "sh",
    "toml",
    "ts",
    "tsx",
    "webp",
    "yaml",
    "yml",
    "Dockerfile",
)
NOT_FILES = {"bench.toml": "a name in an example: any file is taken"}


def files() -> list[str]:
    """Every file of the checkout, by its path from the root."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return [f"/{name}" for name in listed.stdout.splitlines() if (ROOT / name).exists()]


@pytest.fixture(scope="module")
def known() -> list[str]:
    if not (ROOT / ".git").exists():
        pytest.skip("this is no checkout of git")
    return files()


@pytest.mark.parametrize("folder", [*FOLDERS, *PACKAGES], ids=lambda one: str(one.relative_to(ROOT)))
def test_every_folder_says_what_it_is_in_one_screen(folder: Path) -> None:
    readme = folder / "README.md"
    assert readme.is_file(), f"write {readme.relative_to(ROOT)}"
    text = readme.read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert len(text.splitlines()) <= SCREEN, "one screen"


@pytest.mark.parametrize("package", PACKAGES, ids=lambda one: one.name)
def test_every_package_says_what_is_not_in_it_what_it_may_import_and_how_it_is_tested(package: Path) -> None:
    text = (package / "README.md").read_text(encoding="utf-8")
    assert text.startswith(f"# {package.name}: ")
    for word in ("**Not here:**", "**May import**", "**Test:**"):
        assert word in text, word


READMES = sorted(
    {ROOT / "README.md", ROOT / "docs" / "site" / "README.md", *(one / "README.md" for one in [*FOLDERS, *PACKAGES])}
)


@pytest.mark.parametrize("readme", READMES, ids=lambda one: str(one.parent.relative_to(ROOT)))
def test_every_file_it_names_is_there(readme: Path, known: list[str]) -> None:
    text = re.sub(r"^```.*?^```", "", readme.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for name in re.findall(r"`([\w./*{}-]+)`", text):
        if name in NOT_FILES or not name.endswith(tuple(f".{one}" for one in ENDINGS)):
            continue
        wanted = f"*/{name.removeprefix('../')}"
        assert any(fnmatch(one, wanted) for one in known), f"{readme.relative_to(ROOT)}: {name} is not there"


@pytest.mark.parametrize("readme", READMES, ids=lambda one: str(one.parent.relative_to(ROOT)))
def test_every_folder_it_names_is_there(readme: Path) -> None:
    text = re.sub(r"^```.*?^```", "", readme.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    made = {"dist/", "docs/dist/", "node_modules/"}
    for name in set(re.findall(r"`([\w./-]+/)`", text)) - made:
        if name.startswith("/"):
            continue
        places = (readme.parent, ROOT, PACKAGE, ROOT / "docs", ROOT / "web" / "src", ROOT / "tests")
        assert any((place / name).is_dir() for place in places), f"{readme.relative_to(ROOT)}: {name} is not there"


def test_what_the_check_would_find(known: list[str]) -> None:
    assert any(fnmatch(one, "*/cli/connection.py") for one in known)
    assert not any(fnmatch(one, "*/cli/asking_nobody.py") for one in known)
