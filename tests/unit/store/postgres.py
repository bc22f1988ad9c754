"""A temporary PostgreSQL server, which can be stopped and suspended."""

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import threading
from pathlib import Path
from types import TracebackType
from typing import Self


class Missing(Exception):
    """No PostgreSQL on this machine can be started."""


class Cluster:
    """Created and started on entering, stopped and removed on leaving. Listens on a socket in its folder only."""

    def __init__(self) -> None:
        """Raises Missing."""
        self._programs = _programs()
        self._user = _user()

    def __enter__(self) -> Self:
        self._folder = Path(tempfile.mkdtemp(prefix="hornbill-pg-"))  # short: a socket's path has 107 characters
        if self._user is not None:
            shutil.chown(self._folder, self._user, pwd.getpwnam(self._user).pw_gid)
        words = ("-U", "hornbill", "-A", "trust", "-E", "UTF8", "--locale=C", "--no-sync")
        try:
            self._run("initdb", "-D", self._folder / "data", *words)
            self.start()
        except BaseException:
            self._remove()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.stop()
        finally:
            self._remove()

    def start(self) -> None:
        """Start the server."""
        words = f"-k '{self._folder}' -c listen_addresses='' -c fsync=off -c full_page_writes=off"
        self._control("-t", "30", "-l", self._folder / "log", "-o", words, "start")

    def stop(self) -> None:
        """Stop the server at once; committed transactions stay."""
        self._control("-m", "immediate", "stop")

    def suspend(self, at_most_s: float = 60.0) -> None:
        """Let all processes of the server hang until `resume`, at most for this time."""
        self._signal(signal.SIGSTOP)
        self._timer = threading.Timer(at_most_s, self._signal, [signal.SIGCONT])
        self._timer.daemon = True
        self._timer.start()

    def resume(self) -> None:
        """End `suspend`."""
        self._timer.cancel()
        self._signal(signal.SIGCONT)

    def _signal(self, number: signal.Signals) -> None:
        first = int((self._folder / "data/postmaster.pid").read_text().split()[0])
        os.kill(first, number)  # first: it would start others
        for one in Path(f"/proc/{first}/task/{first}/children").read_text().split():
            os.kill(int(one), number)

    def _control(self, *words: str | Path) -> None:
        self._run("pg_ctl", "-D", self._folder / "data", "-w", *words)

    @property
    def url(self) -> str:
        """The URL of its database."""
        return f"postgresql://hornbill@/postgres?host={self._folder}"

    def _remove(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)

    def _run(self, program: str, *words: str | Path) -> None:
        # It rejects running as root. Its output is not piped, because the server inherits it.
        log = self._folder / "output"
        with log.open("a") as out:
            done = subprocess.run(
                [self._programs / program, *words], cwd=self._folder, stdin=subprocess.DEVNULL, stdout=out, stderr=out,
                env={"PATH": os.defpath, "LC_ALL": "C"}, timeout=60, check=False, user=self._user,
                group=None if self._user is None else pwd.getpwnam(self._user).pw_gid,
                extra_groups=None if self._user is None else [],
            )  # fmt: skip
        if done.returncode != 0:
            raise Missing(f"{program} failed: {log.read_text()[-500:]}")


def _programs() -> Path:
    """The folder with initdb, pg_ctl and postgres; Debian keeps them off PATH."""
    newest = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda path: path.parent.name.zfill(4))
    on_path = shutil.which("initdb")
    for folder in ([Path(on_path).resolve().parent] if on_path else []) + newest[::-1]:
        if all((folder / program).exists() for program in ("initdb", "pg_ctl", "postgres")):
            return folder
    raise Missing("there is no initdb on PATH or in /usr/lib/postgresql")


def _user() -> str | None:
    """The user it runs as if this process runs as root, else None."""
    if os.geteuid() != 0:
        return None
    for name in ("postgres", "nobody"):
        try:
            return pwd.getpwnam(name).pw_name
        except KeyError:
            continue
    raise Missing("PostgreSQL does not run as root, and there is neither a user postgres nor nobody")
