#!/usr/bin/env python3
"""Makes the demo scene in a folder: scene.json and the meshes that it names. The same bytes every time.

Usage: make_scene.py FOLDER

A floor of tesserae, the little stones of a mosaic, on an island in an empty sky: every stone is an instance of one
bevelled mesh. Around it columns, an OBJ file with materials of its own, again as instances; on it a mirror, a glass
ball and a golden knot.
"""

import json
import math
import pathlib
import random
import sys

FLOOR_RADIUS = 5.0
STONE = 0.2  # side of a stone, with its share of the joint


def ply(positions, faces, normals=None):
    """An ascii PLY file."""
    head = ["ply", "format ascii 1.0", f"element vertex {len(positions)}"]
    head += [f"property float {name}" for name in ("x", "y", "z", *(("nx", "ny", "nz") if normals else ()))]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    vertices = [(*p, *n) for p, n in zip(positions, normals)] if normals else positions
    body = [" ".join(f"{c:.4f}" for c in vertex) for vertex in vertices]
    body += [f"{len(face)} " + " ".join(map(str, face)) for face in faces]
    return "\n".join(head + body) + "\n"


def bevelled_stone():
    """A unit square stone with its upper edges cut; its underside is never seen."""
    levels = [(0.5, 0.0), (0.5, 0.75), (0.42, 1.0)]
    positions = [(h * x, y, h * z) for h, y in levels for x, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    faces = [
        (low + (i + 1) % 4, low + i, low + 4 + i, low + 4 + (i + 1) % 4) for low in (0, 4) for i in range(4)
    ]
    return positions, faces + [(11, 10, 9, 8)]


def torus_knot(windings=(2, 3), radius=1.0, tube=0.27, along=240, around=24):
    """A tube along a torus knot, swept by the curve's own frame towards the torus's axis."""
    p, q = windings

    def curve(u):
        r = radius * (1 + 0.42 * math.cos(q * u))
        return (r * math.cos(p * u), r * math.sin(p * u), radius * 0.55 * math.sin(q * u))

    positions, faces, normals = [], [], []
    for i in range(along):
        u = 2 * math.pi * i / along
        here, ahead = curve(u), curve(u + 1e-4)
        tangent = unit([b - a for a, b in zip(here, ahead)])
        out = unit(cross(tangent, (math.cos(p * u), math.sin(p * u), 0.3)))
        side = cross(tangent, out)
        for j in range(around):
            v = 2 * math.pi * j / around
            normal = [math.cos(v) * o + math.sin(v) * s for o, s in zip(out, side)]
            positions.append([c + tube * n for c, n in zip(here, normal)])
            normals.append(normal)
            a, b = i * around + j, i * around + (j + 1) % around
            c, d = (a + around) % (along * around), (b + around) % (along * around)
            faces += [(a, d, c), (a, b, d)]
    return positions, faces, normals


def unit(v):
    norm = math.sqrt(sum(c * c for c in v))
    return [c / norm for c in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def column_obj(height=2.6, radius=0.24, flutes=12):
    """A fluted shaft of marble between rings of bronze."""
    lines = ["mtllib column.mtl"]
    count = 0

    def sweep(name, material, profile, radius_at, sides):
        """A surface of rings: (radius's factor, y) from bottom to top, closed above."""
        nonlocal count
        lines.extend([f"g {name}", f"usemtl {material}"])
        first = count + 1
        for factor, y in profile:
            for k in range(sides):
                angle = 2 * math.pi * k / sides
                r = radius_at(angle) * factor
                lines.append(f"v {r * math.cos(angle):.4f} {y:.4f} {r * math.sin(angle):.4f}")
        for level in range(len(profile) - 1):
            for k in range(sides):
                a, b = first + level * sides + k, first + level * sides + (k + 1) % sides
                lines.append(f"f {a} {a + sides} {b + sides} {b}")
        top = first + (len(profile) - 1) * sides
        lines.append("f " + " ".join(str(top + k) for k in reversed(range(sides))))
        count += len(profile) * sides

    def fluted(angle):
        return radius * (1 - 0.1 * abs(math.sin(flutes * angle / 2)))

    sweep("shaft", "marble", [(1.0, 0.2), (0.97, height * 0.6), (0.84, height - 0.2)], fluted, flutes * 8)
    sweep("base", "bronze", [(1.5, 0.0), (1.5, 0.1), (1.3, 0.14), (1.12, 0.22)], lambda _: radius, 48)
    sweep("capital", "bronze", [(0.9, height - 0.22), (1.45, height - 0.06), (1.45, height)], lambda _: radius, 48)
    return "\n".join(lines) + "\n"


COLUMN_MTL = """newmtl marble
Kd 0.86 0.84 0.78
Ks 0.12 0.12 0.12
Ns 30
illum 2

newmtl bronze
Kd 0.30 0.19 0.09
Ks 0.50 0.36 0.20
Ns 60
illum 2
"""


def glazed(colour, roughness):
    return {"type": "metallic_roughness", "base_color": colour, "metallic": 0, "roughness": roughness}


PALETTE = {
    "ivory": [0.78, 0.72, 0.58],
    "sand": [0.66, 0.50, 0.30],
    "terracotta": [0.52, 0.16, 0.08],
    "teal": [0.05, 0.27, 0.29],
    "navy": [0.03, 0.07, 0.19],
}


def materials():
    stones = {name: glazed(colour, 0.35) for name, colour in PALETTE.items()}
    return {
        **stones,
        "mortar": {"type": "diffuse", "color": [0.30, 0.28, 0.25]},
        "rock": {"type": "diffuse", "color": [0.44, 0.33, 0.25]},
        "dark rock": {"type": "diffuse", "color": [0.30, 0.22, 0.18]},
        "mirror": {"type": "conductor", "metal": "silver"},
        "glass": {"type": "dielectric", "ior": 1.5},
        "gold": {"type": "conductor", "metal": "gold", "roughness": 0.35},
        "cypress": {"type": "diffuse", "color": [0.06, 0.14, 0.07]},
        "bark": {"type": "diffuse", "color": [0.16, 0.10, 0.06]},
        "coral": glazed([0.70, 0.14, 0.08], 0.2),
    }


def stone_colour(radius, angle):
    """The mosaic's picture: rings as borders, within them waves that wind around the middle."""
    if radius > 4.55:
        return "navy" if radius > 4.8 else "ivory"
    if radius > 4.3:
        return "terracotta"
    if radius < 0.3:
        return "terracotta"
    phase = (angle * 8 / (2 * math.pi) + 1.1 * math.log(radius) * 1.6) % 1.0
    crest = 0.5 + 0.5 * math.sin(2 * math.pi * phase)
    if crest > 0.86:
        return "ivory"
    if crest > 0.62:
        return "sand"
    return "teal" if crest > 0.30 else "navy"


def stones(rng):
    """Rings of stones around the middle, laid by a hand that isn't quite steady."""
    rings = int(FLOOR_RADIUS / STONE)
    for ring in range(rings):
        radius = (ring + 0.5) * STONE
        count = max(5, round(2 * math.pi * radius / STONE))
        width = 2 * math.pi * radius / count
        for k in range(count):
            angle = 2 * math.pi * (k + 0.5 * (ring % 2)) / count
            yield {
                "type": "instance",
                "of": "stone",
                "material": stone_colour(radius, angle + rng.uniform(-0.02, 0.02)),
                "transform": {
                    "scale": [round(width * 0.9, 4), 0.07, STONE * 0.9],
                    "rotate": {"axis": [0, 1, 0], "degrees": round(90 - math.degrees(angle) + rng.uniform(-3, 3), 2)},
                    "translate": [
                        round(radius * math.cos(angle), 4),
                        round(rng.uniform(-0.02, 0.0), 4),
                        round(radius * math.sin(angle), 4),
                    ],
                },
            }


def island(rng):
    """What carries the floor: a rim, and rock that hangs down in spikes."""

    def spike(x, z, radius, y, below):
        return {
            "type": "cone",
            "base": [round(x, 4), y, round(z, 4)],
            "base_radius": round(radius, 4),
            "apex": [round(x * 0.9, 4), round(below, 4), round(z * 0.9, 4)],
            "apex_radius": 0,
            "material": rng.choice(["rock", "dark rock"]),
        }

    yield {"type": "disk", "center": [0, 0, 0], "normal": [0, 1, 0], "radius": 5.12, "material": "mortar"}
    yield {"type": "cylinder", "base": [0, -0.4, 0], "apex": [0, 0, 0], "radius": 5.12, "material": "rock"}
    yield spike(0, 0, 5.1, -0.4, -3.0)
    for k in range(40):
        angle, radius = k * math.pi * (3 - math.sqrt(5)), 4.1 * math.sqrt((k + 0.5) / 40)
        depth = rng.uniform(1.8, 2.9) + 1.2 * (1 - radius / 4.1)
        yield spike(radius * math.cos(angle), radius * math.sin(angle), rng.uniform(0.5, 0.9), -0.35, -depth)


def colonnade():
    """Columns around the far side, cypresses between them; the near side is open to the eye."""
    for k in range(19):
        angle = math.radians(138 + k * 220 / 18)
        x, z = round(4.2 * math.cos(angle), 4), round(4.2 * math.sin(angle), 4)
        if k % 2 == 0:
            yield {"type": "instance", "of": "column", "transform": {"translate": [x, 0.05, z]}}
            yield {"type": "sphere", "center": [x, 2.83, z], "radius": 0.18, "material": "coral"}
        else:
            yield {"type": "cylinder", "base": [x, 0, z], "apex": [x, 0.3, z], "radius": 0.06, "material": "bark"}
            yield {
                "type": "cone",
                "base": [x, 0.25, z],
                "base_radius": 0.24,
                "apex": [x, 1.5, z],
                "apex_radius": 0,
                "material": "cypress",
            }


def centre():
    """The things that the floor is for."""
    yield {"type": "sphere", "center": [-1.35, 1.25, -0.4], "radius": 1.2, "material": "mirror"}
    yield {"type": "sphere", "center": [1.05, 0.8, 1.65], "radius": 0.75, "material": "glass"}
    yield {
        "type": "instance",
        "of": "knot",
        "material": "gold",
        "transform": {"rotate": {"axis": [0, 1, 0], "degrees": 20}, "translate": [1.5, 1.75, -1.2]},
    }


def scene():
    rng = random.Random(7)
    return {
        "camera": {"type": "perspective", "from": [5.0, 3.9, 12.4], "at": [0, -0.25, 0], "up": [0, 1, 0], "fov": 35},
        "lights": [
            {"type": "sun", "direction": [0.62, -0.8, -0.55], "irradiance": [2.6, 2.3, 1.8], "angle": 4},
            {"type": "environment", "radiance": [0.22, 0.32, 0.5]},
        ],
        "materials": materials(),
        "geometries": {
            "stone": {"type": "file", "path": "stone.ply"},
            "column": {"type": "file", "path": "column.obj"},
            "knot": {"type": "file", "path": "knot.ply"},
        },
        "objects": [*island(rng), *colonnade(), *centre(), *stones(rng)],
    }


def compact(document):
    """JSON with a line for each object, so that the file can be read and its changes compared."""
    lines = []
    for key, value in document.items():
        if isinstance(value, dict):
            rows = [f"{json.dumps(name)}: {json.dumps(item)}" for name, item in value.items()]
            lines.append(f"{json.dumps(key)}: {{\n    " + ",\n    ".join(rows) + "\n  }")
        elif value and isinstance(value[0], dict):
            lines.append(f"{json.dumps(key)}: [\n    " + ",\n    ".join(map(json.dumps, value)) + "\n  ]")
        else:
            lines.append(f"{json.dumps(key)}: {json.dumps(value)}")
    return "{\n  " + ",\n  ".join(lines) + "\n}\n"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "stone.ply").write_text(ply(*bevelled_stone()))
    (folder / "knot.ply").write_text(ply(*torus_knot()))
    (folder / "column.obj").write_text(column_obj())
    (folder / "column.mtl").write_text(COLUMN_MTL)
    (folder / "scene.json").write_text(compact(scene()))


if __name__ == "__main__":
    main()
