"""The unselected servos: one batch per case model, and one each for horns, stale horns and ghosts."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from hornbill.view.case import ARC_HEIGHT, ARC_REACH, CASES, HORN_REACH, Vector
from hornbill.view.geometry import Points, horn_wxyz, ribbons, scale_lines, wrapped
from hornbill.view.layout import Placed
from hornbill.view.models import FAR, Name, glb, triangles
from hornbill.view.palette import Palette
from hornbill.view.view_settings import Quality

_ROOM = 4
"""Batches grow in steps of this size, so that a new servo rarely resizes them."""
_NOWHERE = (0.0, 0.0, -1000.0)
_STILL = (1.0, 0.0, 0.0, 0.0)
_ANGLE_DECIMALS = 1
_REACHED_DEG = 0.5
"""A command within this distance of the horn counts as reached and shows no ghost."""
_ARC = HORN_REACH * ARC_REACH
_COARSE_STEPS = 32
_RIBBON = 0.035
"""Width of an arc in low quality, where lines of constant width on the screen cost more than the servos do."""


class _Copy(NamedTuple):
    at: Vector
    scale: float = 1.0
    angle_deg: float = 0.0


def _fill(
    node: viser.BatchedGlbHandle | viser.BatchedMeshHandle, copies: Sequence[_Copy], before: Sequence[_Copy] | None
) -> None:
    """Place the copies of one model, unused ones out of view. Most updates only turn those of `before`."""
    room = -(-max(len(copies), 1) // _ROOM) * _ROOM
    wxyzs: NDArray[np.float32] = np.tile(np.array(_STILL, dtype=np.float32), (room, 1))
    for index, copy in enumerate(copies):
        wxyzs[index] = horn_wxyz(copy.angle_deg)
    if before is None or [copy[:2] for copy in before] != [copy[:2] for copy in copies]:
        positions: NDArray[np.float32] = np.tile(np.array(_NOWHERE, dtype=np.float32), (room, 1))
        scales: NDArray[np.float32] = np.ones(room, dtype=np.float32)
        for index, copy in enumerate(copies):
            positions[index], scales[index] = copy.at, copy.scale
        node.batched_positions = positions
        node.batched_scales = scales
    node.batched_wxyzs = wxyzs


class Crowd:
    """Draws the unselected servos. Batches are created when first needed; afterwards only their arrays change."""

    def __init__(self, client: viser.ClientHandle, colours: Palette, quality: Quality) -> None:
        self._scene = client.scene
        self._models: dict[tuple[Name, Quality], viser.BatchedGlbHandle] = {}
        self._overlays: dict[Literal["stale", "ghosts"], viser.BatchedMeshHandle] = {}
        self._colours = colours
        self._quality: Quality = quality
        self._filled: dict[str, list[_Copy]] = {}
        """Copies by the name of their node."""
        self._arcs: viser.LineSegmentsHandle | viser.MeshHandle | None = None
        self._drawn: tuple[tuple[Vector, float, float, float], ...] = ()

    def look(self, colours: Palette, quality: Quality) -> None:
        """Apply a theme and a quality. The next `show` fills the batches of that quality."""
        self._colours, self._quality = colours, quality
        for (_, made_for), model in self._models.items():
            model.visible = made_for == quality
        for name, overlay in self._overlays.items():
            overlay.batched_colors = np.array(self._colour(name), dtype=np.uint8)
        self._drawn = ()

    def show(self, servos: Sequence[Placed], *, limits: bool) -> None:
        """Draw these servos, with `limits` also their limit arcs. Call it inside `client.atomic()`."""
        for case in CASES:
            standing = [_Copy(servo.at, servo.scale) for servo in servos if servo.case is case]
            self._fill_model(FAR[case.key], standing)
        live: list[_Copy] = []
        stale: list[_Copy] = []
        ghosts: list[_Copy] = []
        for servo in servos:
            pose, case = servo.pose, servo.case
            hub = (servo.at[0], servo.at[1], servo.at[2] + case.pivot * servo.scale)
            size = case.horn * servo.scale
            angle, command = pose.angle_deg, pose.command_deg
            if angle is not None:
                (stale if pose.stale else live).append(_Copy(hub, size, round(angle, _ANGLE_DECIMALS)))
            reached = command is None or (angle is not None and abs(wrapped(command - angle)) < _REACHED_DEG)
            if command is not None and not (reached or pose.stale):
                ghosts.append(_Copy(hub, size, round(command, _ANGLE_DECIMALS)))
        self._fill_model("horn-far", live)
        self._fill_overlay("stale", stale)
        self._fill_overlay("ghosts", ghosts)
        self._show_limits(servos if limits else ())

    def _show_limits(self, servos: Sequence[Placed]) -> None:
        """Draw all arcs as one node, made again when a limit, a position or the look changes, which is rare."""
        wanted: list[tuple[Vector, float, float, float]] = []
        for servo in servos:
            pose, case = servo.pose, servo.case
            if pose.stale or pose.limit_cw_deg is None or pose.limit_ccw_deg is None:
                continue
            size = case.horn * servo.scale
            x, y, z = servo.at
            middle = (x, y, z + case.pivot * servo.scale + ARC_HEIGHT * size)
            wanted.append((middle, size, pose.limit_cw_deg, pose.limit_ccw_deg))
        if tuple(wanted) == self._drawn:
            return
        self._drawn = tuple(wanted)
        if self._arcs is not None:
            self._arcs.remove()
            self._arcs = None
        if not wanted:
            return
        if self._quality == "low":
            corners = np.concatenate(
                [
                    ribbons(scale_lines(cw, ccw, _ARC, tick=0.0, end=0.16, steps=_COARSE_STEPS), _RIBBON) * size
                    + np.array(middle, dtype=np.float32)
                    for middle, size, cw, ccw in wanted
                ]
            ).reshape(-1, 3)
            self._arcs = self._scene.add_mesh_simple(
                "/crowd/arcs",
                corners,
                np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
                color=self._colours.limit_face,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            return
        lines: list[Points] = [
            scale_lines(cw, ccw, _ARC, tick=0.0, end=0.16) * size + np.array(middle, dtype=np.float32)
            for middle, size, cw, ccw in wanted
        ]
        self._arcs = self._scene.add_line_segments(
            "/crowd/arcs",
            np.concatenate(lines).astype(np.float32),
            colors=self._colours.limit,
            thickness=1.5,
            thickness_units="screen",
        )

    def _fill_model(self, name: Name, copies: list[_Copy]) -> None:
        key = (name, self._quality)
        if key not in self._models and copies:
            self._models[key] = self._scene.add_batched_glb(
                f"/crowd/{name}-{self._quality}",
                glb(name, self._quality),
                batched_wxyzs=(_STILL,),
                batched_positions=(_NOWHERE,),
                batched_scales=(1.0,),
                lod="off",
                cast_shadow=self._quality == "high",
                receive_shadow=self._quality == "high",
            )
        if key in self._models:
            self._refill(self._models[key], copies)

    def _fill_overlay(self, name: Literal["stale", "ghosts"], copies: list[_Copy]) -> None:
        if name not in self._overlays and copies:
            points, faces = triangles("horn-far-low" if name == "stale" else "horn-ghost-far")
            self._overlays[name] = self._scene.add_batched_meshes_simple(
                f"/crowd/{name}",
                points,
                faces,
                batched_wxyzs=(_STILL,),
                batched_positions=(_NOWHERE,),
                batched_scales=(1.0,),
                batched_colors=self._colour(name),
                opacity=0.45,
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
            )
        if name in self._overlays:
            self._refill(self._overlays[name], copies)

    def _refill(self, node: viser.BatchedGlbHandle | viser.BatchedMeshHandle, copies: list[_Copy]) -> None:
        before = self._filled.get(node.name)
        if copies != before:
            _fill(node, copies, before)
            self._filled[node.name] = copies

    def _colour(self, name: Literal["stale", "ghosts"]) -> tuple[int, int, int]:
        return self._colours.stale if name == "stale" else self._colours.command_face
