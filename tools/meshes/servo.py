"""Case of a servo on the floor, with its output shaft on the z axis.

The shapes are original: correct in size and arrangement, but not copied from a drawing. x is along the case, y is the
direction of the horn's notch at 0°, and the name plate faces up (section 4.1 defines angles from that side).
"""

import numpy as np
from numpy.typing import NDArray

from hornbill.view.case import Case
from tools.meshes import fittings
from tools.meshes import materials as m
from tools.meshes.gltf import Material, Part
from tools.meshes.occlusion import Occlusion, Solid
from tools.meshes.outline import Outline, circle, inset, rounded_rectangle
from tools.meshes.surface import Surface, at, cap, join, lathe, loft, slab, stack

_GROOVE = 0.5
"""Half the gap between two parts of a case."""
_CONTACT_REACH = 12.0
"""Width of the shadow on the floor around a case."""


def plain(case: Case, *, fine: bool) -> list[Part]:
    """A servo of an unknown series: outline, shaft and 0° mark, without distinguishing features."""
    wall = _wall(case, corner=6 if fine else 2, spacing=3.2 if fine else 9.0)
    boss, bearing, seal, shaft = fittings.output(case, rim=56 if fine else 20)
    surfaces = [(m.PLAIN, join([slab(wall, 0.0, case.top, bevel=1.3, steps=4 if fine else 2), boss])), (m.BRASS, shaft)]
    if fine:
        surfaces += [(m.BLACK, seal), (m.STEEL, bearing), (m.INDEX, fittings.index(case))]
    return _shaded(case, surfaces, rings=8 if fine else 3)


def near(case: Case) -> list[Part]:
    """The detailed model, for the servo in focus."""
    wall = _wall(case, corner=6, spacing=3.2)
    ears, holes = _ears(case, corner=5, rim=24, spacing=2.2)
    ear_low, ear_high = case.ear_top - case.ear_thickness, case.ear_top
    boss, bearing, seal, shaft = fittings.output(case, rim=56)
    gap = inset(wall, _GROOVE)
    gaps = [loft([at(gap, z - _GROOVE), at(gap, z + _GROOVE)]) for z in (case.seam_low, case.seam_high)]
    ends = [
        slab(wall, 0.0, case.seam_low - _GROOVE, bevel=0.9, steps=4, rise=2.0),
        slab(wall, case.seam_high + _GROOVE, case.top, bevel=1.3, steps=5, rise=2.0, spacing=1.8),
    ]
    middle = [
        stack(wall, _finned(case)),
        cap(wall, case.seam_high),
        slab(ears, ear_low, ear_high, bevel=0.45, steps=3, holes=holes, spacing=2.0),
    ]
    surfaces = [
        (m.CAP, join([*ends, boss])),
        (m.BODY, join(middle)),
        (m.BLACK, join([*gaps, seal, fittings.screws(case)])),
        (m.STEEL, bearing),
        (m.BRASS, shaft),
        (m.PLATE, fittings.plate(case, steps=2, spacing=2.0)),
        (m.MARK, fittings.direction(case)),
        (m.INDEX, fittings.index(case)),
        (m.RUBBER, fittings.cable(case)),
    ]
    return _shaded(case, surfaces, rings=8)


def far(case: Case) -> list[Part]:
    """The simple model, for overviews: the same outline with a tenth of the triangles."""
    wall = _wall(case, corner=2, spacing=9.0)
    ears, holes = _ears(case, corner=2, rim=10, spacing=5.0)
    ear_low, ear_high = case.ear_top - case.ear_thickness, case.ear_top
    boss, _, _, _ = fittings.output(case, rim=20)
    radius = 2.9 * case.small
    ends = [
        slab(wall, 0.0, case.seam_low, bevel=0.9, steps=1, bottom=False),
        slab(wall, case.seam_high, case.top, bevel=1.3, steps=2, spacing=5.0, bottom=False),
    ]
    middle = [
        stack(wall, [(0.35, case.seam_low), (0.35, case.seam_low + 4), (0.35, case.seam_high)]),
        slab(ears, ear_low, ear_high, bevel=0.45, steps=1, holes=holes),
    ]
    surfaces = [
        (m.CAP, join([*ends, boss])),
        (m.PLAIN, join(middle)),
        (m.BRASS, lathe([(radius, case.top), (radius, case.hub + 1)], 10)),
        (m.PLATE, fittings.plate(case, steps=1)),
    ]
    return _shaded(case, surfaces, rings=3)


def coarse(case: Case) -> list[Part]:
    """The outline with a third of the triangles of the simple model, for overviews in software."""
    wall = _wall(case, corner=2, spacing=60.0)
    ears, holes = _ears(case, corner=1, rim=6, spacing=60.0)
    boss = lathe(
        [(case.boss, case.top), (case.boss, case.top + 1.5 * case.small), (0.0, case.top + 1.5 * case.small)], 12
    )
    ends = [
        loft([at(wall, 0.0), at(wall, case.seam_low)]),
        slab(wall, case.seam_high, case.top, bevel=1.3, steps=1, bottom=False),
    ]
    middle = [
        loft([at(wall, case.seam_low), at(wall, case.seam_high)]),
        loft([at(ears, case.ear_top - case.ear_thickness), at(ears, case.ear_top)]),
        cap(ears, case.ear_top, holes=holes),
    ]
    surfaces = [
        (m.CAP, join([*ends, boss])),
        (m.PLAIN, join(middle)),
        (m.BRASS, lathe([(2.9 * case.small, case.top), (2.9 * case.small, case.hub + 1)], 6)),
        (m.PLATE, fittings.flat_plate(case)),
    ]
    return _shaded(case, surfaces, rings=2)


def _solids(case: Case) -> list[Solid]:
    """Solids that block light: case, ears, boss and the hub of the horn, which is the same at every angle."""
    k = case.small
    solids = [
        Solid(_wall(case, corner=4, spacing=50.0), 0.0, case.top),
        Solid(circle(case.boss, 40), case.top, case.top + 1.5 * k),
        Solid(circle(3.0 * k, 24), case.top, case.hub),
        Solid(circle(6.4 * case.horn, 40), case.hub, case.hub + 5.2 * case.horn),
    ]
    if case.ear > 0:
        ears, holes = _ears(case, corner=4, rim=16, spacing=50.0)
        solids.insert(1, Solid(ears, case.ear_top - case.ear_thickness, case.ear_top, tuple(holes)))
    return solids


def _shaded(case: Case, surfaces: list[tuple[Material, Surface]], *, rings: int) -> list[Part]:
    occlusion = Occlusion(_solids(case))
    parts = [Part(material, surface, occlusion.light(surface, strength=0.85)) for material, surface in surfaces]
    contact, reach = _contact(case, rings)
    fade = 1.0 - reach / _CONTACT_REACH
    light = 1.0 - 0.9 * fade * (1.0 - occlusion.light(contact))
    return [*parts, Part(m.CONTACT, contact, light)]


def _contact(case: Case, rings: int) -> tuple[Surface, NDArray[np.float64]]:
    """The floor around the case, and the distance of each of its points from the wall."""
    foot = _wall(case, corner=rings, spacing=40.0 / rings)
    away = _CONTACT_REACH * np.linspace(1.0, 0.0, rings + 1) ** 1.5
    floor = loft([at(inset(foot, 0.8 - distance), 0.15) for distance in away.tolist()])
    return floor, np.repeat(away, len(foot))


def _wall(case: Case, *, corner: int, spacing: float) -> Outline:
    return rounded_rectangle(
        case.back, case.front, -case.half_width, case.half_width, case.corner, corner=corner, spacing=spacing
    )


def _ears(case: Case, *, corner: int, rim: int, spacing: float) -> tuple[Outline, list[Outline]]:
    """The plate with both ears, through the case, and its holes."""
    back, front = case.back - case.ear, case.front + case.ear
    half, radius = case.ear_half_width, 0.36 * case.ear
    outline = rounded_rectangle(back, front, -half, half, radius, corner=corner, spacing=spacing)
    places = (case.back - case.ear / 2, case.front + case.ear / 2)
    return outline, [circle(case.hole, rim, x=x, y=y) for x in places for y in case.hole_y]


def _finned(case: Case) -> list[tuple[float, float]]:
    """The wall of the middle part, with cooling fins below the ears."""
    bottom, roof = case.seam_low, case.ear_top - case.ear_thickness
    pitch = (roof - bottom - 2.0) / (case.fins + 0.5)
    profile = [(0.35, bottom), (0.0, bottom + 0.35)]
    for fin in range(case.fins):
        z = bottom + 1.6 + fin * pitch
        profile += [(0.0, z), (0.2, z + 0.2), (0.9, z + 0.3), (0.9, z + 1.2), (0.2, z + 1.3), (0.0, z + 1.5)]
    return [*profile, (0.0, roof), (0.0, case.seam_high - 0.35), (0.35, case.seam_high)]
