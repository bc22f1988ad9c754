"""Keeps the 3D scenes up to date in a thread of its own, and only while somebody looks."""

import logging
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, TypeVar

from hornbill.view.pose import PoseSource
from hornbill.view.wish import ViewSettings, Wishes

if TYPE_CHECKING:
    from hornbill.view.private import PrivateServer
    from hornbill.view.sight import Sight
    from hornbill.view.watcher import Watcher

_log = logging.getLogger(__name__)

_PAUSE_AFTER_ERROR = 1.0
_T = TypeVar("_T")


@dataclass(slots=True, eq=False)
class _Sighted:
    """Who hears how a scene lies in its picture, and what it heard last."""

    tell: "Callable[[Sight], None]"
    told: "Sight | None" = None


class Viewer:
    """The 3D view of the servos that `source` knows: for each browser the scene its own wish asks for.

    A browser is known by the key in its frame's address; two frames with one key share a wish. Every method may be
    called from any thread and returns at once. viser is imported by `start`, in the view's thread. Clicking selects
    and does nothing else.
    """

    def __init__(self, source: PoseSource, *, rate_hz: float = 25.0) -> None:
        """`rate_hz` is how often poses are taken, 1 to 60 Hz: viser sends no faster. Raises ValueError beyond."""
        if not 1.0 <= rate_hz <= 60.0:
            raise ValueError(f"{rate_hz:g} Hz is outside what the 3D view can draw. Use 1 to 60 Hz.")
        self._source = source
        self._period = 1.0 / rate_hz
        self._wishes = Wishes()
        self._listeners: dict[str, list[Callable[[str], None]]] = {}
        self._sights: dict[str, list[_Sighted]] = {}
        self._lock = Lock()
        self._wake = Event()
        self._closing = False
        self._thread: Thread | None = None
        self._watched = False
        self._watchers: dict[int, Watcher] = {}
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
        """Whether a browser is looking at the servos of the bus."""
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

    def wish(self, key: str) -> ViewSettings:
        """What the frame of this key was last told to show."""
        return self._wishes.of(key)

    def show(self, key: str, wish: ViewSettings) -> None:
        """What the frame of this key shall show from now on; other frames stay as they are."""
        self._wishes.keep(key, wish)
        self._wake.set()

    def on_pick(self, key: str, tell: Callable[[str], None]) -> Callable[[], None]:
        """Calls `tell` with the uid of a servo clicked in the frame of this key, from a thread of viser's: hop to
        your own loop. The frame then waits for a wish; without a listener it selects by itself.

        Returns how to end it.
        """
        return self._listen_to(self._listeners, key, tell)

    def on_sight(self, key: str, tell: "Callable[[Sight], None]") -> Callable[[], None]:
        """Calls `tell` with how the near view of this key's frame lies in its picture, at once and whenever that
        changes, from the view's thread. Returns how to end it."""
        end = self._listen_to(self._sights, key, _Sighted(tell))
        self._wake.set()
        return end

    def _listen_to(self, listeners: dict[str, list[_T]], key: str, one: _T) -> Callable[[], None]:
        with self._lock:
            listeners.setdefault(key, []).append(one)

        def end() -> None:
            with self._lock:
                left = [other for other in listeners.get(key, []) if other is not one]
                if left:
                    listeners[key] = left
                else:
                    listeners.pop(key, None)

        return end

    def _run(self) -> None:
        self.ready.set_running_or_notify_cancel()  # from here on nobody's time-out can cancel it
        try:
            from hornbill.view.private import PrivateServer
            from hornbill.view.stage import prepare

            server = PrivateServer()
        except Exception as error:
            _log.exception("the 3D view cannot start")
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
            looking = False
            try:
                looking = self._turn(server)
            except Exception:
                looking = True
                _log.exception("the 3D view could not take up the servos' poses")
                pause = _PAUSE_AFTER_ERROR
            # Without an onlooker this waits for one, or for a wish: nothing is computed for nobody.
            self._wake.wait(pause - (time.monotonic() - began) if looking else None)
            self._wake.clear()

    def _turn(self, server: "PrivateServer") -> bool:
        """Draws for everybody who looks. False when there is nobody to come back for."""
        self._meet(server)
        wanted = [(watcher, self._wishes.of(watcher.key)) for watcher in self._watchers.values()]
        self._watched = any(wish.looking and wish.poses is None for _, wish in wanted)
        poses = self._source.poses() if self._watched else ()
        for watcher, wish in wanted:
            if not wish.looking:
                continue
            try:
                watcher.turn(poses if wish.poses is None else wish.poses, wish)
                self._tell_sight(watcher)
            except Exception:
                if watcher.number in server.get_clients():  # else it left in the middle of it
                    raise
        return self._watched

    def _tell_sight(self, watcher: "Watcher") -> None:
        with self._lock:
            listeners = tuple(self._sights.get(watcher.key, ()))
        sight = watcher.sight() if listeners else None
        for one in listeners:
            if sight is not None and sight != one.told:
                one.told = sight
                one.tell(sight)

    def _meet(self, server: "PrivateServer") -> None:
        """Gives whoever came a scene, and forgets whoever left."""
        clients = server.get_clients()
        for gone in self._watchers.keys() - clients.keys():
            del self._watchers[gone]
        for number, client in clients.items():
            if number not in self._watchers:
                from hornbill.view.watcher import Watcher

                self._watchers[number] = Watcher(client, server.key_of(client))
                client.camera.on_update(lambda _: None if self._watched else self._wake.set())

    def _listen(self, server: "PrivateServer") -> None:
        """Callbacks of viser, in threads of its pool. They select and wake, nothing else."""
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
            for tell in listeners:
                tell(uid)
            if not listeners:
                self.show(watcher.key, replace(self._wishes.of(watcher.key), selected=uid))
