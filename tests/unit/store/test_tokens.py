"""Tokens are kept by digest only; their names are harmless; revoking is at once."""

import re
from pathlib import Path

import pytest

from hornbill.errors import Conflict, InvalidValue, Unknown
from hornbill.store.store import Store
from hornbill.store.tokens import digest


def test_a_token_is_told_once_and_only_its_digest_is_kept(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        made, secret = store.tokens.add("rig 3", "operate")
        assert re.fullmatch(r"hb_[A-Za-z0-9_-]{43}", secret)
        assert store.tokens.all() == [made]
        assert made.digest == digest(secret)
    for file in tmp_path.iterdir():
        assert secret.encode() not in file.read_bytes(), file


def test_tokens_differ(place: str) -> None:
    with Store(place) as store:
        assert len({store.tokens.add(f"t{n}", "view")[1] for n in range(20)}) == 20
        assert [one.name for one in store.tokens.all()] == sorted(f"t{n}" for n in range(20))


def test_a_revoked_token_is_gone_and_its_name_is_free_again(place: str) -> None:
    with Store(place) as store:
        _, first = store.tokens.add("rig", "view")
        with pytest.raises(Conflict):
            store.tokens.add("rig", "admin")
        store.tokens.drop("rig")
        assert store.tokens.all() == []
        with pytest.raises(Unknown, match="Unknown token"):
            store.tokens.drop("rig")
        _, second = store.tokens.add("rig", "view")
        assert first != second


def test_when_a_token_was_used_is_kept_and_a_revoked_one_is_passed_over(place: str) -> None:
    with Store(place) as store:
        store.tokens.add("a", "view")
        store.tokens.used({"a": 12.5, "gone": 13.0})
        assert [(one.name, one.last_used_at) for one in store.tokens.all()] == [("a", 12.5)]


@pytest.mark.parametrize("name", ["", " a", "a ", "a/b", "a\nb", "x" * 33, "<b>", "a·b", "é"])
def test_a_name_that_could_do_harm_somewhere_is_refused(place: str, name: str) -> None:
    with Store(place) as store:
        with pytest.raises(InvalidValue):
            store.tokens.add(name, "view")
        assert store.tokens.all() == []
