"""Models that cost more than they weigh: textures that are mostly nothing, instances by the thousand."""

import json
import struct
import zlib

_POSITIONS = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
_TEXTURE_COORDINATES = struct.pack("<6f", 0, 0, 1, 0, 0, 1)


def _glb(document, binary):
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def black_png(side):
    """RGB, 8 bits: a thousandth of its size when it is decoded."""

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    rows = zlib.compressobj(9)
    row = bytes(1 + 3 * side)
    content = b"".join(rows.compress(row) for _ in range(side)) + rows.flush()
    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", content) + chunk(b"IEND", b"")


def triangles(nodes, texture=None, note=""):
    """A triangle wherever a node says, with a texture if there is one. Others with another note."""
    binary = _POSITIONS + _TEXTURE_COORDINATES
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": len(_POSITIONS)},
             {"buffer": 0, "byteOffset": len(_POSITIONS), "byteLength": len(_TEXTURE_COORDINATES)}]  # fmt: skip
    document = {
        "asset": {"version": "2.0", "copyright": note},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "bufferViews": views,
    }
    if texture:
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(texture)})
        binary += texture
        document["images"] = [{"bufferView": 2, "mimeType": "image/png"}]
        document["textures"] = [{"source": 0}]
        document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
        document["meshes"][0]["primitives"][0]["material"] = 0
    document["buffers"] = [{"byteLength": len(binary)}]
    return _glb(document, binary)
