"""The catalogue: lookup by key, address and model; immutable; one revision per content."""

import shutil
from pathlib import Path

import pytest
from pydantic import ValidationError

from hornbill import resources
from hornbill.errors import InvalidValue, Unknown
from hornbill.schema import firmware
from hornbill.schema.catalog import Catalog

CATALOG = Catalog.load()


def test_a_row_is_the_same_by_key_and_by_address() -> None:
    for key, row in CATALOG.by_key.items():
        assert CATALOG.by_address[row.address] is row
        assert row.key == key


@pytest.mark.parametrize("key", ["initialize", "reboot", "write_rom", "boot_loader", "0x49", "", "colour"])
def test_actions_and_the_boot_loader_have_no_keys(key: str) -> None:
    with pytest.raises(Unknown) as caught:
        CATALOG.parameter(key)
    assert caught.value.code == "unknown_parameter"


def test_a_misspelled_key_suggests_the_nearest() -> None:
    with pytest.raises(Unknown, match=r"Did you mean angle_limit_cw\?"):
        CATALOG.parameter("angle_limt_cw")
    assert CATALOG.parameter("angle_limit_cw").address == 0x38


def test_rows_cannot_be_changed() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        CATALOG.parameters["soft_start"].default = 0  # type: ignore[misc]
    with pytest.raises(TypeError):
        CATALOG.parameters["soft_start"] = CATALOG.parameters["reverse"]  # type: ignore[index]


def test_the_widest_range_covers_every_model_that_has_the_row() -> None:
    assert CATALOG.widest("command_speed") == (-300, 300)
    assert CATALOG.widest("overcurrent_limit") == (7, 120)
    assert CATALOG.widest("voltage_limit_upper") == (74, 500)
    assert CATALOG.widest("pwm_neutral") == (100, 10_000)
    assert CATALOG.widest("product_number") == (None, None)


def test_the_revision_follows_the_content(tmp_path: Path) -> None:
    copy = tmp_path / "schemas"
    shutil.copytree(resources.schemas(), copy)
    assert Catalog.load(copy).revision == CATALOG.revision
    effects = copy / "effects.toml"
    effects.write_text(effects.read_text(encoding="utf-8") + "\n# one more\n", encoding="utf-8")
    assert Catalog.load(copy).revision != CATALOG.revision


def test_the_name_of_a_model_contains_its_nominal_voltage() -> None:
    volts = {"06U": 7.4, "12U": 12.0, "28U": 28.0}
    assert all(model.nominal_v == volts[name.split("-")[1]] for name, model in CATALOG.models.items())


@pytest.mark.parametrize(
    ("identity", "treated_as"),
    [
        ((61, 12050), "BLA21-12U-AB"),
        ((86, 12050), "BLA34-12U-AB"),
        ((61, 12060), "BLA21-12U-AB"),
        ((61, 6990), "BLA21-06U-AB"),
        ((62, 12050), "BLA15-12U-A0"),
        ((86, 6050), "BLA34-28U-AB"),
        ((87, 12050), None),
        ((86, None), None),
    ],
)
def test_an_unknown_hardware_number_counts_as_the_newest_of_its_series_with_the_same_supply(
    identity: tuple[int, int | None], treated_as: str | None
) -> None:
    model = CATALOG.treated_as(*identity)
    assert (None if model is None else model.name) == treated_as


@pytest.mark.parametrize(
    ("model", "version", "treated_as"),
    [
        ("BLA21-06U-A0", 1300, None),
        ("BLA21-06U-A0", 1200, None),
        ("BLA21-06U-A0", 1400, None),
        ("BLA21-06U-A0", 1500, "1.400"),
        ("BLA21-06U-A0", 1350, "1.300"),
        ("BLA21-06U-A0", 1000, "1.010"),
        ("BLA34-12U-AB", 1500, None),
        ("BLA34-12U-AB", 2000, "1.500"),
    ],
)
def test_an_unknown_firmware_counts_as_the_newest_known_below_it(
    model: str, version: int, treated_as: str | None
) -> None:
    servo = CATALOG.models[model]
    assert servo.counts_as(version) == treated_as
    if treated_as is not None:
        assert servo.rows(version) == servo.rows(firmware.from_text(treated_as))


def test_only_known_firmware_has_a_note() -> None:
    model = CATALOG.models["BLA21-06U-A0"]
    assert "1.400 fixes a stall at low speed" in (CATALOG.note_on(model, 1300) or "")
    assert "with no other servo on the bus" in (CATALOG.note_on(model, 1300) or "")
    assert all(step.note for step in CATALOG.firmware)
    assert [CATALOG.note_on(model, version) for version in (1500, 1350, None)] == [None] * 3
    assert CATALOG.note_on(None, 1300) is None


@pytest.mark.parametrize(("raw", "text"), [(1010, "1.010"), (1300, "1.300"), (12_005, "12.005")])
def test_firmware_versions_as_text(raw: int, text: str) -> None:
    assert firmware.to_text(raw) == text
    assert firmware.from_text(text) == raw


@pytest.mark.parametrize("text", ["1.3", "1300", "v1.300", "1.300 ", "", "١.300"])
def test_other_forms_of_a_version_are_refused(text: str) -> None:
    with pytest.raises(InvalidValue):
        firmware.from_text(text)
