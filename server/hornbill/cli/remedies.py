"""Remedies in terms of the command line, by reason of an error. The layers below know no commands."""

from collections.abc import Mapping
from typing import Final

from hornbill.errors import HornbillError

AT_START: Final[Mapping[str, str]] = {
    "damaged": "hornbill restore FILE",
    "newer": "hornbill restore FILE, with a backup made before the upgrade",
    "driver": "pip install 'hornbill[postgres]'",
    "data_folder": "--data-dir FOLDER",
    "address": "--database URL",
}
"""By `reason` of a database or data folder that cannot be used."""


def detail(error: HornbillError) -> str:
    """Text of an error, followed by the command that resolves it."""
    command = AT_START.get(error.facts.get("reason", ""))
    return error.detail if command is None else f"{error.detail} Use: {command}."
