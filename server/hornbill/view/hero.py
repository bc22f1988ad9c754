"""The selected servo: detailed case and horn, stale horn, command ghost, limit arc."""

import numpy as np
import viser

from hornbill.view.case import ARC_HEIGHT, HORN_REACH, Case
from hornbill.view.geometry import BAND_FACES, ORIGIN_FACES, band, dashed, horn_wxyz, origin_mark, scale_lines, wrapped
from hornbill.view.layout import Placed
from hornbill.view.models import NEAR, glb, outline, triangles
from hornbill.view.palette import Palette
from hornbill.view.pose import Pose
from hornbill.view.view_settings import Quality

_ANGLE_STEP_DEG = 0.02
"""Minimum change of angle that is sent."""
_REACHED_DEG = 0.3
"""A command within this distance of the horn counts as reached and shows no ghost."""
_INNER, _OUTER = HORN_REACH * 1.03, HORN_REACH * 1.22
ORIGIN = origin_mark(_OUTER + 0.05, 0.2)


class Hero:
    """Draws one servo at the origin. Nodes are created when first needed; afterwards only their properties change."""

    def __init__(self, client: viser.ClientHandle, colours: Palette, quality: Quality) -> None:
        scene = self._scene = client.scene
        self._cases: dict[str, viser.GlbHandle] = {}
        self._horns: dict[Quality, viser.GlbHandle] = {}
        self._quality: Quality = quality
        self._case: Case | None = None
        self._limits: tuple[float, float] | None = None
        self._angle = self._command = 0.0
        self._pivot = scene.add_frame("/hero/pivot", show_axes=False, visible=False)
        blade, faces = triangles("horn-far")
        self._stale = scene.add_mesh_simple(
            "/hero/pivot/stale", blade, faces, opacity=0.55, cast_shadow=False, receive_shadow=False, visible=False
        )
        blade, faces = triangles("horn-ghost")
        self._ghost = scene.add_frame("/hero/ghost", show_axes=False, visible=False)
        self._ghost_blade = scene.add_mesh_simple(
            "/hero/ghost/blade", blade, faces, cast_shadow=False, receive_shadow=False
        )
        self._ghost_edge = scene.add_line_segments(
            "/hero/ghost/edge",
            dashed(outline(blade), 0.07, 0.05),
            colors=colours.command,
            thickness=1.5,
            thickness_units="screen",
        )
        self._arc = scene.add_frame("/hero/arc", show_axes=False, visible=False)
        self._sector = scene.add_mesh_simple(
            "/hero/arc/sector",
            band(90.0, -90.0, _INNER, _OUTER),
            BAND_FACES,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._scale = scene.add_line_segments(
            "/hero/arc/scale",
            scale_lines(90.0, -90.0, _OUTER, tick=0.05, end=0.2),
            colors=colours.limit,
            thickness=2.0,
            thickness_units="screen",
        )
        self._origin = scene.add_mesh_simple(
            "/hero/arc/origin", ORIGIN, ORIGIN_FACES, side="double", cast_shadow=False, receive_shadow=False
        )
        self.look(colours, quality)

    def look(self, colours: Palette, quality: Quality) -> None:
        """Apply a theme and a quality."""
        self._quality = quality
        self._stale.color = colours.stale
        self._ghost_blade.color = colours.command_face
        self._ghost_blade.opacity = colours.command_fill
        self._ghost_edge.colors = np.array(colours.command, dtype=np.uint8)
        self._sector.color = colours.limit_face
        self._sector.opacity = colours.limit_fill
        self._origin.color = colours.ink
        self._scale.colors = np.array(colours.limit, dtype=np.uint8)
        if self._case is not None:
            self._show_case(self._case)

    def show(self, placed: Placed | None) -> None:
        """Draw this servo, or none. Call it inside `client.atomic()`."""
        if placed is None:
            for node in self._cases.values():
                node.visible = False
            for node in (self._pivot, self._ghost, self._arc):
                node.visible = False
            self._case = None
            return
        if placed.case is not self._case:
            self._show_case(placed.case)
        self._show_horn(placed.pose)
        self._show_command(placed.pose)
        self._show_limits(placed.pose)

    def _show_case(self, case: Case) -> None:
        self._case = case
        key = f"{case.key}-{self._quality}"
        if key not in self._cases:
            self._cases[key] = self._scene.add_glb(f"/hero/{key}", glb(NEAR[case.key], self._quality))
        for other, node in self._cases.items():
            node.visible = other == key
        if self._quality not in self._horns:
            self._horns[self._quality] = self._scene.add_glb(
                f"/hero/pivot/horn-{self._quality}", glb("horn-near", self._quality)
            )
        for node in (
            *self._horns.values(),
            self._stale,
            self._ghost_blade,
            self._ghost_edge,
            self._sector,
            self._scale,
            self._origin,
        ):
            node.scale = case.horn
        for node in (self._pivot, self._ghost):
            node.position = (0.0, 0.0, case.pivot)
        self._arc.position = (0.0, 0.0, case.pivot + ARC_HEIGHT * case.horn)

    def _show_horn(self, pose: Pose) -> None:
        self._pivot.visible = pose.angle_deg is not None
        self._stale.visible = pose.stale
        for quality, horn in self._horns.items():
            horn.visible = not pose.stale and quality == self._quality
        if pose.angle_deg is not None and abs(pose.angle_deg - self._angle) >= _ANGLE_STEP_DEG:
            self._angle = pose.angle_deg
            self._pivot.wxyz = horn_wxyz(pose.angle_deg)

    def _show_command(self, pose: Pose) -> None:
        command, angle = pose.command_deg, pose.angle_deg
        reached = command is None or (angle is not None and abs(wrapped(command - angle)) < _REACHED_DEG)
        self._ghost.visible = not (reached or pose.stale)
        if command is not None and abs(command - self._command) >= _ANGLE_STEP_DEG:
            self._command = command
            self._ghost.wxyz = horn_wxyz(command)

    def _show_limits(self, pose: Pose) -> None:
        cw, ccw = pose.limit_cw_deg, pose.limit_ccw_deg
        self._arc.visible = not (pose.stale or cw is None or ccw is None)
        if cw is None or ccw is None or (cw, ccw) == self._limits:
            return
        self._limits = (cw, ccw)
        self._sector.vertices = band(cw, ccw, _INNER, _OUTER)
        self._scale.points = scale_lines(cw, ccw, _OUTER, tick=0.05, end=0.2)
