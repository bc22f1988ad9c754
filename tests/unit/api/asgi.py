"""Sends a request to an application without a server."""

import asyncio

import httpx
from fastapi import FastAPI


def send(
    app: FastAPI, method: str, path: str, *, headers: dict[str, str] | None = None, root: str = ""
) -> httpx.Response:
    """The response of `app`, which is mounted below `root`."""

    async def main() -> httpx.Response:
        transport = httpx.ASGITransport(app, raise_app_exceptions=False, root_path=root)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1", headers=headers) as client:
            return await client.request(method, root + path)

    return asyncio.run(main())
