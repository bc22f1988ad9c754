"""A Python client generated from the document has the type of each row, alone and in the whole set.

For TypeScript, `web/src/api/schema-types.ts` says so to the compiler.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
TOOLS = ROOT / "web" / "node_modules" / ".bin"
DOCUMENT = ROOT / "schemas" / "generated" / "openapi.json"

PYTHON = """
from rig.models import ParameterKey, Parameters, SwitchReading, TorqueModeChoice, TorqueModeReading
from rig.types import Unset


def gain(whole: Parameters) -> int | None:
    row = whole.parameters.angle_p_gain
    return None if isinstance(row, Unset) else row.rom


def smoothing(row: SwitchReading) -> bool | int | None:
    return row.value


def mode(row: TorqueModeReading) -> TorqueModeChoice | int | None:
    return row.value


KEY = ParameterKey.ANGLE_P_GAIN
"""


def generated(tool: str) -> Path:
    """The path of a generator, next to this Python or in node_modules."""
    local = Path(sys.executable).parent / tool
    found = local if local.is_file() else TOOLS / tool
    if not found.is_file():
        pytest.skip(f"{tool} is not installed: 'make setup' installs it")
    return found


def run(*command: str | Path, cwd: Path) -> None:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


def reduced() -> dict[str, Any]:
    """The document with the routes of two rows and of the whole set only, to be quick."""
    whole = json.loads(DOCUMENT.read_text(encoding="utf-8"))
    start = "/api/v1/servos/{uid}/parameters"
    kept = {start, f"{start}/{{key}}", f"{start}/angle_p_gain", f"{start}/torque_mode"}
    return {**whole, "paths": {path: verbs for path, verbs in whole["paths"].items() if path in kept}}


def test_a_python_client_has_the_type_of_each_row(tmp_path: Path) -> None:
    (tmp_path / "document.json").write_text(json.dumps(reduced()), encoding="utf-8")
    (tmp_path / "config.yaml").write_text("post_hooks: []\n", encoding="utf-8")
    run(generated("openapi-python-client"), "generate", "--path", "document.json", "--config", "config.yaml",
        "--meta", "none", "--output-path", "rig", cwd=tmp_path)  # fmt: skip
    (tmp_path / "snippet.py").write_text(PYTHON, encoding="utf-8")
    settings = {"include": ["snippet.py"], "typeCheckingMode": "strict", "reportMissingModuleSource": False}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    run(generated("pyright"), "--pythonpath", sys.executable, cwd=tmp_path)
