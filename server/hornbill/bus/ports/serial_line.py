"""SerialStream: byte stream of a serial adapter, read in large blocks and written with a timeout."""

import errno
import io
import os
import select
import time
from pathlib import Path

import serial

TTYS = Path("/sys/class/tty")
"""Where Linux lists serial ports."""

try:
    from termios import error as termios_error
except ImportError:  # Windows
    termios_error = OSError

_READ_BYTES = 65536
_PIECE_S = 0.01  # how often a blocked write checks for a timeout


class SerialStream:
    """A serial port or other pyserial URL. One thread may read while another writes."""

    def __init__(self, url: str, baud: int) -> None:
        """Open `url` exclusively at `baud` bit/s. Raises OSError with the errno of the cause."""
        self._url = url
        try:
            # Exclusive: two programs on one adapter would each get half of its responses.
            self._port = serial.serial_for_url(url, baudrate=baud, timeout=0, exclusive=True)
        except serial.SerialException as error:
            if error.errno == errno.EAGAIN:
                raise OSError(errno.EBUSY, f"{url} is in use") from error
            raise
        try:
            self._descriptor = self._port.fileno() if os.name == "posix" else None
        except io.UnsupportedOperation:
            self._descriptor = None
        self._incomplete = False

    def set_baud(self, baud: int) -> bool:
        """Change the rate to `baud` bit/s and drop received data. False if the port does not support the rate.

        Raises OSError if the device was removed.
        """
        try:
            self._port.baudrate = baud
            self._port.reset_input_buffer()
        except ValueError:
            return False
        except OSError as error:  # EINVAL: the driver does not support this rate
            if error.errno != errno.EINVAL:
                raise
            return False
        except termios_error as error:
            raise OSError(*error.args) from error
        return True

    def reduce_latency(self) -> int | None:
        """Make the driver forward bytes at once. Returns the resulting latency timer of an FTDI chip, ms.

        None for other chips, and if the system does not report it. Only Linux lets a program set it.
        """
        try:
            self._port.set_low_latency_mode(True)
        except (AttributeError, NotImplementedError, ValueError, OSError):
            pass
        name = os.path.basename(os.path.realpath(self._url))  # noqa: PTH119 - a URL is no path
        try:
            return int((TTYS / name / "device" / "latency_timer").read_text(encoding="ascii"))
        except (OSError, ValueError):
            return None

    def fileno(self) -> int:
        """The file descriptor. Raises io.UnsupportedOperation if there is none."""
        return self._port.fileno()

    def backlog(self) -> int:
        """Bytes written but not sent yet. 0 if the system does not report it."""
        try:
            return self._port.out_waiting
        except (AttributeError, NotImplementedError, OSError):
            return 0

    def read(self, timeout_s: float) -> bytes:
        """Read all available data, waiting up to `timeout_s` seconds. Raises OSError if the device was removed."""
        if self._descriptor is None:
            return self._read_blocking(timeout_s)
        ready, _, _ = select.select([self._descriptor], [], [], timeout_s)
        if not ready:
            return b""
        try:
            data = os.read(self._descriptor, _READ_BYTES)
        except BlockingIOError:
            return b""
        if not data:
            raise OSError(errno.EIO, f"{self._url} was disconnected")
        return data

    def write(self, data: bytes, within_s: float) -> bool:
        """Write all of `data` or nothing. False if no byte was accepted within `within_s` seconds.

        Raises OSError if the device was removed, or accepted only a part. After that, writes fail: an adapter may
        combine half a frame and the following data into another frame.
        """
        if self._incomplete:
            raise OSError(errno.EIO, f"{self._url} accepted only part of a line")
        if self._descriptor is None:
            return self._write_blocking(data, within_s)
        until = time.monotonic() + within_s
        left = memoryview(data)
        while left:
            try:
                left = left[os.write(self._descriptor, left) :]
            except BlockingIOError:
                now = time.monotonic()
                if now >= until:
                    if len(left) == len(data):
                        return False
                    self._incomplete = True
                    raise OSError(errno.EIO, f"{self._url} accepted only part of a line") from None
                select.select([], [self._descriptor], [], min(_PIECE_S, until - now))
        return True

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def _read_blocking(self, timeout_s: float) -> bytes:
        if self._port.timeout != timeout_s:
            self._port.timeout = timeout_s
        first: bytes = self._port.read(1)
        if not first:
            return b""
        return first + self._port.read(min(self._port.in_waiting, _READ_BYTES))

    def _write_blocking(self, data: bytes, within_s: float) -> bool:
        if self._port.write_timeout != within_s:
            self._port.write_timeout = within_s
        try:
            self._port.write(data)
        except serial.SerialTimeoutException:
            self._incomplete = True  # the number of accepted bytes is unknown
            raise
        return True
