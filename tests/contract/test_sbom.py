"""The bill of materials lists every package of the lock files, in the form of CycloneDX."""

import re
from pathlib import Path

from tools import notices, sbom

ROOT = Path(__file__).parents[2]


def test_it_lists_every_package_with_version_hashes_and_licence() -> None:
    document = sbom.document()
    assert (document["bomFormat"], document["specVersion"]) == ("CycloneDX", "1.6")
    assert re.fullmatch(r"urn:uuid:[0-9a-f-]{36}", document["serialNumber"])
    found = {one["purl"]: one for one in document["components"]}
    assert len(found) == len(document["components"])
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    locked = {
        f"pkg:pypi/{name}@{version}" for name, version in re.findall(r"^([\w.-]+)==([^\s;]+)", lock, re.MULTILINE)
    }
    assert len(locked) > 40
    assert {purl for purl in found if purl.startswith("pkg:pypi/")} == locked
    assert len([purl for purl in found if purl.startswith("pkg:npm/")]) == len(notices.runtime()) >= 3
    hashes = lock.count("sha256:")
    assert sum(len(one.get("externalReferences", ())) for one in found.values()) == hashes
    assert [purl for purl, one in found.items() if "licenses" not in one] == []
    assert document["dependencies"][0]["dependsOn"] == list(found)
    assert sbom.document() == document, "the same checkout has the same bill"


def test_the_image_has_it_with_labels_and_checks_readiness() -> None:
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    assert "python -m tools.sbom > /opt/hornbill/sbom.cdx.json" in text
    for label in ("title", "description", "licenses", "version", "revision"):
        assert f"org.opencontainers.image.{label}=" in text
    assert "/ready" in re.findall(r"^HEALTHCHECK.*\n.*", text, re.MULTILINE)[0]
