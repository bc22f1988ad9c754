"""Client for asyncio. `make generate` generates hornbill.client.sync from it."""
