"""Scene of one browser according to its settings, and picking of the clicked servo."""

from collections.abc import Sequence
from math import radians

import viser

from hornbill.view import layout
from hornbill.view.layout import Placed
from hornbill.view.palette import palette
from hornbill.view.pose import Pose
from hornbill.view.projection import Projection, projection_of
from hornbill.view.scene import Scene
from hornbill.view.view_settings import ViewSettings

_UNSEEN = 0.001
"""Displacement too small to see but large enough for viser to send, scene units."""


class Watcher:
    """One connected browser. Call `update` in the view's thread, `pick` in any thread."""

    def __init__(self, client: viser.ClientHandle, key: str) -> None:
        self.key = key
        self.number = client.client_id
        self._client = client
        self._settings = ViewSettings()
        self._scene: Scene | None = None
        self._placed: tuple[Placed, ...] = ()
        self._seen_from: tuple[bool, bool, int] | None = None
        client.camera.min_orbit_distance = layout.CAMERA_NEAREST
        client.camera.max_orbit_distance = layout.CAMERA_FARTHEST

    def update(self, poses: Sequence[Pose], settings: ViewSettings) -> None:
        """Update the scene to these settings and servos."""
        before, self._settings = self._settings, settings
        on_wall = settings.wall is not None
        look = (settings.dark, settings.quality, on_wall)
        if self._scene is None:
            self._scene = Scene(self._client, palette(dark=settings.dark), settings.quality, wall=on_wall)
        elif look != (before.dark, before.quality, before.wall is not None):
            self._scene.look(palette(dark=settings.dark), settings.quality, wall=on_wall)
        hero: Placed | None = None
        if settings.wall is not None:
            others = layout.wall(poses, settings.wall.uids, settings.wall.columns, settings.wall.scale)
        else:
            known = any(pose.uid == settings.selected for pose in poses)
            hero, others = layout.place(poses, settings.selected if known or not poses else poses[0].uid)
            if settings.alone:
                others = []
        self._placed = tuple(others) if hero is None else (hero, *others)
        self._look_from(on_wall, alone=not others, resets=settings.resets)
        self._scene.show(hero, others, limits=on_wall)

    def pick(self, origin: layout.Vector, direction: layout.Vector) -> str | None:
        """Unique ID of the first servo on a ray, or None."""
        return layout.pick(origin, direction, self._placed)

    def projection(self) -> Projection | None:
        """Projection of the near view. None for a wall, whose projection the page calculates itself."""
        if self._settings.wall is not None:
            return None
        return projection_of(self._client.camera, self._placed)

    def _look_from(self, on_wall: bool, *, alone: bool, resets: int) -> None:
        """Move the camera to its initial position after a change of layout or a reset. Otherwise the user controls
        it."""
        start = (on_wall, alone, resets)
        if start == self._seen_from:
            return
        self._seen_from = start
        camera = self._client.camera
        with self._client.atomic():
            if on_wall:
                aim(camera, layout.WALL_CAMERA_POSITION, layout.WALL_CAMERA_TARGET, layout.WALL_CAMERA_FOV_DEG)
            elif alone:
                aim(camera, layout.CAMERA_POSITION_ALONE, layout.CAMERA_TARGET_ALONE, layout.CAMERA_FOV_DEG)
            else:
                aim(camera, layout.CAMERA_POSITION, layout.CAMERA_TARGET, layout.CAMERA_FOV_DEG)


def aim(camera: viser.CameraHandle, position: layout.Vector, target: layout.Vector, fov_deg: float) -> None:
    """Move a camera. Positions are in scene units."""
    x, y, z = target
    camera.position = position  # viser moves the target along with it
    # viser does not send a target that equals the browser's last report. A report that arrives now would therefore
    # leave the browser with the moved target. This target differs from every report, so it is always sent.
    camera.look_at = (x, y, z + _UNSEEN)
    camera.look_at = target
    camera.fov = radians(fov_deg)
