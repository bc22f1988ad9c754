"""The server of the load benchmark: `python -m bench.load_server SERVOS`, the demo on a bus without bit times."""

import asyncio
import sys

from hornbill.app import composition as application
from hornbill.app import serving
from hornbill.app.settings import Settings


async def serve(servos: int) -> None:
    """Serve until interrupted."""
    app = application.build(Settings(servos=servos, port=0, view=False), demo=True, fast=True)
    await serving.serve(app, serving.listen("127.0.0.1", 0), "serving {url}")


if __name__ == "__main__":
    asyncio.run(serve(int(sys.argv[1])))
