"""Cases of a parametrized test: which are in `make test`, and which use 3D."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def cases(names: Iterable[str], *, usual: Collection[str], scene: Collection[str] = ()) -> list[Any]:
    """All cases. Those that are not `usual` are left to `make test-release`; those in `scene` get a browser with 3D."""
    release, uses_3d = pytest.mark.release, pytest.mark.scene
    return [
        pytest.param(name, marks=[release] * (name not in usual) + [uses_3d] * (name in scene), id=name)
        for name in names
    ]
