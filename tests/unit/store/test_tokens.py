"""Tokens are stored by digest only; their names are harmless; revoking takes effect immediately."""

import re
from pathlib import Path

import pytest

from hornbill.errors import Conflict, InvalidValue, Unknown
from hornbill.store.store import Store
from hornbill.store.tokens import digest


def test_only_the_digest_of_a_token_is_stored(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        made, secret = store.tokens.add("rig 3", "operate")
        assert re.fullmatch(r"hb_[A-Za-z0-9_-]{43}", secret)
        assert store.tokens.all() == [made]
        assert made.digest == digest(secret)
    for file in tmp_path.iterdir():
        assert secret.encode() not in file.read_bytes(), file


def test_tokens_differ_and_are_ordered_by_name(store: Store) -> None:
    assert len({store.tokens.add(f"t{n}", "view")[1] for n in range(20)}) == 20
    assert [one.name for one in store.tokens.all()] == sorted(f"t{n}" for n in range(20))


def test_the_name_of_a_revoked_token_can_be_used_again(store: Store) -> None:
    _, first = store.tokens.add("rig", "view")
    with pytest.raises(Conflict):
        store.tokens.add("rig", "admin")
    store.tokens.drop("rig")
    assert store.tokens.all() == []
    with pytest.raises(Unknown):
        store.tokens.drop("rig")
    _, second = store.tokens.add("rig", "view")
    assert first != second


def test_the_time_of_use_is_stored_and_revoked_tokens_are_ignored(store: Store) -> None:
    store.tokens.add("a", "view")
    store.tokens.used({"a": 12.5, "gone": 13.0})
    assert [(one.name, one.last_used_at) for one in store.tokens.all()] == [("a", 12.5)]


@pytest.mark.parametrize("name", ["", " a", "a ", "a/b", "a\nb", "x" * 33, "<b>", "a·b", "é"])
def test_a_name_that_could_do_harm_is_rejected(store: Store, name: str) -> None:
    with pytest.raises(InvalidValue):
        store.tokens.add(name, "view")
    assert store.tokens.all() == []
