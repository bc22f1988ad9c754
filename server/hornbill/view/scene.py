"""Scene of one browser: stage, selected servo and the others. Each change is sent atomically."""

from collections.abc import Sequence

import viser

from hornbill.view.crowd import Crowd
from hornbill.view.hero import Hero
from hornbill.view.layout import Placed
from hornbill.view.palette import Palette
from hornbill.view.stage import Stage
from hornbill.view.view_settings import Quality


class Scene:
    """Scene of one browser, with its own nodes."""

    def __init__(self, client: viser.ClientHandle, colours: Palette, quality: Quality, *, wall: bool) -> None:
        self._client = client
        with client.atomic():
            self._stage = Stage(client, colours, quality, wall=wall)
            self._hero = Hero(client, colours, quality)
            self._crowd = Crowd(client, colours, quality)
        self._shown: tuple[Placed | None, Sequence[Placed], bool] | None = None

    def look(self, colours: Palette, quality: Quality, *, wall: bool) -> None:
        """Apply a theme and a quality."""
        with self._client.atomic():
            self._stage.look(colours, quality, wall=wall)
            self._hero.look(colours, quality)
            self._crowd.look(colours, quality)
        self._shown = None

    def show(self, hero: Placed | None, others: Sequence[Placed], *, limits: bool) -> None:
        """Draw the servos, with `limits` also the limits of the others. Nothing is sent without a change."""
        if (hero, others, limits) == self._shown:
            return
        with self._client.atomic():
            self._hero.show(hero)
            self._crowd.show(others, limits=limits)
        self._shown = (hero, others, limits)
