"""Owns what surrounds the servos: floor, lights, reflections, camera limits; in two themes and two qualities."""

import viser

from hornbill.view.layout import CAMERA_FOV_DEG, CAMERA_POSITION, CAMERA_TARGET
from hornbill.view.models import Quality
from hornbill.view.palette import Palette

_NO_TURN = (1.0, 0.0, 0.0, 0.0)


class Stage:
    """Floor and lights; nodes are made once and changed afterwards."""

    def __init__(self, server: viser.ViserServer, colours: Palette, quality: Quality) -> None:
        self._scene = server.scene
        self._scene.world_axes.visible = False
        self._scene.configure_default_lights(False)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        camera = server.initial_camera
        camera.position, camera.look_at = CAMERA_POSITION, CAMERA_TARGET
        camera.fov = CAMERA_FOV_DEG * 3.141592653589793 / 180
        camera.near, camera.far = 0.1, 200.0
        self._floor = self._scene.add_grid(
            "/stage/floor",
            infinite_grid=True,
            cell_size=0.5,
            cell_thickness=1.0,
            section_size=2.5,
            section_thickness=1.0,
            fade_distance=22.0,
            fade_strength=1.4,
            fade_from="origin",
            plane_opacity=0.0,
            position=(0.0, 0.0, -0.02),
        )
        self._key = self._scene.add_light_directional(
            "/stage/key", color=(255, 250, 242), position=(-3.6, -4.2, 6.4), cast_shadow=True
        )
        self._rim = self._scene.add_light_directional(
            "/stage/rim", color=(214, 228, 255), position=(5.0, 2.0, 2.0), cast_shadow=False
        )
        self._sky = self._scene.add_light_hemisphere(
            "/stage/sky", sky_color=(240, 244, 250), ground_color=(96, 100, 104), visible=False
        )
        self.look(colours, quality)

    def look(self, colours: Palette, quality: Quality) -> None:
        """Takes on a theme and a quality. Only what differs is sent."""
        high = quality == "high"
        self._floor.cell_color = colours.cell
        self._floor.section_color = colours.section
        self._floor.shadow_opacity = colours.shadow if high else 0.0
        self._key.cast_shadow = high
        self._key.intensity = colours.key if high else 2.0
        self._rim.intensity = colours.rim
        self._rim.visible = high
        self._sky.visible = not high
        self._sky.intensity = 3.2
        self._scene.configure_fog(8.0, 34.0, color=colours.haze)
        self._scene.configure_environment_map(
            "studio" if high else None,
            environment_intensity=colours.surroundings,
            environment_wxyz=_NO_TURN,
        )
