"""One browser's scene, kept as its own wish has it, and what a click in it meets."""

from collections.abc import Sequence
from math import radians

import viser

from hornbill.view import layout
from hornbill.view.layout import Placed
from hornbill.view.palette import palette
from hornbill.view.pose import Pose
from hornbill.view.scene import Scene
from hornbill.view.sight import Sight, sight_of
from hornbill.view.wish import ViewSettings


class Watcher:
    """One browser that looks. `turn` belongs to the view's thread, `pick` to any."""

    def __init__(self, client: viser.ClientHandle, key: str) -> None:
        self.key = key
        self.number = client.client_id
        self._client = client
        self._wish = ViewSettings()
        self._scene: Scene | None = None
        self._placed: tuple[Placed, ...] = ()
        self._seen_from: tuple[bool, bool, int] | None = None
        client.camera.min_orbit_distance = layout.CAMERA_NEAREST
        client.camera.max_orbit_distance = layout.CAMERA_FARTHEST

    def turn(self, poses: Sequence[Pose], wish: ViewSettings) -> None:
        """Brings the scene to this wish and these servos."""
        before, self._wish = self._wish, wish
        on_wall = wish.wall is not None
        look = (wish.dark, wish.quality, on_wall)
        if self._scene is None:
            self._scene = Scene(self._client, palette(dark=wish.dark), wish.quality, wall=on_wall)
        elif look != (before.dark, before.quality, before.wall is not None):
            self._scene.look(palette(dark=wish.dark), wish.quality, wall=on_wall)
        hero: Placed | None = None
        if wish.wall is not None:
            others = layout.wall(poses, wish.wall.uids, wish.wall.columns, wish.wall.scale)
        else:
            known = any(pose.uid == wish.selected for pose in poses)
            hero, others = layout.place(poses, wish.selected if known or not poses else poses[0].uid)
            if wish.alone:
                others = []
        self._placed = tuple(others) if hero is None else (hero, *others)
        self._look_from(on_wall, alone=not others, resets=wish.resets)
        self._scene.show(hero, others, limits=on_wall)

    def pick(self, origin: layout.Vector, direction: layout.Vector) -> str | None:
        """The uid of the servo a ray meets first."""
        return layout.pick(origin, direction, self._placed)

    def sight(self) -> Sight | None:
        """How the servos lie in the picture of the near view; None for a wall, whose page knows it by itself."""
        if self._wish.wall is not None:
            return None
        return sight_of(self._client.camera, self._placed)

    def _look_from(self, on_wall: bool, *, alone: bool, resets: int) -> None:
        """Puts the camera where this scene starts, when another scene or a reset asks for it; else it stays the
        user's."""
        start = (on_wall, alone, resets)
        if start == self._seen_from:
            return
        self._seen_from = start
        camera = self._client.camera
        with self._client.atomic():
            if on_wall:
                camera.position, camera.look_at = layout.WALL_CAMERA_POSITION, layout.WALL_CAMERA_TARGET
                camera.fov = radians(layout.WALL_CAMERA_FOV_DEG)
            else:
                camera.position = layout.CAMERA_POSITION_ALONE if alone else layout.CAMERA_POSITION
                camera.look_at = layout.CAMERA_TARGET_ALONE if alone else layout.CAMERA_TARGET
                camera.fov = radians(layout.CAMERA_FOV_DEG)
