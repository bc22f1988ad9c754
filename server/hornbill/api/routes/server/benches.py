"""Route of the benches that share the database."""

from hornbill.api.dependencies import TheHost
from hornbill.api.paging import Every
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.bench import SiteBench

routes = Routes("inventory")


@routes.get("/benches", Role.VIEW, "store_failed")
async def list_benches(host: TheHost, page: Every) -> list[SiteBench]:
    """List the benches that share the database, this one first, then by name."""
    return page.of(await host.site.benches(), lambda one: one.name)
