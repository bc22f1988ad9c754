"""The real clock of tests: no garbage collection while its loop runs."""

import gc

import pytest

import real_clock


@pytest.mark.real_time
async def test_no_garbage_is_collected_in_a_test_on_the_real_clock() -> None:
    assert not gc.isenabled()


def test_garbage_is_collected_again_after_a_failure() -> None:
    async def fail() -> None:
        raise RuntimeError

    with pytest.raises(RuntimeError):
        real_clock.run(fail())
    assert gc.isenabled()
