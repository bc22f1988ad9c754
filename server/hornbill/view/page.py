"""viser's page as served by hornbill: panel hidden, patched, and restricted to its two scripts."""

import hashlib
import importlib.metadata
import importlib.util
import json
import re
from base64 import b64encode
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import zstandard

from hornbill.view.palette import palette

_LOADER = re.compile(r'<script data-p="([^"]*)" data-ss="(\d+)" data-cs="(\d+)">(.*?)</script>', re.DOTALL)
_DIGITS = "".join(chr(code) for code in range(0x21, 0x7F) if chr(code) not in "\"&<>'`")
_AT_ONCE = 5 * 16384
"""Digits unpacked at once, a multiple of five."""
_UNPACKED = "td.decode(heap.subarray(up+ss,up+sz))"
"""Expression in viser's loader that yields its program text."""
_PATCHES = (
    # Loads the decoder of Gaussian splats, which compiles text: forbidden by the policy, and our scenes have no splats.
    (
        rb"=fetch\(\w{1,4}\)\.then\(e=>e\.arrayBuffer\(\)\)\.then\(e=>\w{1,4}\(\{wasmBinary:e\}\)\);function",
        b"=null;function",
    ),
    # three.js warns about its own clock, which viser's libraries use.
    (rb"\b\w{1,4}\(`Clock: This module has been deprecated\. Please use THREE\.Timer instead\.`\)", b"void 0"),
    # Antialiasing and a kept picture double the time of a frame drawn in software.
    (
        rb"\bgl:\{preserveDrawingBuffer:!0,",
        b"gl:{antialias:!/quality=low/.test(location.search),preserveDrawingBuffer:!1,",
    ),
    # A background image, which our scenes do not have, is a full picture of pixels to discard.
    (
        rb"\b(\w)\.uniforms\.cameraNear\.value=\w\.near,(?=\1\.uniforms\.cameraFar)",
        b"n.visible=!1,",
    ),
)
"""Patches of viser's program: pattern and replacement. Each pattern occurs at most once."""
_STYLE = """<style>
#root .mantine-Paper-root, #root .mantine-Notifications-root, [data-portal],
[title='About Viser'] {{ display: none !important; }}
html, body, #root, #root :has(> canvas), #root :has(canvas) {{ background-color: {background} !important; }}
</style>"""


class UnknownClient(RuntimeError):
    """viser's page has a format unknown to this version of hornbill."""


@dataclass(frozen=True, slots=True)
class Client:
    """viser's page, with the data for its policy."""

    version: str
    html: str
    loader_hash: str
    """sha256 of the script in the page, as a policy source."""
    program_hash: str
    """sha256 of the script that the first one unpacks, patches and adds."""
    patched: int
    """Number of patched places."""

    @property
    def subprotocol(self) -> str:
        """WebSocket subprotocol required by viser."""
        return f"viser-v{self.version}"

    @property
    def policy(self) -> str:
        """The Content-Security-Policy of the page: only the two scripts, and connections only to our origin."""
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
        """The page with our style, dark or light."""
        style = _STYLE.format(background=palette(dark=dark).background)
        html = self.html.replace("<title>Viser</title>", "<title>3D view</title>", 1)
        return html.replace("</head>", f"{style}</head>", 1).encode()


@cache
def client() -> Client:
    """Read viser's page from the installed package, without importing viser.

    Raises UnknownClient if viser is missing or its page has another format.
    """
    spec = importlib.util.find_spec("viser")
    if spec is None or not spec.submodule_search_locations:
        raise UnknownClient("viser is not installed: install hornbill with its dependencies")
    html = (Path(spec.submodule_search_locations[0]) / "client" / "build" / "index.html").read_text("utf-8")
    version = importlib.metadata.version("viser")
    found = _LOADER.search(html)
    if found is None or html.count("<script") != 1:
        raise UnknownClient(f"viser {version} has an unknown page format. Use viser 1.1.1")
    packed, style_bytes, program_bytes, loader = found.groups()
    program = _part(packed, int(style_bytes), int(program_bytes))
    if loader.count(_UNPACKED) != 1:
        raise UnknownClient(f"viser {version} has an unknown loader. Use viser 1.1.1")
    patches: list[tuple[str, str]] = []
    for pattern, by in _PATCHES:
        hits = list(re.finditer(pattern, program))
        if len(hits) == 1:
            patches.append((hits[0][0].decode(), by.decode()))
            program[hits[0].start() : hits[0].end()] = by  # in place: a copy is megabytes that stay with the process
    replaced = f"{json.dumps(patches)}.reduce((code,[text,by])=>code.replace(text,by),{_UNPACKED})"
    patched = loader.replace(_UNPACKED, replaced)
    html = html.replace(loader, patched)
    return Client(version, html, _source(patched.encode()), _source(program), len(patches))


def _part(packed: str, start: int, length: int) -> bytearray:
    """`length` unpacked bytes from `start`. Unpacked piece by piece to limit memory."""
    unpacker = zstandard.ZstdDecompressor().decompressobj()
    part, end, at = bytearray(), start + length, 0
    for begin in range(0, len(packed), _AT_ONCE):
        piece = unpacker.decompress(_unpack(packed[begin : begin + _AT_ONCE]))
        part += piece[max(start - at, 0) : max(end - at, 0)]
        at += len(piece)
    return part


def _unpack(text: str) -> bytes:
    """Decode base 88: five digits for four bytes, most significant first; a remainder of k digits is k - 1 bytes."""
    import numpy as np  # late, like viser

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
