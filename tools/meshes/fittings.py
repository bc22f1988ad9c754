"""Parts mounted on a case: output shaft and bearing, screws, name plate with marks, cable."""

import numpy as np
from numpy.typing import NDArray

from hornbill.view.case import Case
from tools.meshes.outline import area, circle, hexagon, rounded_rectangle, toothed
from tools.meshes.surface import Surface, at, cap, join, lathe, loft, slab, tube


def output(case: Case, *, rim: int) -> tuple[Surface, Surface, Surface, Surface]:
    """Boss, bearing ring, its seal, and the splined shaft."""
    k = case.small

    def turned(profile: list[tuple[float, float]]) -> Surface:
        return lathe([(radius * k, case.top + z * k) for radius, z in profile], rim)

    boss = turned([(8.4, -0.2), (8.4, 0.9), (8.22, 1.32), (7.8, 1.5), (6.1, 1.5), (6.1, 0.9)])
    bearing = turned([(6.1, 1.1), (5.9, 1.25), (5.2, 1.25), (5.1, 1.1)])
    seal = turned([(5.1, 1.1), (2.6, 1.1)])
    teeth = toothed(2.95 * k, 0.32 * k, 25)
    shaft = loft([at(teeth, case.top), at(teeth, case.hub + 1.0)])
    return boss, bearing, seal, shaft


def screws(case: Case) -> Surface:
    """Four socket screws in the corners of the top."""
    k, rim, edge = case.small, 24, 2.9 * case.small
    socket = hexagon(1.6, rim)
    screw = join(
        [
            lathe([(1.5, 0.0), (1.5, 0.35), (1.38, 0.62), (1.1, 0.72), (0.95, 0.72)], rim),
            loft([at(circle(0.95, rim), 0.72), at(socket, 0.72)]),
            loft([at(socket, 0.72), at(socket, 0.1)]),
            loft([at(socket, 0.1), at(socket * 0.01, 0.1)]),
        ]
    ).scaled(k)
    along = (case.back + edge, case.front - edge)
    across = (edge - case.half_width, case.half_width - edge)
    return join([screw.moved(x, y, case.top) for x in along for y in across])


def plate(case: Case, *, steps: int, spacing: float | None = None) -> Surface:
    """The name plate, without text."""
    left, right = _plate_ends(case)
    half = case.half_width * 0.62
    outline = rounded_rectangle(left, right, -half, half, case.small, corner=1 + 2 * steps, spacing=spacing or 20.0)
    return slab(outline, case.top - 0.3, case.top + 0.22, bevel=0.12, steps=steps, spacing=spacing, bottom=False)


def flat_plate(case: Case) -> Surface:
    """The name plate as one face."""
    left, right = _plate_ends(case)
    half = case.half_width * 0.62
    return cap(rounded_rectangle(left, right, -half, half, case.small, corner=1, spacing=60.0), case.top + 0.22)


def _plate_ends(case: Case) -> tuple[float, float]:
    return case.back + 5.6 * case.small, -case.boss - 2.0 * case.small


def direction(case: Case) -> Surface:
    """Engraving of the plate: a clockwise arrow around a plus sign, because clockwise is positive (section 4.1)."""
    radius, half, start, end = 3.6, 0.26, 215.0, -28.0
    turn = np.radians(np.linspace(start, end, 49))
    ring = np.column_stack((np.cos(turn), np.sin(turn)))
    band = np.concatenate((ring * (radius - half), (ring * (radius + half))[::-1]))
    outwards = ring[-1]
    onwards = np.array([outwards[1], -outwards[0]])
    head = np.array([outwards * (radius + 1.0), outwards * (radius - 1.0), outwards * radius + onwards * 1.7])
    a, b = 1.5, 0.24
    plus = np.array(
        [(b, b), (b, a), (-b, a), (-b, b), (-a, b), (-a, -b), (-b, -b), (-b, -a), (b, -a), (b, -b), (a, -b), (a, b)]
    )
    marks = join([cap(shape if area(shape) > 0 else shape[::-1], 0.0) for shape in (band, head, plus)])
    return marks.scaled(case.small).moved(x=sum(_plate_ends(case)) / 2, z=case.top + 0.235)


def index(case: Case) -> Surface:
    """Line on the boss that marks the position of the horn's notch at 0°."""
    line = np.array([(0.28, 6.4), (0.28, 7.7), (-0.28, 7.7), (-0.28, 6.4)])
    return cap(line, 1.53).scaled(case.small).moved(z=case.top)


def cable(case: Case) -> Surface:
    """Strain relief, a cable that drops to the floor behind the servo, and its plug."""
    k, radius, height = case.small, 1.9 * case.small, case.seam_low * 0.5
    relief = lathe([(3.0, -1.0), (3.0, 1.2), (2.6, 1.5), (2.6, 2.3), (2.75, 2.3), (2.75, 3.3), (2.6, 3.3),
                    (2.6, 4.1), (2.75, 4.1), (2.75, 4.6), (2.3, 5.0), (1.9, 5.0)], 24)  # fmt: skip
    outwards = relief.scaled(k).turned([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    corners = np.array(
        [
            (0.0, 0.0, height),
            (-6.0 * k, 0.0, height),
            (-13.0 * k, 0.4 * k, height * 0.75),
            (-20.0 * k, 3.2 * k, radius + 0.4),
            (-27.0 * k, 10.0 * k, radius),
            (-30.0 * k, 20.0 * k, radius),
            (-30.0 * k, 33.0 * k, radius),
        ]
    )
    path = _through(corners, 10)
    x, y = float(path[-1, 0]), float(path[-1, 1])
    shell = rounded_rectangle(x - 4.6 * k, x + 4.6 * k, y - 1, y + 11 * k, 0.8, corner=3, spacing=3.0)
    plug = slab(shell, 0.0, 5.2 * k, bevel=0.5, steps=2, bottom=False)
    return join([outwards.moved(z=height), tube(path, radius, 14), plug]).moved(x=case.back)


def _through(corners: NDArray[np.float64], pieces: int) -> NDArray[np.float64]:
    """A Catmull-Rom curve through the corners, with `pieces` points per segment."""
    padded = np.concatenate((2 * corners[:1] - corners[1:2], corners, 2 * corners[-1:] - corners[-2:-1]))
    t = (np.arange(pieces) / pieces)[:, None]
    stretches = [
        0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
        for a, b, c, d in zip(padded, padded[1:], padded[2:], padded[3:], strict=False)
    ]
    return np.concatenate((*stretches, corners[-1:]))
