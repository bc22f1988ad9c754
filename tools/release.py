"""Check a release before it is tagged: version, changelog, wheel, notices. Run by `make release`."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

from tools import notices

ROOT = Path(__file__).parents[1]


def faults(root: Path = ROOT) -> list[str]:
    """Problems that prevent a release of this checkout, each with a remedy. Empty if there are none."""
    version = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    changes = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    found: list[str] = []
    if not re.fullmatch(r"\d+\.\d+\.\d+((a|b|rc)\d+)?", version):
        found.append(f"Version {version} is not a semantic version. Change it in pyproject.toml.")
    if not re.search(rf"^## {re.escape(version)} - \d{{4}}-\d{{2}}-\d{{2}}$", changes, re.MULTILINE):
        found.append(f"CHANGELOG.md has no section '## {version} - YYYY-MM-DD'. Rename the section Unreleased.")
    waiting = re.search(r"^## Unreleased\n(.*?)(?=^## |\Z)", changes, re.MULTILINE | re.DOTALL)
    if waiting is None or waiting[1].strip():
        found.append("CHANGELOG.md has no empty section '## Unreleased' at the top. Move its entries to the release.")
    if _git(root, "tag", "--list", f"v{version}"):
        found.append(f"The tag v{version} already exists. Increase the version in pyproject.toml.")
    if _git(root, "status", "--porcelain"):
        found.append("There are uncommitted changes. Commit them.")
    names = {path.name for path in (root / "dist").glob("*")}
    wheels = {f"{name}-{version}-py3-none-any.whl" for name in ("hornbill", "hornbill_client")}
    wanted = {f"hornbill-{version}.tar.gz", *wheels}
    if names != wanted:
        found.append(f"dist/ contains {sorted(names)} instead of {sorted(wanted)}. Run 'make build'.")
    if root == ROOT and notices.PAGE.read_text(encoding="utf-8") != notices.document():
        found.append("THIRD_PARTY.md is out of date. Run 'make generate'.")
    return found


def steps(version: str) -> str:
    """Remaining steps of the release."""
    return f"""\
hornbill {version} is in dist/. Remaining steps:
  make check test                         on the commit to be tagged
  git tag -a v{version} -m "hornbill {version}"
  git push origin v{version}
  python -m twine upload dist/*           or deliver the files
  make docker && docker tag hornbill hornbill:{version}
Then increase the version in pyproject.toml."""


def _git(root: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False)
    return done.stdout.strip()


def main() -> int:
    """Print the problems and return 1, or print the remaining steps and return 0."""
    found = faults()
    for one in found:
        print(f"- {one}", file=sys.stderr)
    if not found:
        print(steps(tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]))
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
