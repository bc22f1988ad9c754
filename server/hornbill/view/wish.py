"""Wish, what one frame of the 3D view shall show, and Wishes, those of every frame by the key in its address."""

import re
from collections import OrderedDict
from dataclasses import dataclass
from math import isfinite
from threading import Lock
from typing import Annotated, Literal

import msgspec

from hornbill.view.models import Quality
from hornbill.view.pose import Pose

KEY = re.compile(r"[0-9a-f]{16,64}")
"""How a frame names itself: at random, long enough that nobody guesses another's."""
KEPT = 256
"""Wishes kept; the one asked for longest ago goes first."""


@dataclass(frozen=True, slots=True)
class Wall:
    """Every servo named here, in rows from the back, as many to a row as there are columns."""

    columns: int
    scale: float
    """Size of the servos, so that the rows fit the picture: 1 is the size of the selected servo."""
    uids: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ViewSettings:
    """What one frame shows. Nothing in it reaches a servo."""

    selected: str | None = None
    """The servo in front; without one, or with one nobody knows, the first."""
    dark: bool = True
    quality: Quality = "high"
    looking: bool = True
    """False while the frame is out of sight: then nothing is computed for it."""
    wall: Wall | None = None
    poses: tuple[Pose, ...] | None = None
    """Drawn instead of the servos of the bus: an instant of a recording. Nameless: what is drawn bears no text."""
    resets: int = 0
    """Counts how often the camera was asked back to where it started."""
    alone: bool = False
    """Near, whether the servo in front is shown without the others."""


class NotAWish(ValueError):
    """What a page sent is no wish; the text says what of it."""


_Uid = Annotated[str, msgspec.Meta(pattern="^[0-9a-f]{32}$")]
_Degrees = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]


class _Wall(msgspec.Struct, forbid_unknown_fields=True):
    columns: Annotated[int, msgspec.Meta(ge=1, le=64)]
    scale: Annotated[float, msgspec.Meta(ge=0.01, le=2.0)]
    uids: Annotated[list[_Uid], msgspec.Meta(max_length=256)]


class _Pose(msgspec.Struct, forbid_unknown_fields=True):
    uid: _Uid
    series: Literal["BLA21", "BLA15", "BLA34", ""] = ""
    angle: _Degrees | None = None
    command: _Degrees | None = None
    limit_cw: _Degrees | None = None
    limit_ccw: _Degrees | None = None
    stale: bool = False


class _Wish(msgspec.Struct, forbid_unknown_fields=True):
    select: _Uid | None = None
    theme: Literal["dark", "light"] = "dark"
    quality: Quality = "high"
    looking: bool = True
    wall: _Wall | None = None
    poses: Annotated[list[_Pose], msgspec.Meta(max_length=256)] | None = None
    resets: Annotated[int, msgspec.Meta(ge=0, le=1_000_000_000)] = 0
    alone: bool = False


_DECODER = msgspec.json.Decoder(_Wish)


def read(text: str | bytes) -> ViewSettings:
    """A page's JSON as a wish. All of `select`, `theme`, `quality`, `looking`, `wall`, `poses`, `resets`, `alone` may
    be left out. Raises NotAWish.
    """
    try:
        got = _DECODER.decode(text)
    except msgspec.DecodeError as error:
        raise NotAWish(str(error)) from None
    wall = got.wall
    if wall is not None and not isfinite(wall.scale):
        raise NotAWish("a wall's scale is a number")
    return ViewSettings(
        selected=got.select,
        dark=got.theme == "dark",
        quality=got.quality,
        looking=got.looking,
        wall=None if wall is None else Wall(wall.columns, wall.scale, tuple(wall.uids)),
        poses=None if got.poses is None else tuple(_pose(one) for one in got.poses),
        resets=got.resets,
        alone=got.alone,
    )


def _pose(one: _Pose) -> Pose:
    return Pose(one.uid, "", one.series, one.angle, one.command, one.limit_cw, one.limit_ccw, one.stale)


class Wishes:
    """The wish of each frame. Any thread may ask and tell."""

    def __init__(self) -> None:
        self._wishes: OrderedDict[str, ViewSettings] = OrderedDict()
        self._lock = Lock()

    def of(self, key: str) -> ViewSettings:
        """The wish told last under this key; the usual one when none was."""
        with self._lock:
            return self._wishes.get(key, ViewSettings())

    def keep(self, key: str, wish: ViewSettings) -> None:
        """Keeps a frame's wish until it tells another, or until many others came."""
        with self._lock:
            self._wishes[key] = wish
            self._wishes.move_to_end(key)
            while len(self._wishes) > KEPT:
                self._wishes.popitem(last=False)
