"""Reads and writes of registers (chapters 3 and 4)."""

from collections.abc import Callable
from enum import Enum
from typing import Final

from hornbill.sim import address
from hornbill.sim.command import CommandInput
from hornbill.sim.faults import SimFaults
from hornbill.sim.memory import Memory
from hornbill.sim.protection import Protection
from hornbill.units import Instant, Raw


class Request(Enum):
    """Action of the servo requested by a register or service."""

    RESTART = "restart"
    SAVE = "save"
    SAVE_AND_RESTART = "save and restart"


class Registers:
    """Registers of one servo as accessed by GetSet. `pending` is a requested action of the servo."""

    def __init__(
        self,
        memory: Memory,
        commander: CommandInput,
        protection: Protection,
        faults: SimFaults,
        update_faults: Callable[[], None],
    ) -> None:
        """`update_faults` updates `faults`."""
        self.pending: Request | None = None
        self.boot_loader_writes: list[tuple[Instant, Raw]] = []
        """Time and value of every write to 0x49. Writes have no effect, and none should ever arrive (4.39)."""
        self._memory = memory
        self._commander = commander
        self._update_faults = update_faults
        self._live: Final = {
            address.CURRENT_ANGLE: commander.noisy_angle,
            address.CURRENT_SPEED: lambda: commander.speed,
            address.CURRENT_TORQUE: lambda: commander.torque,
            address.CURRENT_TEMPERATURE: lambda: protection.temperature,
            address.CURRENT_VOLTAGE: lambda: protection.voltage,
            address.FAULT_OVERVIEW: lambda: faults.overview,
            address.FAULT_NOTIFICATION: lambda: faults.words[0],
            address.FAULT_WARNING: lambda: faults.words[1],
            address.FAULT_FAILURE: lambda: faults.words[2],
        }

    def read(self, at: int) -> Raw | None:
        """Read a register. None if the read fails (table 2-16)."""
        live = self._live.get(at)
        if live is not None:
            if at >= address.FAULT_OVERVIEW:
                self._update_faults()
            return live()
        row = self._memory.rows.get(at)
        behaviour = self._commander.behaviour
        if row is None or row.action:
            return 0 if self._memory.absent(at, behaviour) == "zero" else None
        return self._memory.shown(at, behaviour)

    def write(self, at: int, raw: Raw, now: Instant) -> Raw | None:
        """Write a register and return its value. None if the write fails."""
        memory, commander = self._memory, self._commander
        if at == address.BOOT_LOADER:
            self.boot_loader_writes.append((now, raw))
            return memory.own(at)
        admitted = memory.admit(at, raw, commander.behaviour)
        if admitted is None:
            zero = at not in memory.rows and memory.absent(at, commander.behaviour) == "zero"
            return 0 if zero else None
        if at in address.COMMANDS:
            commander.command(at, admitted, now)
        elif memory.rows[at].action:
            if admitted == 1:
                self._act(at)
            return admitted
        else:
            memory.put(at, admitted)
            if at == address.TORQUE_MODE:
                commander.torque_mode(now)
            else:
                commander.configured()
        return memory.shown(at, commander.behaviour)

    def erase(self) -> None:
        """Opcode ERASE: reset the configuration to factory settings at once (table 2-12)."""
        behaviour = self._commander.behaviour
        self._memory.reset(behaviour, rom=behaviour.erase_rom)
        self._commander.configured()

    def _act(self, at: int) -> None:
        if at == address.INITIALIZE:
            self._memory.reset(self._commander.behaviour)
            self._commander.factory_reset()
        else:
            self.pending = Request.RESTART if at == address.REBOOT else Request.SAVE_AND_RESTART
