"""Moving the camera of a browser that reports its own at the same time."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser
from viser import _messages
from viser._viser import _CameraHandleState  # pyright: ignore[reportPrivateUsage]

from hornbill.view import layout
from hornbill.view.watcher import aim

INITIAL = np.array(layout.CAMERA_POSITION), np.array(layout.CAMERA_TARGET)


@pytest.mark.parametrize("after", ["SetCameraPositionMessage", "SetCameraLookAtMessage"])
@pytest.mark.parametrize("nth", [0, 1])
def test_a_report_in_between_does_not_leave_the_camera_elsewhere(after: str, nth: int) -> None:
    """A browser is asked for its initial view while it first reports viser's own, then its initial one."""
    sent: list[Any] = []

    def queue_message(message: Any) -> None:
        sent.append(message)
        if [type(one).__name__ for one in sent].count(after) == nth + 1 and type(message).__name__ == after:
            reported(*INITIAL)

    connection = SimpleNamespace(queue_message=queue_message)
    camera = viser.CameraHandle(SimpleNamespace(_websock_connection=connection))  # pyright: ignore[reportArgumentType]

    def reported(position: Any, look_at: Any) -> None:
        old: _CameraHandleState = camera._state  # pyright: ignore[reportPrivateUsage]
        camera._state = replace(  # pyright: ignore[reportPrivateUsage]
            old, position=position, look_at=look_at, up_direction=np.array([0.0, 0.0, 1.0]), update_timestamp=1.0
        )

    reported(np.array([3.0, 3.0, 3.0]), np.zeros(3))
    aim(camera, layout.CAMERA_POSITION, layout.CAMERA_TARGET, layout.CAMERA_FOV_DEG)
    positions = [one.position for one in sent if isinstance(one, _messages.SetCameraPositionMessage)]
    targets = [one.look_at for one in sent if isinstance(one, _messages.SetCameraLookAtMessage)]
    assert positions[-1] == pytest.approx(layout.CAMERA_POSITION)
    assert targets[-1] == pytest.approx(layout.CAMERA_TARGET, abs=0.01)
