"""Projection of a scene, with which the page places names and handles on servos."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import viser

from hornbill.view.case import ARC_HEIGHT, HORN_REACH, Vector
from hornbill.view.layout import Placed

_DECIMALS = 4


@dataclass(frozen=True, slots=True)
class Stand:
    """A servo in the scene: foot of its shaft, bounding box, and the disc swept by its horn."""

    uid: str
    at: Vector
    low: Vector
    high: Vector
    height: float
    reach: float


@dataclass(frozen=True, slots=True)
class Projection:
    """A camera and the servos in view, the selected one first. Scene units; z is up."""

    eye: Vector
    right: Vector
    down: Vector
    ahead: Vector
    fov: float
    """Vertical field of view, rad."""
    servos: tuple[Stand, ...]


def projection_of(camera: viser.CameraHandle, placed: Sequence[Placed]) -> Projection:
    """Projection of placed servos by a camera."""
    w, x, y, z = (float(part) for part in camera.wxyz)
    return Projection(
        eye=_rounded(camera.position),
        right=_rounded((1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))),
        down=_rounded((2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x))),
        ahead=_rounded((2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))),
        fov=round(float(camera.fov), _DECIMALS),
        servos=tuple(_stand(one) for one in placed),
    )


def _stand(one: Placed) -> Stand:
    case, (low, high) = one.case, one.case.box
    size = case.horn * one.scale
    return Stand(
        one.pose.uid,
        _rounded(one.at),
        _rounded([side * one.scale for side in low]),
        _rounded([side * one.scale for side in high]),
        round(case.pivot * one.scale + ARC_HEIGHT * size, _DECIMALS),
        round(HORN_REACH * size, _DECIMALS),
    )


def _rounded(of: Iterable[float]) -> Vector:
    x, y, z = (round(float(part), _DECIMALS) for part in of)
    return (x, y, z)
