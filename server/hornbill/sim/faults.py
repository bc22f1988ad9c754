"""SimFaults: the words 0x18 to 0x1B, made from conditions, from injected bits and from what a start left (4.12)."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Final

from hornbill.schema.fault import FaultBit, FaultLevel, overview_of

_LEVELS: Final[tuple[FaultLevel, ...]] = ("notification", "warning", "failure")


class SimFaults:
    """The detail bits one model can raise. `bits` are those of its table, without the PWM bits if it has none.

    Conditions come and go with `show`; injected bits stay until they are taken back, and the latching ones
    until the next start. Bits that tell of a restart (note 2) come with one: `crashed` asks the servo for it.
    """

    def __init__(self, bits: Sequence[FaultBit]) -> None:
        self._bits: Mapping[str, FaultBit] = {bit.key: bit for bit in bits}
        self._conditions: frozenset[str] = frozenset()
        self._injected: set[str] = set()
        self._latched: set[str] = set()
        self._conditions_take_output = False
        self.crashed: set[str] = set()
        """Bits for which the servo has to restart by itself, and which tell of it then."""
        self.failures_latch = False
        """Whether bits of failure level stay until the next start, by a switch of `Behaviour`."""
        self.words: tuple[int, int, int] = (0, 0, 0)
        """Notification, warning and failure word: 0x19, 0x1A, 0x1B."""
        self.output_off = False
        """Whether the motor has no output, by what was shown or by a bit that was injected."""

    @property
    def keys(self) -> Collection[str]:
        """Every bit this model has, by key."""
        return self._bits.keys()

    @property
    def active(self) -> frozenset[str]:
        """The keys of all bits that are set."""
        return self._conditions | self._injected | self._latched

    @property
    def overview(self) -> int:
        """0x18."""
        return overview_of({f"fault_{level}": word for level, word in zip(_LEVELS, self.words, strict=True)})

    def show(self, conditions: Iterable[str], *, output_off: bool = False) -> None:
        """Set the bits of these present conditions, which may take the output; bits this model does not have are left
        out."""
        present = frozenset(conditions)
        if (present, output_off) != (self._conditions, self._conditions_take_output):
            self._conditions, self._conditions_take_output = present, output_off
            self._latched |= {key for key in present if (bit := self._bits.get(key)) and self._latches(bit)}
            self._compose()

    def inject(self, key: str, on: bool) -> None:
        """Set or clear a bit by hand; a latching one stays until the next start all the same, and one that tells
        of a restart brings that about.

        Raises ValueError for a key the model does not have.
        """
        bit = self._bits.get(key)
        if bit is None:
            raise ValueError(f'"{key}" is no fault bit of this model. Give one of {", ".join(self._bits)}.')
        if on:
            self._injected.add(key)
            if self._latches(bit):
                self._latched.add(key)
            if bit.past_event and bit.level == "failure":
                self.crashed.add(key)
        else:
            self._injected.discard(key)
        self._compose()

    def start(self, *found: str) -> None:
        """A new start: what told of the time before is gone, but for what this start `found`."""
        self._injected -= {key for key in self._injected if self._bits[key].past_event}
        self.crashed.clear()
        self._latched = set(found)
        self._conditions, self._conditions_take_output = frozenset(), False
        self._compose()

    def _latches(self, bit: FaultBit) -> bool:
        return bit.latching or (self.failures_latch and bit.level == "failure")

    def _compose(self) -> None:
        words = dict.fromkeys(_LEVELS, 0)
        self.output_off, by_themselves = self._conditions_take_output, self._injected | self._latched
        for key in self.active:
            bit = self._bits.get(key)
            if bit is not None:
                words[bit.level] |= bit.mask
                self.output_off |= bit.output_off and key in by_themselves
        self.words = (words["notification"], words["warning"], words["failure"])
