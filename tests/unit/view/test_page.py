"""viser's page as we serve it: known scripts, a policy that admits only them, our style."""

import hashlib
import re
from base64 import b64encode

from hornbill.view.page import client
from hornbill.view.palette import DARK, LIGHT

KNOWN = {
    "1.1.1": (
        "'sha256-9snRR0PMABSR8K3bp79PTkzEjzjy0iHeml+9+NXmfB4='",
        "'sha256-NuK2lui20mMt60Mxy+ktx0RQ3DTALZwt3Ki5EG2jF0U='",
    ),
}
"""viser's version and the hashes of the script in its page and of the one that unpacks. A version that is not here has
not been looked at: see whether the panel is still hidden and nothing else is fetched, then add it."""


def test_viser_is_a_version_whose_scripts_were_looked_at() -> None:
    found = client()
    assert found.version in KNOWN
    assert (found.loader_hash, found.program_hash) == KNOWN[found.version]
    assert found.subprotocol == f"viser-v{found.version}"


def test_what_complains_in_the_console_is_replaced_in_the_program_of_that_version() -> None:
    assert client().patched == 2


def test_the_served_page_has_one_script_and_its_hash_is_in_the_policy() -> None:
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", client().page(dark=True).decode(), re.DOTALL)
    assert len(scripts) == 1
    digest = b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
    assert f"'sha256-{digest}'" in client().policy


def test_the_policy_lets_nothing_else_run_and_nobody_else_be_asked() -> None:
    rules = dict(rule.split(" ", 1) for rule in client().policy.split("; "))
    assert rules["default-src"] == "'none'"
    assert rules["frame-ancestors"] == "'self'"
    assert rules["connect-src"] == "'self' data: blob:"
    assert "'wasm-unsafe-eval'" in rules["script-src"].split()
    assert not {"'unsafe-inline'", "'unsafe-eval'", "data:", "blob:", "*"} & set(rules["script-src"].split())
    assert "http" not in client().policy


def test_the_page_hides_the_panel_and_wears_the_theme() -> None:
    dark, light = client().page(dark=True).decode(), client().page(dark=False).decode()
    assert ".mantine-Paper-root" in dark
    assert "display: none !important" in dark
    assert DARK.background in dark
    assert LIGHT.background in light
