"""SimFaults: the words 0x18 to 0x1B from conditions, injected bits and bits of the last start (4.12)."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Final

from hornbill.schema.fault import FaultBit, FaultLevel, overview_of

_LEVELS: Final[tuple[FaultLevel, ...]] = ("notification", "warning", "failure")


class SimFaults:
    """The detail bits of a model. `bits` are those of its table, without the PWM bits if it has no PWM input.

    Conditions are set and cleared with `show`; injected bits remain until cleared, latching bits until the next start.
    Bits that report a restart (note 2) require one: `crashed` requests it.
    """

    def __init__(self, bits: Sequence[FaultBit]) -> None:
        self._bits: Mapping[str, FaultBit] = {bit.key: bit for bit in bits}
        self._conditions: frozenset[str] = frozenset()
        self._injected: set[str] = set()
        self._latched: set[str] = set()
        self._conditions_stop_output = False
        self.crashed: set[str] = set()
        """Bits for which the servo must restart, and which are set afterwards."""
        self.failures_latch = False
        """Whether failure bits remain until the next start, by a switch of `Behaviour`."""
        self.words: tuple[int, int, int] = (0, 0, 0)
        """Notification, warning and failure word: 0x19, 0x1A, 0x1B."""
        self.output_off = False
        """Whether the motor has no output because of a condition or an injected bit."""

    @property
    def keys(self) -> Collection[str]:
        """Keys of all bits of this model."""
        return self._bits.keys()

    @property
    def active(self) -> frozenset[str]:
        """Keys of all bits that are set."""
        return self._conditions | self._injected | self._latched

    @property
    def overview(self) -> int:
        """0x18."""
        return overview_of({f"fault_{level}": word for level, word in zip(_LEVELS, self.words, strict=True)})

    def show(self, conditions: Iterable[str], *, output_off: bool = False) -> None:
        """Set the bits of the present conditions, which may turn output off. Bits this model lacks are ignored."""
        present = frozenset(conditions)
        if (present, output_off) != (self._conditions, self._conditions_stop_output):
            self._conditions, self._conditions_stop_output = present, output_off
            self._latched |= {key for key in present if (bit := self._bits.get(key)) and self._latches(bit)}
            self._compose()

    def inject(self, key: str, on: bool) -> None:
        """Set or clear a bit manually. A latching bit remains until the next start, and one that reports a restart
        causes it.

        Raises ValueError for a key the model lacks.
        """
        bit = self._bits.get(key)
        if bit is None:
            raise ValueError(f'"{key}" is not a fault bit of this model. Use one of {", ".join(self._bits)}.')
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
        """Handle a start: bits of earlier events are cleared, except those `found` by this start."""
        self._injected -= {key for key in self._injected if self._bits[key].past_event}
        self.crashed.clear()
        self._latched = set(found)
        self._conditions, self._conditions_stop_output = frozenset(), False
        self._compose()

    def _latches(self, bit: FaultBit) -> bool:
        return bit.latching or (self.failures_latch and bit.level == "failure")

    def _compose(self) -> None:
        words = dict.fromkeys(_LEVELS, 0)
        self.output_off, own = self._conditions_stop_output, self._injected | self._latched
        for key in self.active:
            bit = self._bits.get(key)
            if bit is not None:
                words[bit.level] |= bit.mask
                self.output_off |= bit.output_off and key in own
        self.words = (words["notification"], words["warning"], words["failure"])
