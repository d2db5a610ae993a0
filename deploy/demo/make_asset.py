#!/usr/bin/env python3
"""Makes demo.glb, a tea set for one shop's page: one self-contained glTF file, the same bytes every time.

Usage: make_asset.py FILE

A stoneware pot in a running glaze under a cane handle, two glasses of tea, a spoon and a linen cloth on an oak board.
Shapes are grids of points: profiles that are turned, sections that are swept, and sheets. Lengths are metres; x goes
to the right, y up and z to the viewer.
"""

import math
import pathlib
import random
import sys

from glb import Asset
from painting import Noise, normal_map, png, table
from shapes import TURN, curve, mesh, mix, slab, step, swept, turned


def glaze_textures(width=640, height=320):
    """Glaze that ran down over stoneware: colour; roughness, with the coat in red; normals. Above is the rim."""
    broad, cloud, fine, grain = Noise(1, 6, 3), Noise(2, 24, 12), Noise(3, 96, 48), Noise(4, 384, 192)
    runs, drops, rings = Noise(5, 14, 1), Noise(6, 37, 1), Noise(7, 2, 30)

    def glaze_depth(u, v):
        """How far above its lower edge, in shares of the height; what is below 0 is bare."""
        run = 0.07 * runs(u, 0) ** 2 + 0.03 * drops(u, 0) + 0.008 * cloud(u, v)
        return 0.46 + run - v

    depths = table(width, height, glaze_depth)

    def color(x, y):
        u, v, depth = (x + 0.5) / width, (y + 0.5) / height, depths[y][x]
        speck = grain(u, v)
        if depth < 0:
            clay = mix([168, 128, 92], [196, 158, 120], 0.6 * cloud(u, v) + 0.4 * fine(u, v))
            return mix(clay, [84, 54, 36], step(0.86, 0.95, speck))
        deep = mix([8, 58, 70], [26, 104, 108], 0.5 * broad(u, v) + 0.3 * cloud(u, v) + 0.2 * fine(u, v))
        thin = max(step(0.05, 0.0, depth), step(0.035, 0.0, v + 0.01 * cloud(u, v)))
        glaze = mix(deep, [138, 84, 42], 0.85 * thin)
        pool = step(0.02, 0.06, depth) * step(0.14, 0.07, depth)
        glaze = mix(glaze, [120, 176, 164], 0.45 * pool * (0.4 + 0.6 * fine(u, v)))
        return mix(glaze, [188, 206, 190], 0.55 * step(0.9, 0.97, speck))

    def surface(x, y):
        glazed = step(0, 0.004, depths[y][x])
        return [255 * glazed, 255 * (0.86 - 0.5 * glazed), 0]

    def relief(u, v):
        depth = glaze_depth(u, v)
        turned = 0.7 * rings(u, v)
        rough = 0.5 * grain(u, v) + 0.6 * fine(u, v) if depth < 0 else 0.5 * cloud(u, v)
        return turned + rough + 4 * step(0, 0.025, depth)

    heights = table(width, height, relief)
    return png(width, height, color), png(width, height, surface), normal_map(heights, 0.4)


def oak_textures(width=640, height=384, staves=5):
    """Staves of oak, glued side by side: colour, and normals. The grain goes along u."""
    figure, fibre, pore = Noise(11, 4, 24), Noise(12, 10, 160), Noise(13, 48, 256)
    rng = random.Random(14)
    tones = [(rng.uniform(-0.25, 0.25), rng.random(), rng.uniform(0.8, 1.3)) for _ in range(staves)]

    def grain(u, v):
        tone, shift, squeeze = tones[min(int(v * staves), staves - 1)]
        rings = math.sin(TURN * (9 * squeeze * v * 2 + 2.2 * figure(u + shift, v)))
        lines = 0.5 + 0.32 * rings + 0.5 * (fibre(u + shift, v) - 0.5)
        pores = step(0.72, 0.9, pore(u + shift, v))
        return tone, lines, pores

    def joint(v):
        return abs((v * staves + 0.5) % 1 - 0.5) / staves * height

    def color(x, y):
        tone, lines, pores = grain((x + 0.5) / width, (y + 0.5) / height)
        wood = mix([176, 126, 80], [226, 184, 132], min(max(lines + tone, 0), 1))
        wood = mix(wood, [120, 78, 46], 0.5 * pores)
        return mix([84, 54, 32], wood, 0.35 + 0.65 * step(0.3, 1.6, joint((y + 0.5) / height)))

    def relief(u, v):
        _, lines, pores = grain(u, v)
        return 0.3 * lines - 0.8 * pores

    return png(width, height, color), normal_map(table(width, height, relief), 0.35)


def linen_textures(size=128, threads=8):
    """A piece of plain weave that repeats: colour and normals."""
    slub = Noise(21, threads, threads), Noise(22, threads * 6, threads), Noise(23, threads, threads * 6)

    def thread(u, v):
        """Which way the upper thread goes, and how high it is."""
        i, j = math.floor(u * threads), math.floor(v * threads)
        x, y = u * threads - i - 0.5, v * threads - j - 0.5
        along, across = (x, y) if (i + j) % 2 else (y, x)
        return (i + j) % 2, math.sqrt(max(1 - 3.4 * across * across, 0)) * (1 - 1.6 * along * along)

    def color(x, y):
        u, v = (x + 0.5) / size, (y + 0.5) / size
        way, height = thread(u, v)
        shade = 0.6 + 0.3 * height + 0.12 * slub[0](u, v) + 0.08 * slub[1 if way else 2](u, v)
        return [235 * shade, 226 * shade, 208 * shade]

    return png(size, size, color), normal_map(table(size, size, lambda u, v: thread(u, v)[1]), 1.6)


def pot_body():
    return turned(curve([
        (0.030, 0.094), (0.031, 0.1005), (0.0335, 0.102), (0.036, 0.1005), (0.039, 0.0975), (0.052, 0.091),
        (0.068, 0.075), (0.0755, 0.054), (0.0725, 0.034), (0.061, 0.016), (0.049, 0.0055), (0.0465, 0.003),
        (0.0455, 0.0006), (0.043, 0), (0.040, 0.0012), (0.039, 0.004), (0.0, 0.005),
    ], 7), 144)


def pot_lid():
    return turned(curve([
        (0.0, 0.1335), (0.006, 0.133), (0.0105, 0.1295), (0.0112, 0.1255), (0.0085, 0.121), (0.0065, 0.117),
        (0.0085, 0.1135), (0.016, 0.111), (0.026, 0.1068), (0.0300, 0.1035), (0.0302, 0.1015), (0.0295, 0.099),
        (0.0, 0.098),
    ], 7), 96, 0.0, 0.4)


def pot_spout():
    """From inside of its mouth over the lip and down to the belly."""
    path = curve([(0.1165, 0.1085, 0), (0.107, 0.099, 0), (0.0955, 0.080, 0), (0.082, 0.061, 0), (0.055, 0.047, 0)], 12)
    stations = [(0.5, 0.0095, 0.0095), (0.2, 0.0065, 0.0065), (0.04, 0.0056, 0.0056), (0.005, 0.0062, 0.0062)]
    stations += [(0, 0.0070, 0.0070), (0.004, 0.0078, 0.0078), (0.02, 0.0080, 0.0080), (0.12, 0.0083, 0.0083)]
    stations += [(0.3, 0.0105, 0.0105), (0.5, 0.0145, 0.0145), (0.7, 0.0195, 0.020)]
    stations += [(0.85, 0.023, 0.025), (1, 0.025, 0.028)]
    return swept(path, (0, 0, 1), curve(stations, 6), 56, down=0.42)


def pot_lug(x):
    path = [(x + 0.0082 * math.cos(a), 0.0905, 0.0082 * math.sin(a)) for a in (TURN * k / 48 for k in range(49))]
    return swept(path, (0, 1, 0), [(k / 48, 0.0032, 0.0036) for k in range(49)], 20, down=0.4)


def pot_handle(wraps=64):
    half = [(-0.0615, 0.082, 0), (-0.0635, 0.092, 0), (-0.067, 0.118, 0), (-0.063, 0.150, 0), (-0.040, 0.180, 0)]
    path = curve([*half, (0, 0.192, 0), *((-x, y, z) for x, y, z in reversed(half))], 24)
    ends = [(0, 0.0), (0.001, 0.0025), (0.004, 0.0042), (0.008, 0.0046)]
    rows = wraps * 5
    along = [0.01 + 0.98 * k / rows for k in range(rows + 1)]
    stations = ends + [(t, 0.0046 + 0.0012 * step(0.1, 0.35, min(t, 1 - t))) for t in along]
    stations += [(1 - t, r) for t, r in reversed(ends)]

    def wrap(t, angle):
        return abs(math.sin(math.pi * (t * wraps + angle / TURN)))

    def bump(t, angle):
        return 0.9 + 0.12 * wrap(t, angle) ** 0.6

    out = swept(path, (0, 0, 1), [(t, r, r) for t, r in stations], 24, bump)
    out["colors"] = [3 * [0.35 + 0.65 * wrap(t, TURN * k / 24) ** 0.8] for t, _ in stations for k in range(25)]
    return out


def inside_glass(y):
    return 0.0245 + 0.0095 * (y / 0.074) ** 0.8


def tea_glass():
    wall = [(inside_glass(y), y) for y in (0.018, 0.03, 0.045, 0.06, 0.072)]
    inner = [(0, 0.0085), (0.016, 0.0088), (0.0225, 0.0115), *wall]
    rim = [(0.0342, 0.0738), (0.0351, 0.0742), (0.0358, 0.0736)]
    outer = [*((r + 0.0018, y) for r, y in reversed(wall)), (0.0262, 0.006), (0.024, 0.0015)]
    return turned(curve([*inner, *rim, *outer, (0.0215, 0.0), (0.019, 0.0006), (0.010, 0.0018), (0, 0.002)], 6), 128)


def tea(level=0.056):
    wall = [(inside_glass(y) - 0.0003, y) for y in (level + 0.001, level - 0.002, 0.045, 0.03, 0.018)]
    top = [(0, level), (0.026, level), (wall[0][0] - 0.0022, level + 0.0001), (wall[0][0] - 0.0006, level + 0.0005)]
    return turned(curve([*top, *wall, (0.0221, 0.0119), (0.016, 0.0092), (0, 0.0089)], 6), 128)


def spoon():
    """From the bowl's tip to the handle's end: (along, half the width, height, half the thickness, hollow)."""
    shape = curve([
        (0.0, 0.0001, 0.0040, 0.0001, 0.000), (0.0012, 0.0048, 0.0036, 0.0006, 0.0006),
        (0.006, 0.0098, 0.0022, 0.0007, 0.003), (0.017, 0.0130, 0.0012, 0.0007, 0.0048),
        (0.030, 0.0098, 0.0026, 0.0008, 0.0034), (0.038, 0.0040, 0.0062, 0.0011, 0.0008),
        (0.046, 0.0023, 0.0092, 0.0014, 0.0), (0.070, 0.0024, 0.0105, 0.0013, 0.0),
        (0.100, 0.0036, 0.0068, 0.0011, 0.0), (0.122, 0.0056, 0.0024, 0.0010, 0.0), (0.129, 0.0046, 0.0018, 0.0009, 0.0),
        (0.1315, 0.0018, 0.0017, 0.0006, 0.0), (0.132, 0.0001, 0.0017, 0.0001, 0.0),
    ], 7)
    angles = [TURN * (k % 40) / 40 for k in range(41)]
    return mesh([
        [(w * math.cos(a), y + thick * math.sin(a) + hollow * math.cos(a) ** 2, z) for a in angles]
        for z, w, y, thick, hollow in shape
    ])


def cloth(size=0.30, points=120):
    """Linen that lies under the board, with soft folds where it comes out."""
    fold, wave = Noise(31, 5, 5), Noise(32, 9, 9)
    rows, colors = [], []
    for j in range(points + 1):
        for i in range(points + 1):
            u, v = i / points, j / points
            edge = min(u, v, 1 - u, 1 - v) * size
            x, z = (u - 0.5) * size, (v - 0.5) * size
            loose = step(0.115, 0.15, max(abs(x), abs(z)))
            y = 0.0012 + loose * (0.010 * fold(u, v) ** 2 + 0.004 * wave(u, v)) + 0.0008 * step(0.0085, 0.0065, edge)
            x += 0.012 * (fold(v, u) - 0.5) * loose
            z += 0.012 * (wave(v, u) - 0.5) * loose
            rows.append((x, y * step(-0.0005, 0.0012, edge) if edge > 0 else 0, z))
            striped = any(low < edge < high for low, high in ((0.022, 0.028), (0.031, 0.033), (0.019, 0.020)))
            colors.append([0.09, 0.25, 0.27] if striped else [1, 1, 1])
    grid = [rows[j * (points + 1):(j + 1) * (points + 1)] for j in range(points + 1)]
    return mesh(grid, None, colors)


def tea_set():
    asset = Asset()
    colors, surface, relief = map(asset.texture, glaze_textures())
    glazed = asset.material("glazed stoneware", {"baseColorTexture": colors, "metallicRoughnessTexture": surface}, {
        "clearcoat": {"clearcoatFactor": 1, "clearcoatTexture": surface, "clearcoatRoughnessFactor": 0.06},
    }, normalTexture=relief)
    colors, relief = map(asset.texture, oak_textures())
    oak = asset.material("oiled oak", {"baseColorTexture": colors, "roughnessFactor": 0.5}, normalTexture=relief)
    weave = {"extensions": {"KHR_texture_transform": {"scale": [25, 25]}}}
    colors, relief = ({**asset.texture(image), **weave} for image in linen_textures())
    linen = asset.material("linen", {"baseColorTexture": colors, "roughnessFactor": 0.9}, {
        "sheen": {"sheenColorFactor": [0.25, 0.24, 0.22], "sheenRoughnessFactor": 0.5},
    }, normalTexture=relief, doubleSided=True)
    cane = asset.material("cane", {"baseColorFactor": [0.52, 0.29, 0.12, 1], "roughnessFactor": 0.45})
    brass = asset.material("brass", {
        "baseColorFactor": [0.90, 0.68, 0.36, 1], "metallicFactor": 1, "roughnessFactor": 0.22,
    })
    clear = asset.material("glass", {"roughnessFactor": 0}, {
        "transmission": {"transmissionFactor": 1}, "volume": {"thicknessFactor": 0.002}, "ior": {"ior": 1.5},
    })
    amber = asset.material("tea", {"roughnessFactor": 0}, {
        "transmission": {"transmissionFactor": 1}, "ior": {"ior": 1.33},
        "volume": {"thicknessFactor": 0.06, "attenuationDistance": 0.03, "attenuationColor": [0.92, 0.50, 0.10]},
    })

    board = 0.0225
    asset.node("board", asset.mesh("board", slab(0.36, 0.215, 0.018, 0.016, 0.0035), oak), (0, 0.0045, 0), 8)
    asset.node("cloth", asset.mesh("cloth", cloth(), linen), (-0.075, 0, 0.055), 30)
    pot = (-0.055, board, -0.012)
    for name, shape, material in (
        ("pot", pot_body(), glazed), ("lid", pot_lid(), glazed), ("spout", pot_spout(), glazed),
        ("left lug", pot_lug(-0.062), glazed), ("right lug", pot_lug(0.062), glazed), ("handle", pot_handle(), cane),
    ):
        asset.node(name, asset.mesh(name, shape, material), pot, -12)
    cup, drink = asset.mesh("glass", tea_glass(), clear), asset.mesh("tea", tea(), amber)
    for number, at in enumerate(((0.085, board, 0.045), (0.128, board, -0.045))):
        asset.node(f"glass {number + 1}", cup, at)
        asset.node(f"tea {number + 1}", drink, at)
    asset.node("spoon", asset.mesh("spoon", spoon(), brass), (-0.122, 0.0016, 0.143), 80)
    return asset.glb()


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    pathlib.Path(sys.argv[1]).write_bytes(tea_set())


if __name__ == "__main__":
    main()
