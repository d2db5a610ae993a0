"""Makes GLB files: one of a .gltf with its files beside it, and ones of any size."""

import array
import json
import math
import pathlib
import struct
import urllib.parse

_JSON, _BIN = 0x4E4F534A, 0x004E4942
_FLOAT, _UINT32 = 5126, 5125
_MEDIA_TYPES = {".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg", ".webp": "image/webp"}


def _glb(document, binary):
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<II", len(text), _JSON) + text + struct.pack("<II", len(binary), _BIN) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def packed(gltf, note=""):
    """The .gltf file and all that it names as one GLB. Files with different notes are different files that look alike."""
    folder = pathlib.Path(gltf).parent
    document = json.loads(pathlib.Path(gltf).read_text())
    document["asset"]["copyright"] = note
    binary = bytearray()

    def append(uri):
        binary.extend(b"\0" * (-len(binary) % 4))
        at = len(binary)
        binary.extend((folder / urllib.parse.unquote(uri)).read_bytes())
        return at

    starts = [append(buffer["uri"]) for buffer in document["buffers"]]
    for view in document["bufferViews"]:
        view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
        view["buffer"] = 0
    for image in document.get("images", []):
        uri = image.pop("uri")
        at = append(uri)
        image["mimeType"] = _MEDIA_TYPES[pathlib.Path(uri).suffix]
        image["bufferView"] = len(document["bufferViews"])
        document["bufferViews"].append({"buffer": 0, "byteOffset": at, "byteLength": len(binary) - at})
    document["buffers"] = [{"byteLength": len(binary)}]
    return _glb(document, bytes(binary))


def terrain(size, meshes=4):
    """A GLB of about `size` bytes: tiles of a hilly ground side by side, with positions, normals and texture coordinates
    as floats, and indices of 32 bits."""
    # A vertex of a grid is of 32 bytes, and two triangles of 12 each.
    side = math.isqrt(size // meshes // 56)
    binary = bytearray()
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(meshes))}],
        "nodes": [{"mesh": i} for i in range(meshes)],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.6, 0.4, 1], "metallicFactor": 0}}],
        "meshes": [], "accessors": [], "bufferViews": [],
    }

    def add(values, component, kind, width, **bounds):
        document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(binary), "byteLength": len(values) * values.itemsize}
        )
        document["accessors"].append(
            {"bufferView": len(document["bufferViews"]) - 1, "componentType": component, "type": kind,
             "count": len(values) // width, **bounds}
        )
        binary.extend(values.tobytes())
        return len(document["accessors"]) - 1

    indices = array.array("I")
    for row in range(side - 1):
        for a in range(row * side, row * side + side - 1):
            indices.extend((a, a + side, a + 1, a + 1, a + side, a + side + 1))
    step = 1 / (side - 1)
    uvs = array.array("f")
    for row in range(side):
        for column in range(side):
            uvs.extend((column * step, row * step))
    for mesh in range(meshes):
        # y = A sin(f x) cos(f z): separable, so that a row or a column takes two numbers.
        left, frequency, height = mesh - meshes / 2, 9.0 + 2 * mesh, 0.06
        xs = [left + i * step for i in range(side)]
        zs = [i * step - 0.5 for i in range(side)]
        sines = [(math.sin(frequency * x), math.cos(frequency * x)) for x in xs]
        positions, normals = array.array("f"), array.array("f")
        for z in zs:
            sine, cosine = math.sin(frequency * z), math.cos(frequency * z)
            for x, (sine_x, cosine_x) in zip(xs, sines):
                slope_x, slope_z = height * frequency * cosine_x * cosine, -height * frequency * sine_x * sine
                length = math.sqrt(1 + slope_x * slope_x + slope_z * slope_z)
                positions.extend((x, height * sine_x * cosine, z))
                normals.extend((-slope_x / length, 1 / length, -slope_z / length))
        bounds = {
            "min": [min(positions[axis::3]) for axis in range(3)],
            "max": [max(positions[axis::3]) for axis in range(3)],
        }
        attributes = {
            "POSITION": add(positions, _FLOAT, "VEC3", 3, **bounds),
            "NORMAL": add(normals, _FLOAT, "VEC3", 3),
            "TEXCOORD_0": add(uvs, _FLOAT, "VEC2", 2),
        }
        triangles = add(indices, _UINT32, "SCALAR", 1)
        document["meshes"].append(
            {"primitives": [{"attributes": attributes, "indices": triangles, "material": 0}]}
        )
    document["buffers"] = [{"byteLength": len(binary)}]
    return _glb(document, bytes(binary))
