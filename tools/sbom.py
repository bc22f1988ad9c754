"""Software bill of materials (CycloneDX 1.6): the packages of the lock files. Run by `make sbom` and in the image.

`python -m tools.sbom` prints it. It needs the standard library only, and is the same for the same checkout.
"""

import base64
import json
import re
import tomllib
import uuid
from collections.abc import Iterator
from functools import cache
from typing import Any, Final
from urllib.parse import quote

from tools import notices

LICENCE: Final = re.compile(r"^\| ([^|]+) \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
PACKAGE: Final = re.compile(r"^([a-z0-9][a-z0-9._-]*)==([^\s;\\]+)((?:[^\n]*\\\n)*[^\n]*)", re.MULTILINE)
"""A package of a lock file with its version, and the hashes of its files."""


def document() -> dict[str, Any]:
    """The bill of materials as JSON: hornbill, its Python packages, and the packages compiled into its page."""
    version = tomllib.loads((notices.ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    ours = {
        "type": "application",
        "bom-ref": f"pkg:pypi/hornbill@{version}",
        "name": "hornbill",
        "version": version,
        "purl": f"pkg:pypi/hornbill@{version}",
        "licenses": [{"license": {"id": "Apache-2.0"}}],
    }
    found = [*_python(), *_page()]
    content = json.dumps([ours, found], sort_keys=True)
    return {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, content)}",
        "version": 1,
        "metadata": {"component": ours},
        "components": found,
        "dependencies": [{"ref": ours["bom-ref"], "dependsOn": [one["bom-ref"] for one in found]}],
    }


def _python() -> Iterator[dict[str, Any]]:
    """Packages of requirements.lock, also those of other systems."""
    lock = (notices.ROOT / "requirements.lock").read_text(encoding="utf-8")
    for name, version, rest in PACKAGE.findall(lock):
        # The hashes are those of all files of the package; CycloneDX has one value per algorithm and component.
        hashes = re.findall(r"sha256:([0-9a-f]{64})", rest)
        files = [{"type": "distribution", "url": f"https://pypi.org/project/{name}/{version}/",
                  "hashes": [{"alg": "SHA-256", "content": one}]} for one in hashes]  # fmt: skip
        yield _component(name, version, f"pkg:pypi/{name}@{version}", _licences().get(name)) | {
            "externalReferences": files
        }


def _page() -> Iterator[dict[str, Any]]:
    """Packages compiled into the page."""
    packages = json.loads((notices.WEB / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    for name in notices.runtime():
        one = packages[f"node_modules/{name}"]
        algorithm, _, digest = str(one["integrity"]).partition("-")
        content = base64.b64decode(digest).hex()
        yield _component(name, one["version"], f"pkg:npm/{quote(name)}@{one['version']}", one.get("license")) | {
            "hashes": [{"alg": algorithm.upper().replace("SHA", "SHA-"), "content": content}]
        }


def _component(name: str, version: str, purl: str, licence: str | None) -> dict[str, Any]:
    return {
        "type": "library",
        "bom-ref": purl,
        "name": name,
        "version": version,
        "purl": purl,
        **({} if licence is None else {"licenses": [{"license": {"name": licence}}]}),
    }


@cache
def _licences() -> dict[str, str]:
    """Licence of each Python package in THIRD_PARTY.md."""
    text = notices.PAGE.read_text(encoding="utf-8")
    return {name.strip(): licence.strip() for name, _, licence in LICENCE.findall(text)}


if __name__ == "__main__":
    print(json.dumps(document(), indent=1))
