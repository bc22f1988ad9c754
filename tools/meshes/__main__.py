"""Write the models into the package: `python -m tools.meshes`."""

from pathlib import Path

from hornbill.view.case import CASES, PLAIN
from tools.meshes import horn, servo
from tools.meshes.baked import baked
from tools.meshes.gltf import encode

FOLDER = Path(__file__).parents[2] / "server" / "hornbill" / "view" / "meshes"


def bake() -> dict[str, bytes]:
    """Content of every model by file name. Takes a few seconds."""
    made: dict[str, bytes] = {}
    for case in CASES:
        known = case is not PLAIN
        made[f"{case.key}-near.glb"] = encode(servo.near(case) if known else servo.plain(case, fine=True))
        far = servo.far(case) if known else servo.plain(case, fine=False)
        made[f"{case.key}-far.glb"] = encode(far)
        made[f"{case.key}-near-low.glb"] = encode(baked(far, turns=False))
        made[f"{case.key}-far-low.glb"] = encode(baked(servo.coarse(case), turns=False))
    made["horn-near.glb"] = encode(horn.near())
    made["horn-far.glb"] = encode(horn.far())
    made["horn-near-low.glb"] = encode(baked(horn.far(), turns=True))
    made["horn-far-low.glb"] = encode(baked(horn.coarse(), turns=True))
    made["horn-ghost.glb"] = encode(horn.ghost(fine=True))
    made["horn-ghost-far.glb"] = encode(horn.ghost(fine=False))
    return made


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, content in bake().items():
        (FOLDER / name).write_bytes(content)
