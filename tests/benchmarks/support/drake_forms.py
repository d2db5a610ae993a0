"""Requests as Drake's render clients send them."""

import hashlib
import json
import pathlib

WIDTH, HEIGHT = 640, 480
_BOUNDARY = "tessera-bench-form"

# A sensor of 45 degrees, as drake-blender's own test has it.
_FIELDS = {
    "width": WIDTH, "height": HEIGHT, "near": 0.01, "far": 10.0, "focal_x": 579.411, "focal_y": 579.411,
    "fov_x": 0.785398, "fov_y": 0.785398, "center_x": 319.5, "center_y": 239.5,
}  # fmt: skip


def moved_scene(gltf, step):
    """The scene as a simulator sends it a moment later: its first box and its camera have moved a little."""
    document = json.loads(pathlib.Path(gltf).read_text())
    boxes = [node for node in document["nodes"] if "mesh" in node]
    cameras = [node for node in document["nodes"] if "camera" in node]
    boxes[0]["matrix"][12] += 1e-5 * step
    cameras[0]["matrix"][12] += 1e-5 * step
    return json.dumps(document).encode()


def form(scene, image_type, **changes):
    """The headers and the body of a POST."""
    fields = {"scene_sha256": hashlib.sha256(scene).hexdigest(), "image_type": image_type, **_FIELDS, **changes}
    if image_type == "depth":
        fields |= {"min_depth": 0.01, "max_depth": 10.0}
    parts = [f'Content-Disposition: form-data; name="{name}"\r\n\r\n{value}' for name, value in fields.items()]
    parts.append(
        'Content-Disposition: form-data; name="scene"; filename="scene.gltf"\r\nContent-Type: model/gltf+json\r\n\r\n'
        + scene.decode()
    )
    body = "".join(f"--{_BOUNDARY}\r\n{part}\r\n" for part in parts) + f"--{_BOUNDARY}--\r\n"
    return {"Content-Type": f"multipart/form-data; boundary={_BOUNDARY}"}, body.encode()
