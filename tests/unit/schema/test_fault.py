"""Fault bits: registers to bits and back, and the overview that summarises them."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hornbill.schema.catalog import Catalog
from hornbill.schema.fault import FaultBit, bits_of, overview_of, word_of
from hornbill.schema.firmware import from_text

CATALOG = Catalog.load()


@given(st.integers(0, 2**32 - 1))
def test_a_register_is_split_into_bits(word: int) -> None:
    assert word_of(bits_of(word)) == word


def test_a_sign_extended_register_keeps_its_32_bits() -> None:
    assert bits_of(-1) == frozenset(range(32))
    assert bits_of(-(2**31)) == {31}


@pytest.mark.parametrize("bit", [-1, 32])
def test_there_are_32_bits(bit: int) -> None:
    with pytest.raises(ValueError, match="outside 0 to 31"):
        word_of([bit])


@pytest.mark.parametrize(
    ("words", "overview"),
    [
        ({}, 0),
        ({"fault_notification": 1 << 8}, 1 << 8),
        ({"fault_notification": 1 << 20}, 1 << 16),
        ({"fault_warning": 1 << 4}, 1 << 1),
        ({"fault_failure": 1 << 0 | 1 << 9}, 1 << 2 | 1 << 10),
        ({"fault_warning": 1 << 8, "fault_failure": 1 << 5}, 1 << 9 | 1 << 2),
    ],
)
def test_the_overview_shows_level_and_group_of_every_fault(words: dict[str, int], overview: int) -> None:
    assert overview_of(words) == overview


def test_every_detail_bit_raises_a_documented_overview_bit_of_its_own_group_and_level() -> None:
    summed = {bit.mask: (bit.group, bit.level) for bit in CATALOG.overview}
    for bit in CATALOG.faults:
        assert summed[overview_of({bit.parameter: bit.mask})] == (bit.group, bit.level)


def test_a_model_without_pwm_input_cannot_raise_pwm_bits() -> None:
    without = {bit.key for bit in set(CATALOG.faults_of(True)) - set(CATALOG.faults_of(False))}
    assert without == {"pwm_missing", "pwm_low", "pwm_high"}


@pytest.mark.parametrize("bit", CATALOG.faults, ids=lambda bit: bit.key)
def test_advice_names_only_registers_of_every_servo_that_may_raise_the_bit(bit: FaultBit) -> None:
    named = set(re.findall(r"0x[0-9A-F]{2}", bit.advice))
    for model in CATALOG.models.values():
        for firmware in model.firmware if model.pwm or not bit.pwm_only else ():
            assert named <= {row.name for row in model.rows(from_text(firmware)).values()}, (model.name, firmware)
