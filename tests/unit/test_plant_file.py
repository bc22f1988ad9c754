"""Files for `hornbill sim --plant`."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from hornbill.app.simulate import read_plant
from hornbill.cli import app
from hornbill.domain.plant import PlantConstants
from hornbill.errors import InvalidValue


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.toml", "inertia = 3\nload_by_angle = [[-90, 5], [90, -5]]\n"),
        ("a.toml", "[plant]\ninertia = 3.0\nload_by_angle = [[-90.0, 5.0], [90.0, -5.0]]\n"),
        ("a.json", '{"inertia": 3, "load_by_angle": [[-90, 5], [90, -5]]}'),
        ("a.json", json.dumps({"uid": "00", "plant": {"inertia": 3, "load_by_angle": [[-90, 5], [90, -5]]}})),
    ],
)
def test_a_file_has_the_constants_or_a_table_of_them(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    assert read_plant(tmp_path / name) == PlantConstants(inertia=3.0, load_by_angle=((-90.0, 5.0), (90.0, -5.0)))


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.toml", "inertia = ", "cannot be read as TOML"),
        ("a.json", "{", "cannot be read as JSON"),
        ("a.toml", "inertja = 1", "Did you mean inertia?"),
        ("a.json", '{"inertia": -1}', "Enter at least 0."),
        ("a.json", "[1]", "has no plant constants"),
        ("gone.toml", None, "cannot be read as TOML"),
    ],
)
def test_another_file_is_refused_with_its_reason(tmp_path: Path, name: str, text: str | None, reason: str) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(InvalidValue, match=reason.replace("?", r"\?")):
        read_plant(tmp_path / name)


def test_the_command_refuses_the_file_before_it_opens_a_bus(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("inertia = 1e9")
    done = CliRunner().invoke(app, ["sim", "--bus", "virtual:x", "--plant", str(tmp_path / "a.toml")])
    assert done.exit_code == 1
    assert "inertia 1000000000.0 is above its limit" in done.stderr
    assert CliRunner().invoke(app, ["sim"]).exit_code == 2
