"""Routes of tuning: set-up of a servo, and what the server can compute."""

from pydantic import Field

from hornbill.api.dependencies import LeaseHeader, TheHost, UidPath, known_uid, load_lab
from hornbill.api.routing import Routes
from hornbill.api.security.roles import Role
from hornbill.domain.fields import Model
from hornbill.domain.set_up import SetUp
from hornbill.lab.conditions import set_up_of, stated
from hornbill.store.audit import NewAuditEntry

routes = Routes("lab", after=load_lab)


class VerdictThreshold(Model):
    """A figure that decides between two verdicts."""

    name: str = Field(description="Name, as in the documentation.")
    value: float = Field(description="Value, in `unit`.")
    unit: str = Field(description="Unit.")
    decides: str = Field(description="What it decides.")


class Tuning(Model):
    """What this server can compute, and the thresholds of its verdicts."""

    package: str = Field(description="Python package that identification and Improve require.")
    available: bool = Field(description="The package is installed.")
    install: str | None = Field(description="Command that installs it. Null if installed.")
    thresholds: list[VerdictThreshold] = Field(description="Thresholds of verdicts.")


@routes.get("/tuning", Role.VIEW)
async def get_tuning() -> Tuning:
    """Get what this server can compute, and the thresholds of its verdicts."""
    from hornbill.lab.improve import INSTALL, PACKAGE, package_installed
    from hornbill.lab.verdict import THRESHOLDS

    available = package_installed()
    thresholds = [
        VerdictThreshold(name=name, value=one.value, unit=one.unit, decides=one.decides)
        for name, one in THRESHOLDS.items()
    ]
    return Tuning(package=PACKAGE, available=available, install=None if available else INSTALL, thresholds=thresholds)


@routes.get("/servos/{uid}/set-up", Role.VIEW, "unknown_servo", "invalid_value")
async def get_set_up(host: TheHost, uid: UidPath) -> SetUp:
    """Get the set-up of a servo, on the bus or not. All values are null until one was stored."""
    return set_up_of(host.store.servos.get(known_uid(host, uid)))


@routes.put("/servos/{uid}/set-up", Role.OPERATE, "unknown_servo", "invalid_value")
async def put_set_up(host: TheHost, uid: UidPath, body: SetUp, lease: LeaseHeader = None) -> SetUp:
    """Replace the set-up of a servo, on the bus or not. New runs copy it; stored runs keep theirs."""
    found = known_uid(host, uid)
    before, after = stated(set_up_of(host.store.servos.get(found))), stated(body)
    await host.store.run(host.store.servos.put_set_up, found, after)
    by, outcome = host.leases.who(lease, host.base.now()), "unchanged" if before == after else "applied"
    host.audit.note(NewAuditEntry(by, "set_up", outcome, found, before=before, requested=after, after=after))
    return body
