"""Clients generated from the document have the type of each row, alone and in the whole set."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
TOOLS = ROOT / "web" / "node_modules" / ".bin"
DOCUMENT = ROOT / "schemas" / "generated" / "openapi.json"

TYPESCRIPT = """
import type { components, paths } from "./api";

type Same<A, B> = (<T>() => T extends A ? 1 : 2) extends (<T>() => T extends B ? 1 : 2) ? true : false;
type Whole = paths["/api/v1/servos/{uid}/parameters"]["get"]["responses"][200]["content"]["application/json"];
type Gain = paths["/api/v1/servos/{uid}/parameters/angle_p_gain"]["get"]["responses"][200]["content"];
type One = Gain["application/json"];
type Row<K extends keyof Whole["parameters"]> = NonNullable<Whole["parameters"][K]>;
type Channels = components["schemas"]["TelemetryMessage"]["channels"];

export const proved: true[] = [
  true satisfies Same<Row<"angle_p_gain">["value"], number | null>,
  true satisfies Same<Row<"angle_p_gain">["rom"], number | null>,
  true satisfies Same<Row<"smoothing">["value"], boolean | number | null>,
  true satisfies Same<Row<"torque_mode">["rom"], "on" | "off" | "brake" | number | null>,
  true satisfies Same<One, Row<"angle_p_gain">>,
  true satisfies Same<components["schemas"]["Change"]["key"], keyof Whole["parameters"]>,
  true satisfies Same<keyof Channels, keyof Whole["parameters"]>,
];
"""

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


def test_a_typescript_client_has_the_type_of_each_row(tmp_path: Path) -> None:
    (tmp_path / "document.json").write_text(json.dumps(reduced()), encoding="utf-8")
    run(generated("openapi-typescript"), "document.json", "-o", "api.d.ts", cwd=tmp_path)
    (tmp_path / "snippet.ts").write_text(TYPESCRIPT, encoding="utf-8")
    run(generated("tsc"), "--noEmit", "--strict", "--target", "es2022", "--moduleResolution", "bundler", "--module",
        "esnext", "snippet.ts", cwd=tmp_path)  # fmt: skip


def test_a_python_client_has_the_type_of_each_row(tmp_path: Path) -> None:
    (tmp_path / "document.json").write_text(json.dumps(reduced()), encoding="utf-8")
    (tmp_path / "config.yaml").write_text("post_hooks: []\n", encoding="utf-8")
    run(generated("openapi-python-client"), "generate", "--path", "document.json", "--config", "config.yaml",
        "--meta", "none", "--output-path", "rig", cwd=tmp_path)  # fmt: skip
    (tmp_path / "snippet.py").write_text(PYTHON, encoding="utf-8")
    settings = {"include": ["snippet.py"], "typeCheckingMode": "strict", "reportMissingModuleSource": False}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    run(generated("pyright"), "--pythonpath", sys.executable, cwd=tmp_path)
