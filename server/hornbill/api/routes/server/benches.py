"""Route of the benches that share the database."""

from hornbill.api.dependencies import TheHost
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.bench import SiteBench

routes = Routes("inventory")


@routes.get("/benches", Role.VIEW, "store_failed")
async def list_benches(host: TheHost) -> list[SiteBench]:
    """List the benches that share the database, this one first, then by name."""
    return await host.site.benches()
