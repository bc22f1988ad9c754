"""Facts on this server: the disk of the data folder, and the lag of the event loop."""

import asyncio
import shutil
from pathlib import Path

from hornbill.servo.doctor.server_record import ServerRecord
from hornbill.servo.runtime.hub import Hub
from hornbill.servo.runtime.loop_lag import LAG_S, WINDOW_S, LoopLag
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.store import Store


async def test_the_disk_of_the_data_folder_is_measured(tmp_path: Path) -> None:
    clock = asyncio.get_running_loop().time
    server = ServerRecord(Store("sqlite://"), Hub(), TimeBase(clock), LoopLag(), tmp_path)
    server.tick(clock())
    await asyncio.sleep(0.1)
    assert server.disk is not None
    assert 0 < server.disk[0] < server.disk[1] == shutil.disk_usage(tmp_path).total
    server._folder = tmp_path / "missing"  # pyright: ignore[reportPrivateUsage]
    await asyncio.sleep(11)
    server.tick(clock())
    await asyncio.sleep(0.1)
    assert server.disk is None, "not the last known value"


def test_only_long_and_recent_lags_count() -> None:
    lag = LoopLag()
    for at, late_s in ((1.0, LAG_S - 0.01), (2.0, 0.3), (3.0, 0.1), (3.1, -1e-9)):
        lag.add(at, late_s)
    assert (lag.worst_s(0), lag.worst_s(2.5), lag.worst_s(3.1), lag.last_s) == (0.3, 0.1, 0, 0)
    lag.add(2.1 + WINDOW_S, 0.06)
    assert lag.worst_s(0) == 0.1
    assert lag.lags.cumulative()[-1] == ("+Inf", 5)
