"""viser's page as hornbill serves it: panel hidden, mended where it complains, allowed to run its two scripts only."""

import hashlib
import importlib.metadata
import importlib.util
import json
import re
from base64 import b64encode
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import zstandard

from hornbill.view.palette import palette

_LOADER = re.compile(r'<script data-p="([^"]*)" data-ss="(\d+)" data-cs="(\d+)">(.*?)</script>', re.DOTALL)
_DIGITS = "".join(chr(code) for code in range(0x21, 0x7F) if chr(code) not in "\"&<>'`")
_AT_ONCE = 5 * 16384
"""Digits unpacked at once; whole groups of five."""
_UNPACKED = "td.decode(heap.subarray(up+ss,up+sz))"
"""Where viser's loader makes its program text."""
_MENDED = (
    # Loads the decoder of Gaussian splats, which makes functions of text: the policy forbids it, and no scene of ours
    # has splats.
    (
        rb"=fetch\(\w{1,4}\)\.then\(e=>e\.arrayBuffer\(\)\)\.then\(e=>\w{1,4}\(\{wasmBinary:e\}\)\);function",
        b"=null;function",
    ),
    # three.js warns of its own clock, which viser's libraries make.
    (rb"\b\w{1,4}\(`Clock: This module has been deprecated\. Please use THREE\.Timer instead\.`\)", b"void 0"),
)
"""What of viser's program is replaced, as patterns, and by what. Each is there once, or not at all."""
_STYLE = """<style>
#root .mantine-Paper-root, #root .mantine-Notifications-root, [data-portal],
[title='About Viser'] {{ display: none !important; }}
html, body, #root, #root :has(> canvas), #root :has(canvas) {{ background-color: {background} !important; }}
</style>"""


class UnknownClient(RuntimeError):
    """viser's page is not packed the way this version of hornbill knows."""


@dataclass(frozen=True, slots=True)
class Client:
    """viser's page and what the policy has to know of it."""

    version: str
    html: str
    loader_hash: str
    """sha256 of the script in the page, as a policy source."""
    program_hash: str
    """sha256 of the script that the first one unpacks, mends and adds."""
    mended: int
    """How many places of the program are replaced."""

    @property
    def subprotocol(self) -> str:
        """What viser's WebSocket insists on."""
        return f"viser-v{self.version}"

    @property
    def policy(self) -> str:
        """The Content-Security-Policy of the page: the two scripts, no other, and no talk with anybody but us."""
        return "; ".join(
            (
                "default-src 'none'",
                f"script-src {self.loader_hash} {self.program_hash} 'wasm-unsafe-eval'",
                "style-src 'unsafe-inline'",
                "connect-src 'self' data: blob:",
                "img-src 'self' data: blob:",
                "font-src data:",
                "worker-src blob:",
                "base-uri 'none'",
                "form-action 'none'",
                "frame-ancestors 'self'",
            )
        )

    def page(self, *, dark: bool) -> bytes:
        """The page with our style, for a dark or a light surrounding."""
        style = _STYLE.format(background=palette(dark=dark).background)
        html = self.html.replace("<title>Viser</title>", "<title>3D view</title>", 1)
        return html.replace("</head>", f"{style}</head>", 1).encode()


@cache
def client() -> Client:
    """Reads viser's page from the installed package, without importing viser.

    Raises UnknownClient when viser is missing or packs its page differently.
    """
    spec = importlib.util.find_spec("viser")
    if spec is None or not spec.submodule_search_locations:
        raise UnknownClient("viser is not installed: install hornbill with its dependencies")
    html = (Path(spec.submodule_search_locations[0]) / "client" / "build" / "index.html").read_text("utf-8")
    version = importlib.metadata.version("viser")
    found = _LOADER.search(html)
    if found is None or html.count("<script") != 1:
        raise UnknownClient(f"viser {version} packs its page in a way hornbill does not know: use viser 1.1.1")
    packed, style_bytes, program_bytes, loader = found.groups()
    program = _part(packed, int(style_bytes), int(program_bytes))
    if loader.count(_UNPACKED) != 1:
        raise UnknownClient(f"viser {version} unpacks its program in a way hornbill does not know: use viser 1.1.1")
    mends: list[tuple[str, str]] = []
    for pattern, by in _MENDED:
        hits = list(re.finditer(pattern, program))
        if len(hits) == 1:
            mends.append((hits[0][0].decode(), by.decode()))
            program[hits[0].start() : hits[0].end()] = by  # in place: a copy is megabytes that stay with the process
    replaced = f"{json.dumps(mends)}.reduce((code,[text,by])=>code.replace(text,by),{_UNPACKED})"
    mended = loader.replace(_UNPACKED, replaced)
    html = html.replace(loader, mended)
    return Client(version, html, _source(mended.encode()), _source(program), len(mends))


def _part(packed: str, start: int, length: int) -> bytearray:
    """`length` bytes from `start` of what is packed. Unpacked piece by piece, for all at once is many megabytes."""
    unpacker = zstandard.ZstdDecompressor().decompressobj()
    part, end, at = bytearray(), start + length, 0
    for begin in range(0, len(packed), _AT_ONCE):
        piece = unpacker.decompress(_unpack(packed[begin : begin + _AT_ONCE]))
        part += piece[max(start - at, 0) : max(end - at, 0)]
        at += len(piece)
    return part


def _unpack(text: str) -> bytes:
    """Base 88, five digits for four bytes, most significant first; a rest of k digits is k - 1 bytes."""
    values = np.zeros(128, dtype=np.uint64)
    values[[ord(digit) for digit in _DIGITS]] = np.arange(len(_DIGITS), dtype=np.uint64)
    digits = values[np.frombuffer(text.encode("ascii"), dtype=np.uint8)]
    whole = len(digits) // 5 * 5
    powers = np.array([88**power for power in (4, 3, 2, 1, 0)], dtype=np.uint64)
    content = (digits[:whole].reshape(-1, 5) @ powers).astype(">u4").tobytes()
    rest = 0
    for digit in digits[whole:].tolist():
        rest = rest * 88 + digit
    return content + rest.to_bytes(max(len(digits) - whole - 1, 0), "big")


def _source(script: bytes | bytearray) -> str:
    return f"'sha256-{b64encode(hashlib.sha256(script).digest()).decode()}'"
