"""The folder of bundles: only what a bundle is gets in, and what is read of one is bounded."""

import asyncio
import os
import zipfile
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from hornbill.bus import bundles
from hornbill.bus.bundles import BundleFolder
from hornbill.errors import InvalidValue, LogFailed, OutOfRange, Unknown

LINE = b"(1.000000) can0 1003F30B#0102 R\n"


def make(path: Path, members: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return path


def test_frames_are_read_from_within(tmp_path: Path) -> None:
    path = make(tmp_path / "a.zip", {"about.json": b"{}", "frames.log": LINE * 3})
    recording = bundles.recording(path)
    assert [one.frame.data for one in recording] == [b"\x01\x02"] * 3
    recording.close()
    assert bundles.member(path, "about.json") == b"{}"
    assert bundles.member(path, "writes.csv") == b""


@pytest.mark.parametrize(
    ("members", "why"),
    [
        ({}, "no about.json"),
        ({"about.json": b""}, "or no frames.log"),
        ({"about.json": b"", "frames.log": b"", "../../evil": b""}, "other files"),
        ({"about.json": b"", "frames.log": b"", "/etc/passwd": b""}, "other files"),
        ({"about.json": b" " * (17 << 20), "frames.log": b""}, "unpacks to more than 16 MiB"),
        ({"about.json": b"", "frames.log": b"0" * (1 << 20)}, "not made of lines"),
        ({"about.json": b"", "frames.log": LINE * 50_000 + b"0" * 5000}, "not made of lines"),
    ],
)
def test_what_is_no_bundle_is_refused_with_the_reason(tmp_path: Path, members: dict[str, bytes], why: str) -> None:
    path = make(tmp_path / "a.zip", members)
    with pytest.raises(LogFailed, match=why):
        bundles.check(path)


@pytest.mark.parametrize("at", [0.2, 0.5])
def test_a_damaged_one_is_refused(tmp_path: Path, at: float) -> None:
    path = make(tmp_path / "a.zip", {"about.json": bytes(range(256)) * 9, "frames.log": LINE * 50})
    whole = bytearray(path.read_bytes())
    whole[int(len(whole) * at)] ^= 0xFF
    path.write_bytes(whole)
    with pytest.raises(LogFailed, match=r"damaged|no bundle"):
        bundles.check(path)


def test_a_size_that_lies_is_found_out(tmp_path: Path) -> None:
    """The directory says that little is packed; as much more is there, and is never unpacked."""
    path = make(tmp_path / "a.zip", {"about.json": b"{}", "frames.log": LINE * 1000})
    whole = path.read_bytes()
    size = (len(LINE) * 1000).to_bytes(4, "little")
    path.write_bytes(whole.replace(size, (10).to_bytes(4, "little")))
    with pytest.raises(LogFailed, match="damaged"):
        bundles.check(path)


@pytest.mark.parametrize(
    "name", ["", ".zip", "a", "a.ZIP", "../a.zip", "a/b.zip", "a\\b.zip", "-a.zip", "a\n.zip", "ä.zip"]
)
def test_a_name_is_plain(tmp_path: Path, name: str) -> None:
    folder = BundleFolder(tmp_path)
    with pytest.raises(Unknown):
        folder.path(name)

    async def bring() -> None:
        async def nothing() -> AsyncIterator[bytes]:
            yield b""

        await folder.adopt(name, nothing(), lambda _path: None)

    with pytest.raises(InvalidValue):
        asyncio.run(bring())
    assert list(tmp_path.iterdir()) == []


def test_more_than_may_be_brought_is_refused_and_nothing_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bundles, "UPLOAD_BYTES", 1000)

    async def bring() -> None:
        async def much() -> AsyncIterator[bytes]:
            while True:
                yield bytes(100)

        await BundleFolder(tmp_path).adopt("a.zip", much(), lambda _path: None)

    with pytest.raises(OutOfRange):
        asyncio.run(bring())
    assert list(tmp_path.iterdir()) == []


def test_a_bundle_has_its_name_only_when_it_is_complete_and_a_second_one_another(tmp_path: Path) -> None:
    async def scene() -> None:
        folder = BundleFolder(tmp_path)
        first, second = await folder.begin("a.zip"), await folder.begin("a.zip")
        assert (first.name, second.name) == ("a.zip", "a-2.zip")
        await first.put("about.json", b"{}")
        assert folder.all() == []
        await first.put("frames.log", LINE)
        await first.finish()
        await second.discard()
        assert [one.name for one in folder.all()] == ["a.zip"]
        bundles.check(tmp_path / "a.zip")

    asyncio.run(scene())
    assert [path.name for path in tmp_path.iterdir()] == ["a.zip"]


def test_a_member_takes_no_more_than_it_may(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(bundles.MEMBERS, "events.jsonl", 10)

    async def scene() -> None:
        file = await BundleFolder(tmp_path).begin("a.zip")
        assert await file.put("events.jsonl", b"12345678")
        assert not await file.put("events.jsonl", b"1234")
        assert file.cut == ["events.jsonl"]
        await file.put("about.json", b"{}")
        await file.put("frames.log", LINE)
        await file.finish()

    asyncio.run(scene())
    assert bundles.member(tmp_path / "a.zip", "events.jsonl") == b"12345678"


def test_the_oldest_go_by_number_and_by_size_and_the_newest_never(tmp_path: Path) -> None:
    for n in range(5):
        path = make(tmp_path / f"{n}.zip", {"about.json": b"{}", "frames.log": LINE})
        os.utime(path, (n, n))
    size = (tmp_path / "0.zip").stat().st_size
    assert sorted(BundleFolder(tmp_path, most=4).prune()) == ["0.zip"]
    assert sorted(BundleFolder(tmp_path, most_bytes=2 * size).prune()) == ["1.zip", "2.zip"]
    assert BundleFolder(tmp_path, most_bytes=1).prune() == ["3.zip"]
    assert [path.name for path in tmp_path.iterdir()] == ["4.zip"]


def test_what_a_killed_process_left_is_cleared(tmp_path: Path) -> None:
    (tmp_path / "a.zip.part").write_bytes(b"half")
    BundleFolder(tmp_path).tidy()
    assert list(tmp_path.iterdir()) == []
