"""Updates of the 3D scenes in a separate thread, only while a browser shows them."""

import logging
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, TypeVar

from hornbill.view.pose import PoseSource
from hornbill.view.view_settings import FrameSettings, ViewSettings

if TYPE_CHECKING:
    from hornbill.view.private import PrivateServer
    from hornbill.view.projection import Projection
    from hornbill.view.watcher import Watcher

_log = logging.getLogger(__name__)

_PAUSE_AFTER_ERROR = 1.0
_T = TypeVar("_T")


@dataclass(slots=True, eq=False)
class _ProjectionListener:
    """A listener for projections, and the last one sent to it."""

    publish: "Callable[[Projection], None]"
    last: "Projection | None" = None


class Viewer:
    """The 3D view of the servos of `source`: for each browser a scene with its own settings.

    A browser is identified by the key in its frame's address; two frames with the same key share settings. All methods
    may be called from any thread and return at once. `start` imports viser, in the view's thread. A click only selects.
    """

    def __init__(self, source: PoseSource, *, rate_hz: float = 25.0) -> None:
        """`rate_hz`: update rate, 1 to 60 Hz, the maximum of viser. Raises ValueError outside."""
        if not 1.0 <= rate_hz <= 60.0:
            raise ValueError(f"{rate_hz:g} Hz is outside the range of the 3D view. Use 1 to 60 Hz.")
        self._source = source
        self._period = 1.0 / rate_hz
        self._settings = FrameSettings()
        self._listeners: dict[str, list[Callable[[str], None]]] = {}
        self._projections: dict[str, list[_ProjectionListener]] = {}
        self._lock = Lock()
        self._wake = Event()
        self._closing = False
        self._thread: Thread | None = None
        self._watched = False
        self._watchers: dict[int, Watcher] = {}
        self.ready: Future[int] = Future()
        """Loopback port once viser serves there. Fails if viser cannot start."""

    @property
    def port(self) -> int | None:
        """Loopback port of viser. None before it listens and after `close`."""
        if self._closing or not self.ready.done() or self.ready.exception() is not None:
            return None
        return self.ready.result()

    def error(self) -> str | None:
        """Why the view cannot start or be drawn. None if it works, or was not needed yet."""
        if self._closing or not self.ready.done():
            return None
        error = self.ready.exception()
        return None if error is None else str(error) or type(error).__name__

    @property
    def watched(self) -> bool:
        """Whether a browser shows the servos of the bus."""
        return self._watched

    def start(self) -> None:
        """Start the view's thread, which loads viser. No effect if it runs already or was closed."""
        with self._lock:
            if self._thread is None and not self._closing:
                self._thread = Thread(target=self._run, name="hornbill-view", daemon=True)
                self._thread.start()

    def close(self) -> None:
        """End the thread and viser, which closes the browsers' connections. Waits a few seconds at most."""
        with self._lock:
            self._closing = True
            thread = self._thread
        self._wake.set()
        if thread is not None:
            thread.join(timeout=8.0)
        elif not self.ready.done():
            self.ready.set_exception(RuntimeError("the 3D view was closed"))

    def settings(self, key: str) -> ViewSettings:
        """Settings of the frame with this key."""
        return self._settings.of(key)

    def show(self, key: str, settings: ViewSettings) -> None:
        """Apply settings to the frame with this key."""
        self._settings.put(key, settings)
        self._wake.set()

    def on_pick(self, key: str, listener: Callable[[str], None]) -> Callable[[], None]:
        """Call `listener` with the unique ID of a servo clicked in the frame with this key, from a thread of viser.

        The frame then waits for new settings; without a listener it selects the servo itself. Returns a function to
        unsubscribe.
        """
        return self._listen_to(self._listeners, key, listener)

    def on_projection(self, key: str, listener: "Callable[[Projection], None]") -> Callable[[], None]:
        """Call `listener` with the projection of the near view of this key's frame, at once and at each change, from
        the view's thread. Returns a function to unsubscribe."""
        unsubscribe = self._listen_to(self._projections, key, _ProjectionListener(listener))
        self._wake.set()
        return unsubscribe

    def _listen_to(self, listeners: dict[str, list[_T]], key: str, one: _T) -> Callable[[], None]:
        with self._lock:
            listeners.setdefault(key, []).append(one)

        def unsubscribe() -> None:
            with self._lock:
                left = [other for other in listeners.get(key, []) if other is not one]
                if left:
                    listeners[key] = left
                else:
                    listeners.pop(key, None)

        return unsubscribe

    def _run(self) -> None:
        self.ready.set_running_or_notify_cancel()  # no timeout of a waiter can cancel it from here on
        try:
            from hornbill.view.private import PrivateServer
            from hornbill.view.stage import prepare

            server = PrivateServer()
        except Exception as error:
            _log.exception("The 3D view cannot start")
            self.ready.set_exception(error)
            return
        try:
            prepare(server)
            self._listen(server)
            self.ready.set_result(server.get_port())
            self._draw(server)
        finally:
            server.stop()
            if not self.ready.done():
                self.ready.set_exception(RuntimeError("the 3D view could not be drawn"))

    def _draw(self, server: "PrivateServer") -> None:
        while not self._closing:
            began = time.monotonic()
            pause = self._period
            visible = False
            try:
                visible = self._turn(server)
            except Exception:
                visible = True
                _log.exception("The 3D view could not be updated")
                pause = _PAUSE_AFTER_ERROR
            # Without a visible frame, wait for one or for new settings.
            self._wake.wait(pause - (time.monotonic() - began) if visible else None)
            self._wake.clear()

    def _turn(self, server: "PrivateServer") -> bool:
        """Draw all visible frames. Returns False if none shows the bus."""
        self._update_watchers(server)
        wanted = [(watcher, self._settings.of(watcher.key)) for watcher in self._watchers.values()]
        self._watched = any(settings.visible and settings.poses is None for _, settings in wanted)
        poses = self._source.poses() if self._watched else ()
        for watcher, settings in wanted:
            if not settings.visible:
                continue
            try:
                watcher.update(poses if settings.poses is None else settings.poses, settings)
                self._publish_projection(watcher)
            except Exception:
                if watcher.number in server.get_clients():  # otherwise it disconnected meanwhile
                    raise
        return self._watched

    def _publish_projection(self, watcher: "Watcher") -> None:
        with self._lock:
            listeners = tuple(self._projections.get(watcher.key, ()))
        projection = watcher.projection() if listeners else None
        for one in listeners:
            if projection is not None and projection != one.last:
                one.last = projection
                one.publish(projection)

    def _update_watchers(self, server: "PrivateServer") -> None:
        """Create scenes for new browsers and drop those of disconnected ones."""
        clients = server.get_clients()
        for gone in self._watchers.keys() - clients.keys():
            del self._watchers[gone]
        for number, client in clients.items():
            if number not in self._watchers:
                from hornbill.view.watcher import Watcher

                self._watchers[number] = Watcher(client, server.key_of(client))
                client.camera.on_update(lambda _: None if self._watched else self._wake.set())

    def _listen(self, server: "PrivateServer") -> None:
        """Register callbacks of viser, called in threads of its pool. They only select and wake."""
        from viser import ClientHandle, SceneClickEvent

        @server.on_client_connect
        def _(_: ClientHandle) -> None:
            self._wake.set()

        @server.on_client_disconnect
        def _(_: ClientHandle) -> None:
            self._wake.set()

        @server.scene.on_click()
        def _(event: SceneClickEvent) -> None:
            watcher = self._watchers.get(event.client_id)
            uid = None if watcher is None else watcher.pick(event.ray_origin, event.ray_direction)
            if watcher is None or uid is None:
                return
            with self._lock:
                listeners = tuple(self._listeners.get(watcher.key, ()))
            for listener in listeners:
                listener(uid)
            if not listeners:
                self.show(watcher.key, replace(self._settings.of(watcher.key), selected=uid))
