"""Keeps the 3D scene up to date in a thread of its own, and only while somebody looks."""

import logging
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING

from hornbill.view.layout import CAMERA_FARTHEST, CAMERA_NEAREST, CAMERA_POSITION, CAMERA_TARGET, Placed, pick, place
from hornbill.view.models import Quality
from hornbill.view.palette import palette
from hornbill.view.pose import PoseSource

if TYPE_CHECKING:
    import viser

    from hornbill.view.scene import Scene

_log = logging.getLogger(__name__)

_PAUSE_AFTER_ERROR = 1.0


@dataclass(frozen=True, slots=True)
class _Wish:
    """What was asked of the view; the view's thread takes it up at its next turn."""

    selected: str | None = None
    dark: bool = True
    quality: Quality = "high"
    resets: int = 0


class Viewer:
    """The 3D view of the servos that `source` knows.

    Every method may be called from any thread and returns at once. viser is imported by `start`, in the view's
    thread. `on_select` is called with a uid when somebody clicks a servo, from a thread of viser's: hop to your own
    loop. Clicking selects and does nothing else.
    """

    def __init__(
        self, source: PoseSource, *, on_select: Callable[[str], None] | None = None, rate_hz: float = 25.0
    ) -> None:
        """`rate_hz` is how often poses are taken, 1 to 60 Hz: viser sends no faster. Raises ValueError beyond."""
        if not 1.0 <= rate_hz <= 60.0:
            raise ValueError(f"{rate_hz:g} Hz is outside what the 3D view can draw. Use 1 to 60 Hz.")
        self._source = source
        self._on_select = on_select
        self._period = 1.0 / rate_hz
        self._wish = _Wish()
        self._lock = Lock()
        self._wake = Event()
        self._closing = False
        self._thread: Thread | None = None
        self._watched = False
        self._placed: tuple[Placed, ...] = ()
        self.ready: Future[int] = Future()
        """Resolves to the loopback port once viser serves there; fails when viser cannot start."""

    @property
    def port(self) -> int | None:
        """The loopback port viser listens on; None before it does and after `close`."""
        if self._closing or not self.ready.done() or self.ready.exception() is not None:
            return None
        return self.ready.result()

    @property
    def watched(self) -> bool:
        """Whether a browser is looking."""
        return self._watched

    def start(self) -> None:
        """Starts the view's thread, which loads viser. Does nothing when it runs already or was closed."""
        with self._lock:
            if self._thread is None and not self._closing:
                self._thread = Thread(target=self._run, name="hornbill-view", daemon=True)
                self._thread.start()

    def close(self) -> None:
        """Ends the thread and viser with it; browsers see their connection close. Waits for that, some seconds at
        most."""
        with self._lock:
            self._closing = True
            thread = self._thread
        self._wake.set()
        if thread is not None:
            thread.join(timeout=8.0)
        elif not self.ready.done():
            self.ready.set_exception(RuntimeError("the 3D view was closed"))

    def select(self, uid: str) -> None:
        """Brings this servo to the front in every browser. An unknown uid shows the first servo until it turns up."""
        self._ask(lambda wish: replace(wish, selected=uid))

    def theme(self, dark: bool) -> None:
        """Colours floor, lights, ghost and limits for a dark or a light page, in every browser."""
        self._ask(lambda wish: replace(wish, dark=dark))

    def quality(self, quality: Quality) -> None:
        """`high`: reflections and shadows. `low`: plain light, for browsers that draw in software."""
        self._ask(lambda wish: replace(wish, quality=quality))

    def reset_view(self) -> None:
        """Puts the camera of every browser back where it started."""
        self._ask(lambda wish: replace(wish, resets=wish.resets + 1))

    def _ask(self, change: Callable[[_Wish], _Wish]) -> None:
        with self._lock:
            self._wish = change(self._wish)
        self._wake.set()

    def _run(self) -> None:
        self.ready.set_running_or_notify_cancel()  # from here on nobody's time-out can cancel it
        try:
            from hornbill.view.private import PrivateServer
            from hornbill.view.scene import Scene

            server = PrivateServer()
        except Exception as error:
            _log.exception("the 3D view cannot start")
            self.ready.set_exception(error)
            return
        try:
            wish = self._wish
            scene = Scene(server, palette(dark=wish.dark), wish.quality)
            self._listen(server)
            self._draw(server, scene, wish)
        finally:
            server.stop()
            if not self.ready.done():
                self.ready.set_exception(RuntimeError("the 3D view could not be drawn"))

    def _draw(self, server: "viser.ViserServer", scene: "Scene", wish: _Wish) -> None:
        while not self._closing:
            began = time.monotonic()
            before, wish = wish, self._wish
            self._watched = bool(server.get_clients())
            pause = self._period
            try:
                self._turn(server, scene, before, wish)
            except Exception:
                _log.exception("the 3D view could not take up the servos' poses")
                pause = _PAUSE_AFTER_ERROR
            if not self.ready.done():
                self.ready.set_result(server.get_port())
            # Without an onlooker this waits for one, or for a wish: nothing is computed for nobody.
            self._wake.wait(pause - (time.monotonic() - began) if self._watched else None)
            self._wake.clear()

    def _turn(self, server: "viser.ViserServer", scene: "Scene", before: _Wish, wish: _Wish) -> None:
        if (before.dark, before.quality) != (wish.dark, wish.quality):
            scene.look(palette(dark=wish.dark), wish.quality)
        if before.resets != wish.resets:
            for client in server.get_clients().values():
                client.camera.position, client.camera.look_at = CAMERA_POSITION, CAMERA_TARGET
        poses = self._source.poses()
        uids = {pose.uid for pose in poses}
        selected = wish.selected if wish.selected in uids else (poses[0].uid if poses else None)
        hero, others = place(poses, selected)
        self._placed = tuple(others) if hero is None else (hero, *others)
        scene.show(hero, others)

    def _listen(self, server: "viser.ViserServer") -> None:
        """Callbacks of viser, in threads of its pool. They select and wake, nothing else."""
        from viser import ClientHandle, SceneClickEvent

        @server.on_client_connect
        def _(client: ClientHandle) -> None:
            client.camera.min_orbit_distance = CAMERA_NEAREST
            client.camera.max_orbit_distance = CAMERA_FARTHEST
            self._wake.set()

        @server.scene.on_click()
        def _(event: SceneClickEvent) -> None:
            uid = pick(event.ray_origin, event.ray_direction, self._placed)
            if uid is None or uid == self._wish.selected:
                return
            self.select(uid)
            if self._on_select is not None:
                self._on_select(uid)
