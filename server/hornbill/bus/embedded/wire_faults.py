"""Injected faults of an embedded bus, reproducible by seed."""

from random import Random
from typing import Generic, NamedTuple, TypeVar

_Receiver = TypeVar("_Receiver")


class Chance(NamedTuple):
    """A share of frames that fail at random."""

    share: float
    random: Random

    def strikes(self) -> bool:
        """Whether the next frame fails."""
        return self.random.random() < self.share


class WireFaults(Generic[_Receiver]):
    """The faults of one bus. Percentages are 0..100; 0 clears a fault. Others raise ValueError."""

    def __init__(self) -> None:
        self._loss: Chance | None = None
        self._corruption: Chance | None = None
        self.lossy: dict[_Receiver, Chance] = {}
        """Loss of single receivers."""
        self.noise = False
        """Whether the bus carries only noise."""

    def lose(self, pct: float, seed: int, receiver: _Receiver | None) -> None:
        """Lose frames for every receiver, or only for `receiver`."""
        chance = _chance(pct, seed)
        if receiver is None:
            self._loss = chance
        elif chance is None:
            self.forget(receiver)
        else:
            self.lossy[receiver] = chance

    def corrupt(self, pct: float, seed: int) -> None:
        """Corrupt transmissions."""
        self._corruption = _chance(pct, seed)

    def forget(self, receiver: _Receiver) -> None:
        """Clear the faults of one receiver."""
        self.lossy.pop(receiver, None)

    def lost(self) -> bool:
        """Whether the next frame is lost for all receivers."""
        return self._loss is not None and self._loss.strikes()

    def corrupted(self) -> bool:
        """Whether the next transmission is corrupted."""
        return self._corruption is not None and self._corruption.strikes()


def _chance(pct: float, seed: int) -> Chance | None:
    if not 0 <= pct <= 100:
        raise ValueError(f"{pct} % is outside 0 to 100 %.")
    return Chance(pct / 100, Random(seed)) if pct else None
