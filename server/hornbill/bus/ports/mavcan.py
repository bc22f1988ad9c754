"""MavcanLink: a CAN bus of an autopilot, forwarded over MAVLink 2 by a serial port or UDP.

The autopilot forwards its bus for five seconds after MAV_CMD_CAN_FORWARD, and sends what arrives as CAN_FRAME. Messages
are signed if HORNBILL_MAVLINK_KEY is set. python-can has no such interface; pydronecan and Mission Planner do.
"""

import errno
import os
import re
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from hornbill.bus.adapters.serial_ports import UNKNOWN_ADAPTER, UsbAdapter
from hornbill.bus.ports import mavlink_codec as codec
from hornbill.bus.ports.baud import Abandoned
from hornbill.bus.ports.link import Received, pause
from hornbill.bus.ports.mavlink_codec import Kind, Message, Reader, Writer
from hornbill.bus.ports.serial_line import SerialStream
from hornbill.errors import Cause, PortOpenFailed
from hornbill.units import Instant
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorStatus, AllocationMessage, ArrayCommand, NodeStatus
from hornbill.wire.port import SerialLineInfo
from hornbill.wire.services import EXECUTE_OPCODE, GET_NODE_INFO, GET_SET, RESTART_NODE

EXAMPLES: Final = "mavcan:/dev/ttyACM0@57600 or mavcan:udp:192.168.1.20:14550"
KEY: Final = "HORNBILL_MAVLINK_KEY"
"""Environment variable with the passphrase of the signing key."""
MOST_BUSES: Final = 8
RATES: Final = (115_200, 57_600, 921_600)
"""Baud rates in the order of trial."""

FILTER: Final = tuple(
    sorted(
        {0}  # messages of nodes without ID
        | {message.TYPE.id for message in (NodeStatus, AllocationMessage, ArrayCommand, ActuatorStatus)}
        | {service.id for service in (GET_NODE_INFO, RESTART_NODE, EXECUTE_OPCODE, GET_SET)}
    )
)
"""DroneCAN messages and services of servos, and commands to them. A serial line carries only these."""

_SYSTEM, _COMPONENT = 250, 192  # as pydronecan: no ground station, so its absence is no failsafe
_NO_AUTOPILOT, _GROUND_STATION = 8, 6
_FORWARD: Final = 32000
_ACCEPTED, _IN_PROGRESS = 0, 5
_EXTENDED: Final = 1 << 31
_NOT_DATA: Final = 0x6000_0000

_HEARTBEAT_S: Final = 3.3
"""An autopilot sends one a second, of which some may be lost."""
_RATE_S: Final = 1.3
_FORWARD_S: Final = 2.0
_REPEAT_S: Final = 0.3
_POLL_S: Final = 0.05
_RENEW_S: Final = 1.0
_SILENT_S: Final = 5.0
_NOT_RENEWED_S: Final = 10.0
_AHEAD_S: Final = 1.5e-3  # of the line may be taken by earlier frames, which a stop cannot overtake
_PAUSE_S: Final = 5e-4
_WRITE_S: Final = 0.25
_ROUND_TRIPS: Final = 8

_UDP = re.compile(r"udp:(?P<host>\[[0-9a-fA-F:.]+\]|[^\s:/\[\]@]+):(?P<port>\d{1,5})")
_NATIVE_USB = re.compile(r"/dev/(ttyACM\d|(cu|tty)\.usbmodem)")
"""Devices without a serial line in between: autopilots on USB, whose baud rate has no effect."""
_OPTIONS = re.compile(r"bus=(?P<bus>\d{1,3})")


@dataclass(frozen=True, slots=True)
class Channel:
    """A parsed channel: either `device` and `baud`, or `host` and `port`."""

    device: str
    baud: int | None
    host: str
    port: int
    bus: int
    """From 1."""


def parse_mavcan(channel: str) -> Channel:
    """Parse `DEVICE[@BAUD]` or `udp:HOST:PORT`, each with `?bus=N`. Raises PortOpenFailed for other forms."""
    place, _, options = channel.partition("?")
    if re.search(r"(^|&)key=", options):
        raise PortOpenFailed(
            f"An address is stored and shown, so it must not contain the signing key. Set {KEY} and remove key=….",
            address=f"mavcan:{place}",
            cause="mavcan_key_in_address",
        )
    found = _OPTIONS.fullmatch(options) if options else None
    bus = int(found["bus"]) if found is not None else 1
    if (options and found is None) or not 1 <= bus <= MOST_BUSES:
        raise _invalid(channel, f"Its option must be bus=N with N from 1 to {MOST_BUSES}.")
    if place.startswith("udp:"):
        target = _UDP.fullmatch(place)
        if target is None or not 0 < int(target["port"]) < 65536:
            raise _invalid(channel, "Enter host and UDP port.")
        return Channel("", None, target["host"].strip("[]"), int(target["port"]), bus)
    device, at, baud = place.rpartition("@")
    if not at:
        return Channel(place, None, "", 0, bus)
    if not device or not re.fullmatch(r"[1-9][0-9]{3,6}", baud):
        raise _invalid(channel, "The baud rate must be a number from 1000 to 9999999.")
    return Channel(device, int(baud), "", 0, bus)


def _invalid(channel: str, remedy: str) -> PortOpenFailed:
    return PortOpenFailed(
        f"{channel!r} is not DEVICE@BAUD or udp:HOST:PORT. {remedy} Examples: {EXAMPLES}.",
        address=f"mavcan:{channel}",
        cause="mavcan_address_invalid",
        buses=MOST_BUSES,
    )


class _Line(Protocol):
    """A connection to the autopilot."""

    def read(self, timeout_s: float) -> list[bytes]: ...
    def write(self, data: bytes) -> bool: ...
    def close(self) -> None: ...


class _SerialLine:
    """A serial port."""

    def __init__(self, stream: SerialStream) -> None:
        self.stream = stream

    def read(self, timeout_s: float) -> list[bytes]:
        """What arrived, waiting up to `timeout_s`. Raises OSError if the device was removed."""
        data = self.stream.read(timeout_s)
        return [data] if data else []

    def write(self, data: bytes) -> bool:
        """Write all of `data`. False if nothing was accepted."""
        return self.stream.write(data, _WRITE_S)

    def close(self) -> None:
        """Close the port."""
        self.stream.close()


class _UdpLine:
    """A UDP socket connected to the autopilot."""

    def __init__(self, channel: str, host: str, port: int) -> None:
        try:
            family, kind, protocol, _, target = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        except socket.gaierror as error:
            remedy = "Check the host name, or enter its IP address."
            raise PortOpenFailed(
                f"mavcan:{channel} cannot be opened. Host {host} not found. {remedy}",
                address=f"mavcan:{channel}", remedy=remedy, cause="host_not_found",
            ) from error  # fmt: skip
        self.opening = True
        """Ignore that nothing listens there: the autopilot may be starting."""
        self._socket = socket.socket(family, kind, protocol)
        try:
            self._socket.connect(target)
            self._socket.setblocking(False)
        except BaseException:
            self._socket.close()
            raise

    def read(self, timeout_s: float) -> list[bytes]:
        """The datagrams that arrived, waiting up to `timeout_s`. Raises OSError if nothing listens there."""
        select.select([self._socket], [], [], timeout_s)
        datagrams: list[bytes] = []
        while True:
            try:
                datagrams.append(self._socket.recv(65536))
            except BlockingIOError:
                return datagrams
            except (ConnectionRefusedError, ConnectionResetError):  # the latter on Windows
                if not self.opening:
                    raise

    def write(self, data: bytes) -> bool:
        """Send one datagram. False if the socket is full. Raises OSError if nothing listens there."""
        try:
            self._socket.send(data)
        except (BlockingIOError, InterruptedError):
            return False
        except (ConnectionRefusedError, ConnectionResetError):
            if not self.opening:
                raise
        except OSError as error:
            if error.errno != errno.ENOBUFS:
                raise
            return False
        return True

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class MavcanLink:
    """An AdapterLink to one CAN bus of an autopilot."""

    max_batch = 8

    def __init__(
        self,
        channel: str,
        wanted: Callable[[], bool] = lambda: True,
        *,
        usb: UsbAdapter = UNKNOWN_ADAPTER,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """Connect to `DEVICE[@BAUD]` or `udp:HOST:PORT`, with `?bus=N`, within about six seconds.

        `wanted` is polled for whether to continue; `usb`: properties of the device. Raises PortOpenFailed for an
        invalid channel, without a heartbeat, for a missing or wrong key or if the autopilot refuses; OSError if the
        device cannot be opened; Abandoned.
        """
        parsed = parse_mavcan(channel)
        passphrase = (os.environ if environment is None else environment).get(KEY) or None
        self._key = None if passphrase is None else codec.key_of(passphrase)
        self._address = f"mavcan:{channel}"
        self._bus = parsed.bus
        self._wanted = wanted
        self._reader = Reader(self._key)
        self._writer = Writer(_SYSTEM, _COMPONENT, self._key)
        self._writing = threading.Lock()
        self._seen_lost = self._seen_garbled = 0
        self._clear_at: Instant = 0.0
        self._byte_s = 0.0
        self._system = 0
        self._signed = False
        self._result: int | None = None
        self._requested_at: Instant | None = None
        self._round_trips: deque[float] = deque(maxlen=_ROUND_TRIPS)
        self.line_info: SerialLineInfo | None = None
        self._filter: tuple[int, ...] = ()
        self._line: _Line
        self._serial: SerialStream | None = None
        self._udp: _UdpLine | None = None
        if parsed.device:
            native_usb = usb.native_usb or _NATIVE_USB.match(os.path.realpath(parsed.device)) is not None
            rates = RATES if parsed.baud is None and not native_usb else (parsed.baud or RATES[0],)
            self._serial = SerialStream(parsed.device, rates[0])
            self._line = _SerialLine(self._serial)
        else:
            rates, native_usb = (), False
            self._line = self._udp = _UdpLine(channel, parsed.host, parsed.port)
        try:
            self._find(parsed, rates, native_usb)
            self._begin()
        except BaseException:
            self._line.close()
            raise
        if self._udp is not None:
            self._udp.opening = False

    @property
    def round_trip_s(self) -> float:
        """Longest of the last few round trips to the autopilot, s. 0 before the first."""
        return max(tuple(self._round_trips), default=0.0)

    def receive(self, timeout_s: float, not_before: Instant) -> Received:
        """Receive until `not_before`, and renew the forwarding. Raises OSError if the autopilot is lost."""
        pause(not_before)
        got = Received()
        datagrams = self._line.read(timeout_s)
        now = time.monotonic()
        for message in self._messages(datagrams):
            if message.system == self._system:
                self._heard_at = now
                self._take(message, got, now)
        if self._serial is not None:
            got.line_bytes = sum(map(len, datagrams))
        reader = self._reader
        got.lost, self._seen_lost = reader.lost - self._seen_lost, reader.lost
        garbled = reader.garbled + reader.unsigned + reader.wrongly_signed
        got.garbled, self._seen_garbled = garbled - self._seen_garbled, garbled
        if self._result not in (None, _ACCEPTED, _IN_PROGRESS):
            raise OSError(errno.EIO, f"the autopilot no longer forwards its bus (result {self._result})")
        if now - self._heard_at > _SILENT_S:
            raise OSError(errno.ETIMEDOUT, f"no MAVLink message for {_SILENT_S:g} s")
        if now - self._forwarded_at > _NOT_RENEWED_S:
            raise OSError(errno.ETIMEDOUT, f"the autopilot has not forwarded its bus for {_NOT_RENEWED_S:g} s")
        if now >= self._renew_at:
            self._renew_at = now + _RENEW_S
            self._renew(now)
        return got

    def transmit(self, frames: Sequence[Frame]) -> int:
        """Send as many of `frames` as the line carries soon. Returns their number, which may be 0.

        Raises OSError if the autopilot is lost.
        """
        count = 0
        with self._writing:
            for frame in frames:
                if self._clear_at - time.monotonic() > _AHEAD_S:
                    break
                payload = codec.can_frame(frame.id | _EXTENDED, frame.data, self._bus - 1, self._system)
                if not self._write(Kind.CAN_FRAME, payload):
                    break
                count += 1
        if not count:
            time.sleep(_PAUSE_S)
        return count

    def shutdown(self) -> None:
        """Stop the forwarding, if the autopilot can still be reached, and close the line."""
        try:
            with self._writing:
                self._write(Kind.COMMAND_LONG, codec.command(_FORWARD, 0, self._system))
        except OSError:
            pass
        self._line.close()

    # Opening.

    def _find(self, parsed: Channel, rates: tuple[int, ...], native_usb: bool) -> None:
        """Wait for a heartbeat, at each of `rates`. Raises PortOpenFailed, OSError and Abandoned."""
        each_s = _HEARTBEAT_S if len(rates) < 2 else _RATE_S
        for rate in rates or (0,):
            if self._serial is not None:
                if not self._serial.set_baud(rate):
                    continue
                self._reader = Reader(self._key)
                self._byte_s = 0.0 if native_usb else SerialLineInfo.BITS_PER_BYTE / rate
            if self._await_heartbeat(each_s):
                if self._serial is not None:
                    latency_ms = self._serial.reduce_latency()
                    self.line_info = SerialLineInfo(
                        rate, found=parsed.baud is None and not native_usb, native_usb=native_usb,
                        latency_ms=latency_ms,
                        frame_bytes=codec.CAN_FRAME_BYTES + (0 if self._key is None else codec.SIGNATURE),
                    )  # fmt: skip
                    if not native_usb:
                        self._filter = FILTER
                return
        if self._reader.wrongly_signed:
            raise self._key_wrong()
        if self._reader.unsigned:
            remedy = f"Set up signing in the autopilot, or start hornbill without {KEY}."
            raise self._refusal("its MAVLink messages are not signed, but a key is set.", remedy, "mavcan_not_signed")
        if self._serial is not None:
            remedy = "Check SERIALn_PROTOCOL (2) and SERIALn_BAUD of the autopilot, and the baud rate after @."
            where = f"no MAVLink heartbeat was received at {' or '.join(map(str, rates))} baud."
        else:
            remedy = "Check host and port, and that the autopilot or its router listens for UDP there."
            where = "no MAVLink heartbeat was received."
        raise self._refusal(where, remedy, "mavcan_silent")

    def _await_heartbeat(self, within_s: float) -> bool:
        until = time.monotonic() + within_s
        speak_at = 0.0
        while (now := time.monotonic()) < until:
            if not self._wanted():
                raise Abandoned
            if self._udp is not None and now >= speak_at:  # who sends datagrams must know our address
                speak_at = now + _REPEAT_S
                self._write(Kind.HEARTBEAT, codec.heartbeat())
            for message in self._messages(self._line.read(_POLL_S)):
                if message.kind != Kind.HEARTBEAT:
                    continue
                sender = codec.heartbeat_of(message.payload)
                if sender.autopilot != _NO_AUTOPILOT and sender.vehicle != _GROUND_STATION:
                    self._system, self._signed = message.system, message.signed
                    return True
            if self._reader.wrongly_signed:
                raise self._key_wrong()
        return False

    def _begin(self) -> None:
        """Request the forwarding. Raises PortOpenFailed, OSError and Abandoned."""
        until = time.monotonic() + _FORWARD_S
        request_at = 0.0
        got = Received()
        while (now := time.monotonic()) < until:
            if not self._wanted():
                raise Abandoned
            if now >= request_at:
                request_at = now + _REPEAT_S
                self._renew(now)
            for message in self._messages(self._line.read(_POLL_S)):
                if message.system == self._system:
                    self._take(message, got, time.monotonic())
            if self._result == _ACCEPTED or got.frames:
                now = time.monotonic()
                self._heard_at = self._forwarded_at = now
                self._renew_at = now + _RENEW_S
                self._seen_lost = self._reader.lost
                self._seen_garbled = self._reader.garbled + self._reader.unsigned + self._reader.wrongly_signed
                return
            if self._result not in (None, _IN_PROGRESS):
                remedy = f"Check that its CAN driver {self._bus} is on (CAN_P{self._bus}_DRIVER), or choose ?bus=N."
                raise self._refusal(
                    f"system {self._system} refuses to forward CAN bus {self._bus} (result {self._result}).",
                    remedy, "mavcan_refused", bus=self._bus, result=self._result or 0,
                )  # fmt: skip
        if self._key is None and self._signed:
            remedy = f"Set {KEY} to the passphrase of its signing key, and start hornbill again."
            raise self._refusal("the autopilot signs MAVLink and ignores us.", remedy, "mavcan_key_missing")
        if self._key is not None:
            raise self._key_wrong()
        remedy = "Its firmware must support CAN forwarding (ArduPilot 4.2 or later)."
        raise self._refusal("the autopilot does not respond to MAV_CMD_CAN_FORWARD.", remedy, "mavcan_unsupported")

    def _key_wrong(self) -> PortOpenFailed:
        remedy = f"Set {KEY} to the passphrase set in the autopilot, and check the clock of this computer."
        return self._refusal(
            f"the signing key in {KEY} is not that of the autopilot.", remedy, "mavcan_key_wrong", variable=KEY
        )

    def _refusal(self, why: str, remedy: str, cause: Cause, **facts: str | int) -> PortOpenFailed:
        return PortOpenFailed(
            f"{self._address} cannot be used: {why} {remedy}",
            address=self._address, remedy=remedy, cause=cause, **facts,
        )  # fmt: skip

    # While it is open.

    def _messages(self, datagrams: list[bytes]) -> list[Message]:
        found: list[Message] = []
        for data in datagrams:
            if self._udp is not None:
                self._reader.begin()
            found += self._reader.feed(data)
        return found

    def _take(self, message: Message, got: Received, now: Instant) -> None:
        if message.kind == Kind.CANFD_FRAME:
            got.ignored += 1
        elif message.kind == Kind.COMMAND_ACK:
            number, result = codec.acknowledged(message.payload)
            if number == _FORWARD:
                self._result = result
                self._forwarded_at = now
                if self._requested_at is not None:
                    self._round_trips.append(now - self._requested_at)
                    self._requested_at = None
        elif message.kind == Kind.CAN_FRAME:
            frame = codec.can_frame_of(message.payload)
            if frame is None:
                got.garbled += 1
            elif frame.bus != self._bus - 1 or not frame.identifier & _EXTENDED or frame.identifier & _NOT_DATA:
                got.ignored += 1
            else:
                self._forwarded_at = now
                got.frames.append(Frame(frame.identifier & 0x1FFF_FFFF, frame.data, now))

    def _renew(self, now: Instant) -> None:
        """Request the forwarding for the next five seconds."""
        with self._writing:
            if self._udp is not None:
                self._write(Kind.HEARTBEAT, codec.heartbeat())
            self._write(Kind.CAN_FILTER_MODIFY, codec.can_filter(self._filter, self._bus, self._system))
            if self._write(Kind.COMMAND_LONG, codec.command(_FORWARD, self._bus, self._system)):
                self._requested_at = now

    def _write(self, kind: Kind, payload: bytes) -> bool:
        data = self._writer.encode(kind, payload)
        if not self._line.write(data):
            return False
        self._clear_at = max(self._clear_at, time.monotonic()) + len(data) * self._byte_s
        return True
