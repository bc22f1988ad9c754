"""viser's page as hornbill serves it: known scripts, a policy that allows only them, and the style."""

import hashlib
import re
from base64 import b64encode

from hornbill.view.page import client
from hornbill.view.palette import DARK, LIGHT

KNOWN = {
    "1.1.1": (
        "'sha256-3paQmavmNF5A5TLruR/I0EIIo3nbiGoADvSuIcDgv/s='",
        "'sha256-6tsgapslmIulDZkE7C0fmNDsxp82xboPzUmHm6dEytA='",
    ),
}
"""viser's version with the hashes of the script in its page and of the unpacked program. Before adding a version, check
that the panel is hidden and nothing else is fetched."""


def test_the_scripts_of_viser_are_known() -> None:
    found = client()
    assert found.version in KNOWN
    assert (found.loader_hash, found.program_hash) == KNOWN[found.version]
    assert found.subprotocol == f"viser-v{found.version}"
    assert found.patched == 4, "every patch finds its place"


def test_the_policy_allows_only_the_one_script_of_the_page() -> None:
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", client().page(dark=True).decode(), re.DOTALL)
    assert len(scripts) == 1
    digest = b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
    assert f"'sha256-{digest}'" in client().policy
    rules = dict(rule.split(" ", 1) for rule in client().policy.split("; "))
    assert rules["default-src"] == "'none'"
    assert rules["frame-ancestors"] == "'self'"
    assert rules["connect-src"] == "'self' data: blob:"
    assert "'wasm-unsafe-eval'" in rules["script-src"].split()
    assert not {"'unsafe-inline'", "'unsafe-eval'", "data:", "blob:", "*"} & set(rules["script-src"].split())
    assert "http" not in client().policy


def test_the_page_hides_the_panel_and_has_the_theme() -> None:
    dark, light = client().page(dark=True).decode(), client().page(dark=False).decode()
    assert ".mantine-Paper-root" in dark
    assert "display: none !important" in dark
    assert DARK.background in dark
    assert LIGHT.background in light
