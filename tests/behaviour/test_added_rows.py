"""A row, a series and a model added to the tables appear in REST, the schema, the manual and the simulated servo."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from behaviour import rig as rigs
from behaviour.rig import Rig, json, play
from hornbill import resources
from hornbill.api.http import create_api
from hornbill.schema.catalog import Catalog
from hornbill.sim.bench.recipe import Recipe
from tools.generate.manual import parameters_markdown

ROW = """
[[parameter]]
key = "new_row"
address = 0x47
group = "option"
label = "New row"
description = "A row that was added."
section = "4.38"
access = "rw"
unit = "V"
per_unit = 10
default = 10
minimum = 0
maximum = 100
"""


@pytest.fixture
def catalog(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Catalog:
    """The tables with another row, another series, and a model of it."""
    folder = tmp_path / "schemas"
    shutil.copytree(resources.schemas(), folder)
    rows = folder / "parameters.toml"
    rows.write_text(rows.read_text(encoding="utf-8") + ROW, encoding="utf-8")
    for kind, old, changes in (
        ("series", "bla15", {'"BLA15"': '"BLA99"', "BLA15 series": "BLA99 series", "number = 62": "number = 99"}),
        ("models", "bla15-06u-a0", {"BLA15": "BLA99"}),
    ):
        text = (folder / kind / f"{old}.toml").read_text(encoding="utf-8")
        for before, after in changes.items():
            text = text.replace(before, after)
        (folder / kind / f"{old.replace('15', '99')}.toml").write_text(text, encoding="utf-8")
    made = Catalog.load(folder)
    monkeypatch.setattr(rigs, "CATALOG", made)
    return made


def test_an_added_row_series_and_model_appear_everywhere(catalog: Catalog) -> None:
    document: dict[str, Any] = create_api(catalog).openapi()
    assert {"get", "put"} <= document["paths"]["/api/v1/servos/{uid}/parameters/new_row"].keys()
    manual = parameters_markdown(catalog)
    assert "BLA99-06U-A0" in manual
    assert "A row that was added." in manual

    async def scene(rig: Rig) -> None:
        schema = json(await rig.call("GET", "/schema"))
        assert "new_row" in {one["key"] for one in schema["parameters"]}
        assert "BLA99-06U-A0" in {one["name"] for one in schema["models"]}
        servo = (await rig.ready())[0]
        assert (servo.model and servo.model.series) == "BLA99"
        path = f"/servos/{servo.uid}/parameters/new_row"
        assert json(await rig.call("GET", path))["value"] == 1.0
        json(await rig.call("PUT", path, {"value": 2.5}))
        assert json(await rig.call("GET", path))["value"] == 2.5
        assert (await rig.call("PUT", path, {"value": 10.1})).status_code == 422

    play(scene, Recipe("BLA99-06U-A0", "1.300"))
