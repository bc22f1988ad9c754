"""What the server needs to start, checked part by part without serving: `hornbill check`."""

from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass
from typing import Final

from hornbill.app import network_policy, serving
from hornbill.app.bus_ports import BusPorts, with_frame_gap
from hornbill.app.settings import Settings
from hornbill.errors import HornbillError
from hornbill.store.data_folder import LOGS_FOLDER, RECORDINGS_FOLDER, prepare
from hornbill.store.inspection import Inspection, inspect
from hornbill.store.migrate import NEWEST


@dataclass(frozen=True, slots=True)
class Checked:
    """Result of one check: what was found, or the error that start would end with."""

    part: str
    detail: str
    error: HornbillError | None = None


async def check(settings: Settings) -> AsyncIterator[Checked]:
    """Check every part. Nothing is sent, served or migrated; only the data folder is created."""
    checks = _Checks(settings)
    for part, one in checks.parts.items():
        try:
            yield Checked(part, await one())
        except HornbillError as error:
            yield Checked(part, error.detail, error)


class _Checks:
    """The checks in the order of start. Each returns what it found, or raises the error of start."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._found: Inspection | None = None
        self.parts: Final[dict[str, Callable[[], Awaitable[str]]]] = {
            "data_folder": self._data_folder,
            "database": self._database,
            "access": self._access,
            "certificate": self._certificate,
            "port": self._port,
            "bus": self._bus,
        }

    async def _data_folder(self) -> str:
        prepare(self._settings.data_dir)
        return str(self._settings.data_dir)

    async def _database(self) -> str:
        self._found = found = inspect(self._settings.database or self._settings.data_dir)
        if found.revision is None:
            return f"{found.address}: new, created at start"
        if not found.outdated:
            return f"{found.address}: tables {found.revision}"
        copy = "after a copy of the file" if found.is_file else "without a copy: make one with pg_dump first"
        return f"{found.address}: tables {found.revision}, migrated to {NEWEST} at start, {copy}"

    async def _access(self) -> str:
        has_tokens = self._found is not None and self._found.has_tokens
        exposed = network_policy.decide(self._settings, demo=False, has_tokens=has_tokens)
        required = exposed.required or has_tokens
        return f"{self._settings.host}: {'with a token' if required else 'this computer only, without a token'}"

    async def _certificate(self) -> str:
        tls = self._settings.tls
        if tls is None:
            return "none: http"
        serving.check_certificate(serving.configured(_nothing, tls))
        return f"{tls[0]}: https"

    async def _port(self) -> str:
        serving.listen(self._settings.host, self._settings.port).close()
        return f"{self._settings.port} of {self._settings.host}"

    async def _bus(self) -> str:
        address = self._settings.bus
        if address is None:
            return "none: connect one on the page"
        folder = self._settings.data_dir
        ports = BusPorts(None, folder / LOGS_FOLDER, folder / RECORDINGS_FOLDER)
        gap_ms = self._settings.frame_gap_ms
        port = await ports.open(with_frame_gap(address, gap_ms), self._settings.bitrate, listen_only=True)
        await port.close()
        return address


async def _nothing(*_arguments: object) -> None:
    """Application that is never called: a certificate is loaded without one."""
