"""Owns the colours and lights of the two themes; hues are the tokens of the page, as sRGB bytes."""

from dataclasses import dataclass

Rgb = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Palette:
    """One theme. `background` is a CSS colour for the page around the drawing."""

    background: str
    haze: Rgb
    """The background again, into which distant servos fade."""
    cell: Rgb
    section: Rgb
    shadow: float
    limit: Rgb
    limit_face: Rgb
    limit_fill: float
    command: Rgb
    command_face: Rgb
    command_fill: float
    stale: Rgb
    surroundings: float
    key: float
    rim: float


DARK = Palette(
    background="#161A1D",
    haze=(22, 26, 29),
    cell=(42, 48, 53),
    section=(58, 66, 72),
    shadow=0.55,
    limit=(30, 186, 150),
    limit_face=(0, 120, 92),
    limit_fill=0.32,
    command=(60, 145, 255),
    command_face=(0, 112, 235),
    command_fill=0.6,
    stale=(112, 122, 130),
    surroundings=0.75,
    key=1.5,
    rim=0.7,
)
LIGHT = Palette(
    background="#F7F8F7",
    haze=(247, 248, 247),
    cell=(222, 226, 224),
    section=(204, 210, 207),
    shadow=0.22,
    limit=(0, 112, 88),
    limit_face=(0, 120, 92),
    limit_fill=0.30,
    command=(0, 80, 190),
    command_face=(10, 90, 225),
    command_fill=0.5,
    stale=(120, 130, 127),
    surroundings=0.85,
    key=1.7,
    rim=0.6,
)


def palette(*, dark: bool) -> Palette:
    """The theme's colours."""
    return DARK if dark else LIGHT
