"""What goes wrong on an embedded bus on request, with the same draws for the same seed."""

from random import Random
from typing import Generic, NamedTuple, TypeVar

_Receiver = TypeVar("_Receiver")


class Chance(NamedTuple):
    """A share of frames that fail."""

    share: float
    random: Random

    def strikes(self) -> bool:
        """Draw for one frame."""
        return self.random.random() < self.share


class WireFaults(Generic[_Receiver]):
    """The faults of one bus. Percentages are 0..100 and 0 takes a fault away; others raise ValueError."""

    def __init__(self) -> None:
        self._loss: Chance | None = None
        self._corruption: Chance | None = None
        self.deaf: dict[_Receiver, Chance] = {}
        """What single receivers miss."""
        self.noise = False
        """Whether there is nothing but noise on the wire."""

    def lose(self, pct: float, seed: int, receiver: _Receiver | None) -> None:
        """Lose frames on the way to every receiver, or to `receiver` alone."""
        chance = _chance(pct, seed)
        if receiver is None:
            self._loss = chance
        elif chance is None:
            self.forget(receiver)
        else:
            self.deaf[receiver] = chance

    def corrupt(self, pct: float, seed: int) -> None:
        """Corrupt transmissions."""
        self._corruption = _chance(pct, seed)

    def forget(self, receiver: _Receiver) -> None:
        """Drop the faults of one receiver."""
        self.deaf.pop(receiver, None)

    def lost(self) -> bool:
        """Whether the next frame is lost on the way to everybody."""
        return self._loss is not None and self._loss.strikes()

    def corrupted(self) -> bool:
        """Whether the next transmission is corrupted."""
        return self._corruption is not None and self._corruption.strikes()


def _chance(pct: float, seed: int) -> Chance | None:
    if not 0 <= pct <= 100:
        raise ValueError(f"{pct} % is outside 0..100 %: give the share of frames that fail")
    return Chance(pct / 100, Random(seed)) if pct else None
