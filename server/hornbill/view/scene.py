"""Puts stage, selected servo and the others together, and sends each change as one."""

from collections.abc import Sequence

import viser

from hornbill.view.crowd import Crowd
from hornbill.view.hero import Hero
from hornbill.view.layout import Placed
from hornbill.view.models import Quality
from hornbill.view.palette import Palette
from hornbill.view.stage import Stage


class Scene:
    """Everything drawn in one viser server."""

    def __init__(self, server: viser.ViserServer, colours: Palette, quality: Quality) -> None:
        self._server = server
        self._stage = Stage(server, colours, quality)
        self._hero = Hero(server, colours, quality)
        self._crowd = Crowd(server, colours, quality)
        self._shown: tuple[Placed | None, Sequence[Placed]] | None = None

    def look(self, colours: Palette, quality: Quality) -> None:
        """Takes on a theme and a quality."""
        with self._server.atomic():
            for part in (self._stage, self._hero, self._crowd):
                part.look(colours, quality)
        self._shown = None

    def show(self, hero: Placed | None, others: Sequence[Placed]) -> None:
        """Draws the servos; nothing is computed or sent when none of them changed."""
        if (hero, others) == self._shown:
            return
        with self._server.atomic():
            self._hero.show(hero)
            self._crowd.show(others)
        self._shown = (hero, others)
