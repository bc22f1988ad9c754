"""A server that streams to its servos: `python -m bench.stop_server DEVICE FOLDER [DATABASE]`, as a user starts it
but for the ArrayCommands, which leave 50 times a second for every servo from within."""

import asyncio
import sys
from pathlib import Path

from fastapi import FastAPI

from hornbill.app import composition as application
from hornbill.app import serving
from hornbill.app.settings import Settings
from hornbill.errors import HornbillError
from hornbill.wire.messages import ActuatorCommand, CommandType

PERIOD_S = 1 / 50


async def stream(app: FastAPI) -> None:
    """One burst of up to 15 commands a message, for every servo, at a steady rate; a stop does not end it."""
    loop = asyncio.get_running_loop()
    due = loop.time()
    while True:
        due = max(due + PERIOD_S, loop.time())
        await asyncio.sleep(due - loop.time())
        host = getattr(app.state, "host", None)
        if host is None:
            continue
        commands = [
            ActuatorCommand(one.servo_id, CommandType.POSITION, 0.1) for one in host.fleet.all() if one.servo_id
        ]
        try:
            for first in range(0, len(commands), 15):
                host.requests.burst(commands[first : first + 15])
        except HornbillError:
            continue


async def serve(device: str, folder: Path, database: str | None = None) -> None:
    """Serve until interrupted."""
    settings = Settings(bus=f"slcan:{device}", data_dir=folder, database=database, port=0)
    app = application.build(settings, demo=False)
    async with asyncio.TaskGroup() as group:
        streaming = group.create_task(stream(app))
        await serving.serve(app, serving.listen("127.0.0.1", 0), "serving {url}")
        streaming.cancel()


if __name__ == "__main__":
    asyncio.run(serve(sys.argv[1], Path(sys.argv[2]), *sys.argv[3:]))
