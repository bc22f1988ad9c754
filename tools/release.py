"""Look at a release before it is tagged: version, changelog, wheel, notices. `make release` runs it."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

from tools import notices

ROOT = Path(__file__).parents[1]


def faults(root: Path = ROOT) -> list[str]:
    """What keeps this checkout from being released, each with what to do; nothing when it may be."""
    version = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    changes = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    found: list[str] = []
    if not re.fullmatch(r"\d+\.\d+\.\d+((a|b|rc)\d+)?", version):
        found.append(f"the version {version} is no semantic version: change it in pyproject.toml")
    if not re.search(rf"^## {re.escape(version)} - \d{{4}}-\d{{2}}-\d{{2}}$", changes, re.MULTILINE):
        found.append(f"CHANGELOG.md has no section '## {version} - YYYY-MM-DD': name what is under Unreleased so")
    waiting = re.search(r"^## Unreleased\n(.*?)(?=^## |\Z)", changes, re.MULTILINE | re.DOTALL)
    if waiting is None or waiting[1].strip():
        found.append(
            "CHANGELOG.md needs an empty section '## Unreleased' on top: what was in it belongs to the release"
        )
    if _git(root, "tag", "--list", f"v{version}"):
        found.append(f"v{version} is tagged already: raise the version in pyproject.toml")
    if _git(root, "status", "--porcelain"):
        found.append("there are changes that are not committed")
    names = {path.name for path in (root / "dist").glob("*")}
    wanted = {f"hornbill-{version}.tar.gz", f"hornbill-{version}-py3-none-any.whl"}
    if names != wanted:
        found.append(f"dist/ holds {sorted(names)}, not {sorted(wanted)}: run 'make build'")
    if root == ROOT and notices.PAGE.read_text(encoding="utf-8") != notices.document():
        found.append("THIRD_PARTY.md is out of date: run 'make generate'")
    return found


def steps(version: str) -> str:
    """What is left to type, and to look at."""
    return f"""\
hornbill {version} is in dist/. What is left:
  make check test                         on the very commit that is tagged
  git tag -a v{version} -m "hornbill {version}"
  git push origin v{version}
  python -m twine upload dist/*           or hand the two files over
  make docker && docker tag hornbill hornbill:{version}
then raise the version in pyproject.toml for what comes next."""


def _git(root: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False)
    return done.stdout.strip()


def main() -> int:
    """0 when it may be released; prints what is in the way, or what is left."""
    found = faults()
    for one in found:
        print(f"- {one}", file=sys.stderr)
    if not found:
        print(steps(tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]))
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
