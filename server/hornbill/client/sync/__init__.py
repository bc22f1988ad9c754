"""Client without asyncio. Generated from hornbill.client.aio by `make generate`."""
