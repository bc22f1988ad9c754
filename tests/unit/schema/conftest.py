"""A fixture that changes one place in a copy of the tables and returns the error."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from hornbill import resources
from hornbill.errors import TableError
from hornbill.schema.catalog import Catalog

Refusal = Callable[[str, str, str], TableError]


@pytest.fixture
def refusal(tmp_path: Path) -> Refusal:
    """Replaces `pattern` once in `file` of a copy of the tables. Returns the error of loading it."""

    def spoil(file: str, pattern: str, replacement: str) -> TableError:
        folder = tmp_path / "schemas"
        shutil.copytree(resources.schemas(), folder)
        path = folder / file
        before = path.read_text(encoding="utf-8")
        after, count = re.subn(pattern, replacement, before, count=1)
        assert count == 1
        assert after != before
        path.write_text(after, encoding="utf-8")
        with pytest.raises(TableError) as caught:
            Catalog.load(folder)
        return caught.value

    return spoil
