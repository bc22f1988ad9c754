"""Horn: hub, tapered arm along +y with holes, and a notch in its tip that marks 0°."""

from tools.meshes import materials as m
from tools.meshes.gltf import Part
from tools.meshes.occlusion import Occlusion, Solid
from tools.meshes.outline import arm, circle, hexagon
from tools.meshes.surface import at, cap, join, lathe, loft, slab

LENGTH = 24.0
"""From the shaft to the middle of the tip's round, mm."""
TIP = 3.1
REACH = LENGTH + TIP
_ROOT = 5.6
_LOW, _HIGH = 0.7, 3.7
_HOLES = (10.6, 14.2, 17.8, 21.4)


def near() -> list[Part]:
    """The detailed horn with its screw; the underside of the hub is at z = 0."""
    outline = arm(_ROOT, TIP, LENGTH, notch=1.7, corner=7, spacing=1.5)
    holes = [circle(0.95, 20, y=y) for y in _HOLES]
    blade = slab(outline, _LOW, _HIGH, bevel=0.5, steps=4, holes=holes, spacing=1.3)
    hub = lathe(
        [(3.2, 0.0), (5.9, 0.0), (6.25, 0.12), (6.4, 0.45), (6.4, 4.7), (6.25, 5.1), (5.9, 5.25),
         (4.5, 5.25), (4.25, 5.2), (4.1, 5.0), (4.1, 3.9), (0.0, 3.9)],
        64,
    )  # fmt: skip
    rim = 48
    screw = join(
        [
            lathe([(3.5, 3.9), (3.5, 6.0), (3.38, 6.3), (3.1, 6.42), (2.3, 6.42)], rim),
            loft([at(circle(2.3, rim), 6.42), at(hexagon(3.2, rim), 6.42)]),
            loft([at(hexagon(3.2, rim), 6.42), at(hexagon(3.2, rim), 4.6)]),
            loft([at(hexagon(3.2, rim), 4.6), at(hexagon(3.2, rim) * 0.01, 4.6)]),
        ]
    )
    occlusion = Occlusion(
        [
            Solid(outline, _LOW, _HIGH, tuple(holes)),
            Solid(circle(6.4, 40), 0.0, 5.25, (circle(4.1, 30),)),
            Solid(circle(4.1, 30), 0.0, 3.9),
            Solid(circle(3.5, 30), 3.9, 6.4, (hexagon(3.2, 24),)),
        ],
        floor=False,
    )
    horn = join([blade, hub])
    return [
        Part(m.HORN, horn, occlusion.light(horn, strength=0.8)),
        Part(m.STEEL, screw, occlusion.light(screw, strength=0.8)),
    ]


def far() -> list[Part]:
    """The simple horn, for overviews of many servos."""
    outline = arm(_ROOT, TIP, LENGTH, notch=1.7, corner=3, spacing=12.0)
    blade = slab(outline, _LOW, _HIGH, bevel=0.5, steps=1, holes=[circle(1.1, 8, y=y) for y in _HOLES[1::2]])
    hub = lathe([(4.0, 0.0), (6.4, 0.2), (6.4, 4.8), (5.9, 5.25), (0.0, 5.25)], 18)
    occlusion = Occlusion([Solid(outline, _LOW, _HIGH), Solid(circle(6.4, 20), 0.0, 5.25)], floor=False)
    horn = join([blade, hub])
    screw = lathe([(3.4, 5.2), (3.4, 6.2), (3.0, 6.4), (0.0, 6.4)], 12)
    return [
        Part(m.HORN, horn, occlusion.light(horn, strength=0.8)),
        Part(m.STEEL, screw, occlusion.light(screw, strength=0.8)),
    ]


def coarse() -> list[Part]:
    """The horn with a third of the triangles of the simple one, for overviews in software."""
    outline = arm(_ROOT, TIP, LENGTH, notch=1.7, corner=2, spacing=30.0)
    blade = join([loft([at(outline, _LOW), at(outline, _HIGH)]), cap(outline, _HIGH)])
    hub = lathe([(6.4, 0.2), (6.4, 5.25), (0.0, 5.25)], 12)
    occlusion = Occlusion([Solid(outline, _LOW, _HIGH), Solid(circle(6.4, 20), 0.0, 5.25)], floor=False)
    horn = join([blade, hub])
    screw = lathe([(3.4, 5.2), (3.4, 6.4), (0.0, 6.4)], 8)
    return [
        Part(m.HORN, horn, occlusion.light(horn, strength=0.8)),
        Part(m.STEEL, screw, occlusion.light(screw, strength=0.8)),
    ]


def ghost(*, fine: bool) -> list[Part]:
    """The blade only, slightly thinner, so that it is hidden inside a horn at its target."""
    outline = arm(_ROOT, TIP, LENGTH, notch=1.7, corner=6 if fine else 2, spacing=12.0 if fine else 30.0)
    low, high = _LOW + 0.06, _HIGH - 0.06
    if fine:
        blade = slab(outline, low, high, bevel=0.4, steps=2)
    else:
        blade = join([loft([at(outline, low), at(outline, high)]), cap(outline, high), cap(outline, low, up=False)])
    return [Part(m.HORN, blade, Occlusion([Solid(circle(1.0, 8), -60.0, -59.0)], floor=False).light(blade))]
