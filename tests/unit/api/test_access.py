"""Tokens that another process changes."""

import asyncio

import pytest

from hornbill.api.security.access import REFRESH_S, Access
from hornbill.errors import StoreFailed
from hornbill.store.store import Store


async def test_a_revoked_token_is_forgotten_as_soon_as_the_database_can_be_read_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with Store("sqlite://") as store:
        store.tokens.add("rig", "view")
        access = Access(now=lambda: 0.0)
        access.open(store)
        store.tokens.drop("rig")
        read, failed = store.tokens.all, StoreFailed("away", cause="store_unusable", reason="unreachable", retry=True)
        outcomes = iter((failed, None))

        def read_at_second_try() -> object:
            if (error := next(outcomes)) is not None:
                raise error
            return read()

        monkeypatch.setattr(store.tokens, "all", read_at_second_try)
        for listener in store._on_changed:  # pyright: ignore[reportPrivateUsage]
            listener("tokens")
        fresh = asyncio.create_task(access.keep_fresh())
        await asyncio.sleep(REFRESH_S * 1.5)
        assert "rig" in {one.name for one in access._tokens.values()}  # pyright: ignore[reportPrivateUsage]
        await asyncio.sleep(REFRESH_S)
        assert access._tokens == {}  # pyright: ignore[reportPrivateUsage]
        fresh.cancel()
