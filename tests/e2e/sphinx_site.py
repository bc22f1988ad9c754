"""The documentation, built as `make docs` builds it."""

import subprocess
import sys
from pathlib import Path


def sphinx(sources: Path, out: Path, scratch: Path) -> subprocess.CompletedProcess[str]:
    """Build it as `make docs` does."""
    options = ["-q", "-W", "-E", "-c", sources / "docs" / "site", "-d", scratch]
    return subprocess.run(
        [sys.executable, "-m", "sphinx", *options, sources, out], capture_output=True, text=True, check=False
    )
