"""`hornbill` in this process: a process of its own takes longer than most commands. `test_start.py` starts some."""

import json
from typing import Any

from typer.testing import CliRunner, Result

from hornbill.cli import app


def hornbill(url: str | None, *words: object) -> Result:
    """Run a command against the server at `url`, without a terminal."""
    done = CliRunner().invoke(app, [str(word) for word in words], env={"HORNBILL_URL": url})
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done


class CommandLine:
    """The command line with a running server."""

    def __init__(self, url: str) -> None:
        self.url = url

    def __call__(self, *words: object, code: int = 0) -> str:
        """The output of a command that exits with `code`."""
        done = hornbill(self.url, *words)
        assert done.exit_code == code, done.output
        return done.output

    def json(self, *words: object, code: int = 0) -> Any:
        """What a command prints with --json."""
        done = hornbill(self.url, *words, "--json")
        assert done.exit_code == code, done.output
        return json.loads(done.stdout)

    def value(self, serial: str, key: str = "angle_p_gain", where: str = "value") -> Any:
        """A value of a servo: `where` it is "value" (RAM) or "rom"."""
        return self.json("get", serial, key)[where]
