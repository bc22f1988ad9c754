"""Settings of a frame of the 3D view, and the settings of all frames by the key in their address."""

import re
from collections import OrderedDict
from dataclasses import dataclass
from math import isfinite
from threading import Lock
from typing import Annotated, Literal, TypeAlias

import msgspec

from hornbill.view.pose import Pose

Quality: TypeAlias = Literal["high", "low"]
"""high: reflections and shadows, for a GPU. low: simple light, for software rendering."""
KEY = re.compile(r"[0-9a-f]{16,64}")
"""Key of a frame: random, and long enough not to be guessed."""
MAX_FRAMES = 256
"""Maximum number of frames with stored settings. The oldest are dropped first."""


@dataclass(frozen=True, slots=True)
class Wall:
    """Servos in rows from the back, `columns` per row."""

    columns: int
    scale: float
    """Scale of the servos, so that the rows fit the picture. 1: size of the selected servo."""
    uids: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ViewSettings:
    """Settings of one frame. They have no effect on servos."""

    selected: str | None = None
    """The servo in front. If None or unknown, the first."""
    dark: bool = True
    quality: Quality = "high"
    visible: bool = True
    """False while the frame is not visible. Then nothing is computed for it."""
    wall: Wall | None = None
    poses: tuple[Pose, ...] | None = None
    """Poses of a recording, drawn instead of the servos of the bus. Without names, because the scene has no text."""
    resets: int = 0
    """Number of camera resets."""
    alone: bool = False
    """Show the servo in front without the others."""


class InvalidSettings(ValueError):
    """Invalid settings from a page. The text contains the reason."""


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


class _Settings(msgspec.Struct, forbid_unknown_fields=True):
    select: _Uid | None = None
    theme: Literal["dark", "light"] = "dark"
    quality: Quality = "high"
    visible: bool = True
    wall: _Wall | None = None
    poses: Annotated[list[_Pose], msgspec.Meta(max_length=256)] | None = None
    resets: Annotated[int, msgspec.Meta(ge=0, le=1_000_000_000)] = 0
    alone: bool = False


_DECODER = msgspec.json.Decoder(_Settings)


def read(text: str | bytes) -> ViewSettings:
    """Settings from a page's JSON. All of `select`, `theme`, `quality`, `visible`, `wall`, `poses`, `resets`, `alone`
    are optional. Raises InvalidSettings.
    """
    try:
        got = _DECODER.decode(text)
    except msgspec.DecodeError as error:
        raise InvalidSettings(str(error)) from None
    wall = got.wall
    if wall is not None and not isfinite(wall.scale):
        raise InvalidSettings("scale of the wall is not finite")
    return ViewSettings(
        selected=got.select,
        dark=got.theme == "dark",
        quality=got.quality,
        visible=got.visible,
        wall=None if wall is None else Wall(wall.columns, wall.scale, tuple(wall.uids)),
        poses=None if got.poses is None else tuple(_pose(one) for one in got.poses),
        resets=got.resets,
        alone=got.alone,
    )


def _pose(one: _Pose) -> Pose:
    return Pose(one.uid, "", one.series, one.angle, one.command, one.limit_cw, one.limit_ccw, one.stale)


class FrameSettings:
    """Settings of all frames. Thread-safe."""

    def __init__(self) -> None:
        self._settings: OrderedDict[str, ViewSettings] = OrderedDict()
        self._lock = Lock()

    def of(self, key: str) -> ViewSettings:
        """Settings of the frame with this key, by default the standard ones."""
        with self._lock:
            return self._settings.get(key, ViewSettings())

    def put(self, key: str, settings: ViewSettings) -> None:
        """Store the settings of a frame."""
        with self._lock:
            self._settings[key] = settings
            self._settings.move_to_end(key)
            while len(self._settings) > MAX_FRAMES:
                self._settings.popitem(last=False)
