"""Damage to frames between two controllers and on adapters."""

from collections.abc import Callable
from random import Random

from hornbill.wire.frame import Frame

Damage = Callable[[list[Frame], int, Random], None]
"""Changes a row of frames at one place, in place."""


def lose(row: list[Frame], place: int, _chance: Random) -> None:
    """A frame never arrives."""
    del row[place]


def repeat(row: list[Frame], place: int, _chance: Random) -> None:
    """A frame arrives twice."""
    row.insert(place, row[place])


def repeat_later(row: list[Frame], place: int, chance: Random) -> None:
    """A frame arrives again after others."""
    late = chance.randrange(place, len(row))
    row.insert(late + 1, row[place]._replace(at=row[late].at))


def swap(row: list[Frame], place: int, chance: Random) -> None:
    """Two frames are swapped, as by two queues of an adapter."""
    other = chance.randrange(len(row))
    one, two = row[place], row[other]
    row[place], row[other] = two._replace(at=one.at), one._replace(at=two.at)


def cut(row: list[Frame], place: int, chance: Random) -> None:
    """The length code is too small, down to nothing."""
    data = row[place].data
    row[place] = row[place]._replace(data=data[: chance.randrange(len(data))])


def lengthen(row: list[Frame], place: int, chance: Random) -> None:
    """The length code is too large, for a frame that is not full."""
    row[place] = row[place]._replace(data=(row[place].data + chance.randbytes(1 + chance.randrange(3)))[:8])


def flip_bit(row: list[Frame], place: int, chance: Random) -> None:
    """One bit of the data is another."""
    data = bytearray(row[place].data)
    data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    row[place] = row[place]._replace(data=bytes(data))


def flip_tail(row: list[Frame], place: int, chance: Random) -> None:
    """One bit of the tail is another: toggle, start, end, or the transfer id."""
    data = row[place].data
    row[place] = row[place]._replace(data=data[:-1] + bytes((data[-1] ^ 1 << chance.randrange(8),)))


def readdress(row: list[Frame], place: int, chance: Random) -> None:
    """One bit of the identifier is another, or one too many."""
    row[place] = row[place]._replace(id=row[place].id ^ 1 << chance.randrange(30))


def invent(row: list[Frame], place: int, chance: Random) -> None:
    """A frame no node sent, with an identifier in use."""
    row.insert(place, row[place]._replace(data=chance.randbytes(chance.randrange(9))))


def pause(row: list[Frame], place: int, chance: Random) -> None:
    """Everything from here on comes later."""
    by = chance.choice((0.5, 1.9, 2.0, 2.1, 5.0))
    row[place:] = [frame._replace(at=frame.at + by) for frame in row[place:]]


def drone_on(row: list[Frame], place: int, _chance: Random) -> None:
    """A sender that never ends: continuations with the correct toggle."""
    frame = row[place]
    tail = frame.data[-1] & 0x1F
    row[place + 1 : place + 1] = [
        frame._replace(data=bytes(7) + bytes((tail | (number % 2) << 5,))) for number in range(1, 90)
    ]


ALL: tuple[Damage, ...] = (
    lose, repeat, repeat_later, swap, cut, lengthen, flip_bit, flip_tail, readdress, invent, pause, drone_on,
)  # fmt: skip


def damage(row: list[Frame], chance: Random, times: int) -> None:
    """Damage a row of frames `times` times at random."""
    for _ in range(times):
        places = [place for place, frame in enumerate(row) if frame.data]
        if places:
            chance.choice(ALL)(row, chance.choice(places), chance)
