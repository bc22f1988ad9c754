"""Surroundings of the servos: floor, lights, reflections and haze, by theme, quality and layout."""

import viser

from hornbill.view.layout import CAMERA_FOV_DEG, CAMERA_POSITION, CAMERA_TARGET
from hornbill.view.palette import Palette
from hornbill.view.view_settings import Quality

_NO_TURN = (1.0, 0.0, 0.0, 0.0)


def prepare(server: viser.ViserServer) -> None:
    """Settings for all browsers: no axes, lights or branding of viser, and the initial camera."""
    server.scene.world_axes.visible = False
    server.scene.configure_default_lights(False)
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    camera = server.initial_camera
    camera.position, camera.look_at = CAMERA_POSITION, CAMERA_TARGET
    camera.fov = CAMERA_FOV_DEG * 3.141592653589793 / 180
    camera.near, camera.far = 0.1, 200.0


class Stage:
    """Floor and lights of one browser. Nodes are created once, then changed."""

    def __init__(self, client: viser.ClientHandle, colours: Palette, quality: Quality, *, wall: bool) -> None:
        self._scene = client.scene
        self._floor = self._scene.add_grid(
            "/stage/floor",
            infinite_grid=True,
            cell_size=1.25,
            cell_thickness=0.8,
            section_size=2.5,
            section_thickness=0.8,
            fade_distance=17.0,
            fade_strength=1.6,
            fade_from="origin",
            plane_opacity=0.0,
            position=(0.0, 0.0, -0.02),
        )
        # High and from behind on the left, for a short shadow with a sharp edge.
        self._key = self._scene.add_light_directional(
            "/stage/key", color=(255, 250, 242), position=(-3.0, -2.6, 8.2), cast_shadow=True
        )
        self._rim = self._scene.add_light_directional(
            "/stage/rim", color=(214, 228, 255), position=(5.0, 3.0, 2.4), cast_shadow=False
        )
        self._sky = self._scene.add_light_hemisphere(
            "/stage/sky", sky_color=(240, 244, 250), ground_color=(96, 100, 104), visible=False
        )
        self.look(colours, quality, wall=wall)

    def look(self, colours: Palette, quality: Quality, *, wall: bool) -> None:
        """Apply a theme and a quality. The floor of a wall has no lines. viser sends only changes."""
        high = quality == "high"
        self._floor.cell_color = colours.cell
        self._floor.section_color = colours.section
        self._floor.visible = high or not wall
        self._floor.cell_thickness = self._floor.section_thickness = 0.0 if wall else 0.8
        self._floor.shadow_opacity = colours.shadow if high else 0.0
        self._key.cast_shadow = high
        self._key.intensity = colours.key if high else 2.0
        self._rim.intensity = colours.rim
        self._rim.visible = high
        self._sky.visible = not high
        self._sky.intensity = 3.2
        near, far = (60.0, 120.0) if wall else (9.0, 27.0)
        self._scene.configure_fog(near, far, color=colours.haze)
        self._scene.configure_environment_map(
            "studio" if high else None,
            environment_intensity=colours.surroundings,
            environment_wxyz=_NO_TURN,
        )
