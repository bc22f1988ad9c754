"""Client without asyncio. Made from hornbill.client.aio by `make generate`."""
