"""Colours and lights of the two themes. Hues are the tokens of the page, as sRGB bytes."""

from dataclasses import dataclass

Rgb = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Palette:
    """One theme. `background`: CSS colour of the page around the scene."""

    background: str
    haze: Rgb
    """The background colour, into which distant servos fade."""
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
    ink: Rgb
    """Colour of the origin mark."""
    surroundings: float
    key: float
    rim: float


DARK = Palette(
    background="#161A1D",
    haze=(22, 26, 29),
    cell=(28, 33, 37),
    section=(36, 42, 47),
    shadow=0.42,
    limit=(30, 186, 150),
    limit_face=(0, 120, 92),
    limit_fill=0.32,
    command=(60, 145, 255),
    command_face=(0, 78, 210),
    command_fill=0.72,
    stale=(112, 122, 130),
    ink=(214, 220, 224),
    surroundings=0.75,
    key=1.5,
    rim=0.7,
)
LIGHT = Palette(
    background="#F7F8F7",
    haze=(247, 248, 247),
    cell=(238, 240, 239),
    section=(228, 231, 230),
    shadow=0.13,
    limit=(0, 112, 88),
    limit_face=(0, 120, 92),
    limit_fill=0.30,
    command=(0, 80, 190),
    command_face=(0, 60, 200),
    command_fill=0.62,
    stale=(120, 130, 127),
    ink=(40, 48, 51),
    surroundings=0.72,
    key=1.35,
    rim=0.6,
)


def palette(*, dark: bool) -> Palette:
    """Palette of a theme."""
    return DARK if dark else LIGHT
