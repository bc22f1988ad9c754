"""The view with a real viser server, and an onlooker in place of a browser."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed

from hornbill.view.geometry import horn_wxyz
from hornbill.view.layout import place
from hornbill.view.view_settings import ViewSettings, Wall
from hornbill.view.viewer import Viewer
from unit.view.onlooker import CAMERA, Onlooker, click, eventually, names
from unit.view.servos import Servos, pose

Make = Callable[..., Viewer]
KEY, OTHER = "a" * 32, "b" * 32


@pytest.fixture
def make() -> Iterator[Make]:
    """Starts viewers and waits until they serve; closes them at the end."""
    made: list[Viewer] = []

    def start(servos: Servos, **more: Any) -> Viewer:
        viewer = Viewer(servos, **more)
        made.append(viewer)
        viewer.start()
        viewer.ready.result(20)
        return viewer

    yield start
    for viewer in made:
        viewer.close()


def look(viewer: Viewer, key: str = KEY) -> Onlooker:
    """An onlooker that viser counts as connected, with the whole scene read."""
    onlooker = Onlooker(f"ws://127.0.0.1:{viewer.port}/{key}")
    onlooker.send(CAMERA)
    onlooker.read_until(lambda message: message.get("name") == "/hero/pivot")
    eventually(lambda: viewer.watched)
    # models are made when they are first shown: the scene is complete after a whole turn, and read after a pause
    source = cast("Servos", viewer._source)  # pyright: ignore[reportPrivateUsage]
    begun = source.calls
    eventually(lambda: source.calls > begun + 1)
    while onlooker.read_for(0.3):
        pass
    return onlooker


def moved(name: str) -> Callable[[dict[str, Any]], bool]:
    return lambda message: message["type"] == "SetOrientationMessage" and message["name"] == name


def test_importing_the_view_does_not_load_viser() -> None:
    code = "import sys, hornbill.view.viewer, hornbill.view.proxy; sys.exit('viser' in sys.modules)"
    subprocess.run(
        [sys.executable, "-c", code], check=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    )


def test_the_whole_scene_is_sent_to_an_onlooker(make: Make) -> None:
    servos = Servos(pose(0), pose(1, series="BLA15"), pose(2, stale=True))
    with look(make(servos)) as onlooker:
        known = names(onlooker.messages)
    assert {"/stage/floor", "/stage/key", "/hero/bla21-high", "/hero/pivot/horn-high", "/hero/arc/scale"} <= known
    assert {"/crowd/bla15-far-high", "/crowd/bla21-far-high", "/crowd/horn-far-high", "/crowd/stale"} <= known
    assert not any(name.endswith("-low") for name in known)
    kinds = {message["type"] for message in onlooker.messages}
    assert "LabelMessage" not in kinds, "the scene has no text"


def test_it_listens_on_the_loopback_address_only(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_VISER_PORT_OVERRIDE", "8931")
    viewer = make(Servos(pose()))
    assert viewer.port not in (None, 8080, 8931)
    table = Path("/proc/net/tcp")
    if table.exists():
        rows = [line.split() for line in table.read_text("ascii").splitlines()]
        listening = {row[1] for row in rows if row[3] == "0A"}
        assert f"0100007F:{viewer.port:04X}" in listening
        assert f"00000000:{viewer.port:04X}" not in listening


def test_the_horn_turns_clockwise_for_a_positive_angle(make: Make) -> None:
    servos = Servos(pose(angle_deg=0.0))
    with look(make(servos)) as onlooker:
        servos.now = (pose(angle_deg=90.0),)
        got = onlooker.read_until(moved("/hero/pivot"))
    wxyz = next(message for message in got if moved("/hero/pivot")(message))["wxyz"]
    assert wxyz == pytest.approx(horn_wxyz(90.0))
    assert wxyz[3] < 0, "clockwise seen from above is about -z"


def test_only_what_changed_is_sent(make: Make) -> None:
    servos = Servos(*(pose(number) for number in range(6)))
    with look(make(servos)) as onlooker:
        assert onlooker.read_for(0.3) == []
        servos.now = (pose(0, angle_deg=45.01), *servos.now[1:])
        assert onlooker.read_for(0.2) == [], "too small to see"
        servos.now = (pose(0, angle_deg=50.0), *servos.now[1:])
        got = onlooker.read_until(moved("/hero/pivot")) + onlooker.read_for(0.2)
        assert names(got) == {"/hero/pivot"}
        servos.now = (*servos.now[:5], pose(5, angle_deg=-20.0))
        got = onlooker.read_until(lambda message: "name" in message) + onlooker.read_for(0.2)
        assert names(got) == {"/crowd/horn-far-high"}
        assert [set(message["updates"]) for message in got] == [{"batched_wxyzs"}]
        servos.now = (pose(0, angle_deg=50.0, limit_cw_deg=60.0), *servos.now[1:])
        got = onlooker.read_until(lambda message: "name" in message) + onlooker.read_for(0.2)
        assert names(got) == {"/hero/arc/sector", "/hero/arc/scale"}


def visible(messages: list[dict[str, Any]]) -> dict[str, bool]:
    """The last visibility of each node that was sent."""
    return {m["name"]: m["visible"] for m in messages if m["type"] == "SetSceneNodeVisibilityMessage"}


def test_a_stale_servo_has_a_grey_horn_and_neither_arc_nor_ghost(make: Make) -> None:
    servos = Servos(pose())
    with look(make(servos)) as onlooker:
        assert visible(onlooker.messages)["/hero/arc"]
        servos.now = (pose(stale=True),)
        onlooker.read_until(lambda m: m.get("name") == "/hero/arc")
        onlooker.read_for(0.2)
        shown = visible(onlooker.messages)
    nodes = ("/hero/pivot/horn-high", "/hero/pivot/stale", "/hero/arc", "/hero/ghost")
    assert [shown[name] for name in nodes] == [False, True, False, False]


def visibility(name: str, shown: bool) -> Callable[[dict[str, Any]], bool]:
    return lambda message: message.get("name") == name and message.get("visible") is shown


def test_unknown_values_are_not_drawn(make: Make) -> None:
    servos = Servos(pose())
    with look(make(servos)) as onlooker:
        unknown: list[tuple[dict[str, Any], str]] = [
            ({"angle_deg": None}, "/hero/pivot"), ({"command_deg": None}, "/hero/ghost"),
            ({"command_deg": 45.1}, "/hero/ghost"), ({"limit_cw_deg": None}, "/hero/arc"),
        ]  # fmt: skip
        for more, hidden in unknown:
            servos.now = (pose(**more),)
            onlooker.read_until(visibility(hidden, False))
            servos.now = (pose(),)
            onlooker.read_until(visibility(hidden, True))


def test_a_click_selects_and_reports_a_servo(make: Make) -> None:
    selected: list[str] = []
    servos = Servos(*(pose(number) for number in range(3)))
    viewer = make(servos)
    end = viewer.on_pick(KEY, selected.append)
    x, y, _ = place(servos.now, servos.now[0].uid)[1][0].at
    with look(viewer) as onlooker, look(viewer, OTHER) as beside:
        onlooker.send(click((x, y, 9.0), (0.0, 0.0, -1.0)))
        eventually(lambda: bool(selected))
        onlooker.send(click((50.0, 50.0, 9.0), (0.0, 0.0, -1.0)))
        assert names(onlooker.read_for(0.3)) == set(), "a click beside servos changes nothing"
        end()
        onlooker.send(click((x, y, 9.0), (0.0, 0.0, -1.0)))
        onlooker.read_until(lambda m: "name" in m)
        assert names(beside.read_for(0.3)) == set()
    assert selected == [servos.now[1].uid]
    assert viewer.settings(KEY).selected == servos.now[1].uid


def test_poses_are_read_only_while_a_visible_frame_is_connected(make: Make) -> None:
    servos = Servos(pose())
    viewer = make(servos)

    def assert_not_read() -> None:
        eventually(lambda: not viewer.watched)
        calls = servos.calls
        time.sleep(0.3)
        assert servos.calls == calls

    assert_not_read()
    with look(viewer) as onlooker:
        calls = servos.calls
        eventually(lambda: servos.calls > calls + 5)
        viewer.show(KEY, ViewSettings(visible=False))
        assert_not_read()
        servos.now = (pose(angle_deg=-60.0),)
        assert onlooker.read_for(0.3) == []
        viewer.show(KEY, ViewSettings())
        onlooker.read_until(moved("/hero/pivot"))
    assert_not_read()


def test_theme_and_quality_change_without_a_new_connection(make: Make) -> None:
    viewer = make(Servos(pose(0), pose(1)))
    with look(viewer) as onlooker:
        viewer.show(KEY, ViewSettings(dark=False))
        got = onlooker.read_until(lambda m: m.get("name") == "/stage/floor")
        assert any("cell_color" in m.get("updates", {}) for m in got)
        viewer.show(KEY, ViewSettings(dark=False, quality="low"))
        onlooker.read_until(lambda m: m.get("name") == "/hero/bla21-low")
        onlooker.read_for(0.3)
        environments = [m for m in onlooker.messages if m["type"] == "EnvironmentMapMessage"]
        assert environments[-1]["hdri_data"] is None
        assert visible(onlooker.messages)["/hero/bla21-high"] is False
        assert visible(onlooker.messages)["/crowd/bla21-far-high"] is False


def test_each_browser_has_its_selection_theme_and_quality(make: Make) -> None:
    servos = Servos(pose(0), pose(1, series="BLA15"))
    viewer = make(servos)
    viewer.show(KEY, ViewSettings(selected=servos.now[0].uid))
    viewer.show(OTHER, ViewSettings(selected=servos.now[1].uid, dark=False, quality="low"))
    with look(viewer) as one, look(viewer, OTHER) as other:
        assert "/hero/bla21-high" in names(one.messages)
        assert "/hero/bla15-low" in names(other.messages)
        assert not any(name.endswith("-low") for name in names(one.messages))
        assert not any(name.endswith("-high") for name in names(other.messages))
        fogs = [[m["color"] for m in each.messages if m["type"] == "FogMessage"][-1] for each in (one, other)]
        assert fogs[0] != fogs[1]
        one.read_for(0.2)
        viewer.show(OTHER, ViewSettings(selected=servos.now[0].uid, dark=False, quality="low"))
        other.read_until(lambda m: m.get("name") == "/hero/bla21-low")
        assert one.read_for(0.3) == [], "the other browser is not affected"


def test_a_wall_shows_the_servos_in_the_given_order(make: Make) -> None:
    servos = Servos(*(pose(number) for number in range(5)))
    viewer = make(servos)
    uids = tuple(one.uid for one in servos.now[::-1])
    viewer.show(KEY, ViewSettings(wall=Wall(3, 0.5, ("f" * 32, *uids))))
    with look(viewer) as onlooker:
        known = names(onlooker.messages)
        assert {"/crowd/bla21-far-high", "/crowd/horn-far-high", "/crowd/arcs"} <= known
        assert not any(name.startswith("/hero/bla") for name in known)
        viewer.show(KEY, ViewSettings())
        onlooker.read_until(lambda m: m.get("name") == "/hero/bla21-high")


def test_poses_of_a_recording_replace_those_of_the_bus(make: Make) -> None:
    servos = Servos(pose(0, angle_deg=10.0))
    viewer = make(servos)
    with look(viewer) as onlooker:
        viewer.show(KEY, ViewSettings(poses=(pose(0, angle_deg=-33.0),)))
        got = onlooker.read_until(moved("/hero/pivot"))
        assert next(m for m in got if moved("/hero/pivot")(m))["wxyz"] == pytest.approx(horn_wxyz(-33.0))
        onlooker.read_for(0.2)
        servos.now = (pose(0, angle_deg=80.0),)
        assert onlooker.read_for(0.3) == []
        assert not viewer.watched, "no poses of the bus are needed"
        before = len(onlooker.messages)
        viewer.show(KEY, ViewSettings())
        got = onlooker.read_until(moved("/hero/pivot"))
        assert next(m for m in got if moved("/hero/pivot")(m))["wxyz"] == pytest.approx(horn_wxyz(80.0))
        assert len(onlooker.messages) > before, "the servos of the bus are shown again"


def test_a_recorded_stale_servo_has_a_grey_horn_and_without_a_value_none(make: Make) -> None:
    """A servo of an unknown model that is not on the bus."""
    viewer = make(Servos())
    viewer.show(KEY, ViewSettings(poses=(pose(7, series="", stale=True),)))
    onlooker = Onlooker(f"ws://127.0.0.1:{viewer.port}/{KEY}")
    with onlooker:
        onlooker.send(CAMERA)
        onlooker.read_until(lambda m: m.get("name") == "/hero/plain-high")
        onlooker.read_for(0.3)
        shown = visible(onlooker.messages)
        assert (shown["/hero/pivot"], shown["/hero/pivot/stale"], shown["/hero/ghost"]) == (True, True, False)
        viewer.show(KEY, ViewSettings(poses=(pose(7, series="", angle_deg=None, stale=True),)))
        onlooker.read_until(lambda m: m.get("name") == "/hero/pivot" and m.get("visible") is False)


def test_reset_view_moves_the_camera_back(make: Make) -> None:
    viewer = make(Servos(pose()))
    with look(viewer) as onlooker:
        onlooker.send(CAMERA)  # the user orbits
        onlooker.read_for(0.2)
        viewer.show(KEY, ViewSettings(resets=1))
        got = onlooker.read_until(lambda m: m["type"] == "SetCameraPositionMessage")
    position = next(m for m in got if m["type"] == "SetCameraPositionMessage")["position"]
    assert np.linalg.norm(position) < 10


def test_the_public_tunnel_is_a_stub(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    import viser._viser

    opened: list[str] = []

    def tunnel(host: str, port: int) -> None:
        opened.append(host)

    monkeypatch.setattr(viser._viser, "ViserTunnel", tunnel)  # pyright: ignore[reportPrivateUsage]
    with look(make(Servos(pose()))) as onlooker:
        onlooker.send({"type": "ShareUrlRequest"})
        got = onlooker.read_for(0.5)
    assert opened == []
    assert not any(message["type"] == "ShareUrlUpdated" for message in got)


def test_a_failed_source_is_read_again(
    make: Make, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("hornbill.view.viewer._PAUSE_AFTER_ERROR", 0.05)
    servos = Servos(pose())
    with look(make(servos)) as onlooker:
        servos.broken = True
        eventually(lambda: "no poses today" in caplog.text)
        servos.broken = False
        servos.now = (pose(angle_deg=-60.0),)
        onlooker.read_until(moved("/hero/pivot"))


def test_closing_closes_viser_and_its_connections(make: Make) -> None:
    viewer = make(Servos(pose()))
    with look(viewer) as onlooker:
        viewer.close()
        assert viewer.port is None
        with pytest.raises(ConnectionClosed):
            onlooker.read_for(5)
    assert "hornbill-view" not in [thread.name for thread in threading.enumerate()]


def test_a_viewer_closed_before_its_start_stays_closed() -> None:
    viewer = Viewer(Servos())
    viewer.close()
    viewer.start()
    assert viewer.port is None
    with pytest.raises(RuntimeError, match="closed"):
        viewer.ready.result(1)


def test_a_scene_without_servos(make: Make) -> None:
    servos = Servos()
    with look(make(servos)) as onlooker:
        assert "/hero/bla21-high" not in names(onlooker.messages)
        servos.now = (pose(),)
        onlooker.read_until(lambda m: m.get("name") == "/hero/bla21-high")


@pytest.mark.parametrize("rate", [0.5, 61.0])
def test_an_invalid_rate_is_rejected(rate: float) -> None:
    with pytest.raises(ValueError, match="Use 1 to 60 Hz"):
        Viewer(Servos(), rate_hz=rate)
