"""Cases of a parametrized test: which are in `make test`, and which use 3D."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def cases(names: Iterable[str], *, usual: Collection[str], scene: Collection[str] = ()) -> list[Any]:
    """All cases. Those that are not `usual` are left to `make test-release`; those in `scene` get a browser with 3D."""
    marks = {
        name: [pytest.mark.release] * (name not in usual) + [pytest.mark.scene] * (name in scene) for name in names
    }
    return [pytest.param(name, marks=marks[name], id=name) for name in names]
