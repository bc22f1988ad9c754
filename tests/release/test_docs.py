"""Documentation with a broken link is not built."""

import re
import shutil
from pathlib import Path

from commands.guides import ROOT
from e2e.sphinx_site import sphinx


def test_a_broken_link_fails_the_build(tmp_path: Path) -> None:
    copy = tmp_path / "checkout"
    for name in ("docs", "schemas", "web/src/style", "web/public", "server/README.md", "tests/README.md",
                 "web/README.md", "examples/README.md", "README.md", "CONTRIBUTING.md", "CHANGELOG.md"):  # fmt: skip
        source, target = ROOT / name, copy / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("dist"))
        else:
            shutil.copy(source, target)
    (copy / "docs" / "tutorial.md").write_text("# Broken\n\n[here](nowhere.md) and [there](rigs.md#no-such-heading)\n")
    (copy / "docs" / "unlisted.md").write_text("# In no menu\n")
    built = sphinx(copy, tmp_path / "out", tmp_path / "doctrees")
    assert built.returncode == 1
    assert re.search(r"tutorial\.md:3: WARNING: .*'nowhere\.md'", built.stderr)
    assert re.search(r"tutorial\.md:3: WARNING: .*'no-such-heading'", built.stderr)
    assert re.search(r"unlisted\.md: WARNING: document isn't included in any toctree", built.stderr)
