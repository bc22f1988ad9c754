"""The wheel contains the package with its tables, page, meshes and migrations, and nothing else."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COPIED = ("server", "schemas", "pyproject.toml", "README.md", "LICENSE", "THIRD_PARTY.md")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of the sources of a wheel, without a built page."""
    folder = tmp_path / "checkout"
    folder.mkdir()
    for name in COPIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, folder / name)
    return folder


def build(checkout: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(checkout / "dist")]
    return subprocess.run(command, cwd=checkout, capture_output=True, text=True, check=False)


@pytest.mark.release
def test_the_wheel_contains_the_package_and_its_data_only(checkout: Path, tmp_path: Path) -> None:
    page = checkout / "web" / "dist"
    (page / "assets").mkdir(parents=True)
    (page / "index.html").write_text("<!doctype html><title>hornbill</title>")
    (page / "assets" / "index-1.js").write_text("export {};")
    docs = checkout / "docs" / "dist"
    (docs / "_images").mkdir(parents=True)
    (docs / "index.html").write_text("<title>Documentation</title>")
    (docs / "_images" / "wiring.svg").write_text("<svg/>")
    for name in ("list.png", "jog.webp"):
        (docs / "_images" / name).write_bytes(bytes(1000))
    built = build(checkout)
    assert built.returncode == 0, built.stderr
    (wheel,) = (checkout / "dist").glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    for needed in (
        "hornbill/py.typed",
        "hornbill/_data/schemas/parameters.toml",
        "hornbill/_data/schemas/models/bla21-06u-a0.toml",
        "hornbill/_data/web/index.html",
        "hornbill/_data/web/assets/index-1.js",
        "hornbill/_data/docs/index.html",
        "hornbill/_data/docs/_images/wiring.svg",
        "hornbill/api/monitoring/alerts.yaml",
        "hornbill/api/monitoring/dashboard.json",
        "hornbill/view/meshes/bla21-near.glb",
        "hornbill/store/migrations/env.py",
    ):
        assert needed in names, needed
    assert [name for name in names if name.endswith((".png", ".webp"))] == []
    assert [name for name in names if name.endswith("README.md")] == ["hornbill/_data/schemas/README.md"]
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"hornbill"}

    # outside the checkout, tables and page come from the wheel
    site = tmp_path / "site"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    script = (
        f"import sys; sys.path.insert(0, {str(site)!r}); import hornbill; from hornbill import resources; "
        "from hornbill.schema.catalog import Catalog; models = Catalog.load().models; "
        "print(hornbill.__file__, resources.page(), len(models))"
    )
    ran = subprocess.run([sys.executable, "-I", "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True)
    package, shown, models = ran.stdout.split()
    assert package.startswith(str(site))
    assert shown == str(site / "hornbill" / "_data" / "web")
    assert models == "10"


@pytest.mark.release
def test_a_wheel_without_the_page_is_not_built(checkout: Path) -> None:
    built = build(checkout)
    assert built.returncode != 0
    assert "make build" in built.stderr + built.stdout
