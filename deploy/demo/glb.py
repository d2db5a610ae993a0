"""Writes a glTF file whose nodes are all children of one."""

import json
import math
import struct


def turn_about_y(degrees):
    half = math.radians(degrees) / 2
    return [0, math.sin(half), 0, math.cos(half)]


def single(number):
    """It as the file's floats have it."""
    return struct.unpack("<f", struct.pack("<f", number))[0]


class Asset:
    """What is written so far: glTF's JSON, and the bytes that it refers to."""

    def __init__(self):
        self.bytes = bytearray()
        self.json = {"asset": {"version": "2.0", "generator": "Tessera's demo"}, "scene": 0, "buffers": [{}]}
        self.add("scenes", {"nodes": [0]})
        self.add("nodes", {"name": "tea set", "rotation": turn_about_y(30), "children": []})

    def add(self, kind, item):
        self.json.setdefault(kind, []).append(item)
        return len(self.json[kind]) - 1

    def view(self, data, **more):
        self.bytes += bytes(-len(self.bytes) % 4)
        self.bytes += data
        where = {"buffer": 0, "byteOffset": len(self.bytes) - len(data), "byteLength": len(data)}
        return self.add("bufferViews", {**where, **more})

    def accessor(self, rows, kind, **more):
        flat = [c for row in rows for c in row]
        view = self.view(struct.pack(f"<{len(flat)}f", *flat), target=34962)
        numbers = {"bufferView": view, "componentType": 5126, "count": len(rows), "type": kind}
        return self.add("accessors", {**numbers, **more})

    def texture(self, image):
        source = self.add("images", {"bufferView": self.view(image), "mimeType": "image/png"})
        return {"index": self.add("textures", {"source": source})}

    def material(self, name, pbr, extensions=None, **more):
        item = {"name": name, "pbrMetallicRoughness": {"metallicFactor": 0, **pbr}, **more}
        if extensions:
            item["extensions"] = {f"KHR_materials_{key}": value for key, value in extensions.items()}
        return self.add("materials", item)

    def mesh(self, name, shape, material):
        points = shape["points"]
        bounds = {"min": [single(min(c)) for c in zip(*points)], "max": [single(max(c)) for c in zip(*points)]}
        attributes = {
            "POSITION": self.accessor(points, "VEC3", **bounds),
            "NORMAL": self.accessor(shape["normals"], "VEC3"),
            "TEXCOORD_0": self.accessor(shape["uvs"], "VEC2"),
        }
        if shape["colors"]:
            attributes["COLOR_0"] = self.accessor(shape["colors"], "VEC3")
        view = self.view(struct.pack(f"<{len(shape['indices'])}I", *shape["indices"]), target=34963)
        indices = {"bufferView": view, "componentType": 5125, "count": len(shape["indices"]), "type": "SCALAR"}
        primitive = {"attributes": attributes, "indices": self.add("accessors", indices), "material": material}
        return self.add("meshes", {"name": name, "primitives": [primitive]})

    def node(self, name, mesh_index, at=(0, 0, 0), degrees=0):
        placed = {"translation": at, "rotation": turn_about_y(degrees)}
        node = self.add("nodes", {"name": name, "mesh": mesh_index, **placed})
        self.json["nodes"][0]["children"].append(node)

    def glb(self):
        used = {key for item in self.json["materials"] for key in item.get("extensions", {})}
        self.json["extensionsUsed"] = sorted(used | {"KHR_texture_transform"})
        self.json["buffers"][0]["byteLength"] = len(self.bytes)
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        self.bytes += bytes(-len(self.bytes) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(self.bytes), b"BIN\0") + self.bytes
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
