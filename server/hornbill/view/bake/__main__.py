"""Writes the models into the package: `python -m hornbill.view.bake`."""

from pathlib import Path

from hornbill.view.bake import horn, servo
from hornbill.view.bake.gltf import encode
from hornbill.view.case import CASES

FOLDER = Path(__file__).resolve().parent.parent / "meshes"


def bake() -> dict[str, bytes]:
    """File name to content of every model; takes some seconds."""
    made: dict[str, bytes] = {}
    for case in CASES:
        made[f"{case.key}-near.glb"] = encode(servo.near(case))
        made[f"{case.key}-far.glb"] = encode(servo.far(case))
    made["horn-near.glb"] = encode(horn.near())
    made["horn-far.glb"] = encode(horn.far())
    made["horn-ghost.glb"] = encode(horn.ghost())
    return made


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, content in bake().items():
        (FOLDER / name).write_bytes(content)
