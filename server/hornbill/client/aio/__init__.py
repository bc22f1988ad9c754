"""The client for asyncio; hornbill.client.sync is made from it by `make generate`."""
