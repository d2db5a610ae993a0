"""Meshes as grids of points: profiles that are turned, sections that are swept, slabs. A mesh is a dict of lists:
points, normals, uvs, colors (or none) and indices."""

import math

TURN = 2 * math.pi


def mix(a, b, t):
    return [p + (q - p) * t for p, q in zip(a, b)]


def step(low, high, x):
    """0 below low, 1 above high, smooth between them."""
    t = min(max((x - low) / (high - low), 0), 1)
    return t * t * (3 - 2 * t)


def unit(v):
    norm = math.hypot(*v) or 1
    return [c / norm for c in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def curve(points, steps):
    """A Catmull-Rom spline through the points, each of any number of coordinates."""
    ends = [mix(points[1], points[0], 2), *points, mix(points[-2], points[-1], 2)]
    out = []
    for a, b, c, d in zip(ends, ends[1:], ends[2:], ends[3:]):
        for k in range(steps):
            t = k / steps
            out.append([
                q + t / 2 * (r - p + t * (2 * p - 5 * q + 4 * r - s + t * (3 * (q - r) + s - p)))
                for p, q, r, s in zip(a, b, c, d)
            ])
    return [*out, list(points[-1])]


def mesh(rows, uvs=None, colors=None):
    """Rows of points, as many in each. Seen from outside, the next row lies below, the next point to the right."""
    high, wide = len(rows), len(rows[0])
    points = [p for row in rows for p in row]
    if uvs is None:
        uvs = [(x / (wide - 1), y / (high - 1)) for y in range(high) for x in range(wide)]
    indices, sums = [], {}

    def key(p):
        return tuple(round(c * 1e6) for c in p)

    for a in (y * wide + x for y in range(high - 1) for x in range(wide - 1)):
        for i, j, k in ((a, a + wide, a + wide + 1), (a, a + wide + 1, a + 1)):
            p, q, r = points[i], points[j], points[k]
            area = cross([b - c for b, c in zip(q, p)], [b - c for b, c in zip(r, p)])
            if math.hypot(*area) < 1e-13:
                continue
            indices += (i, j, k)
            for corner in {key(p), key(q), key(r)}:
                sums[corner] = [s + c for s, c in zip(sums.get(corner, (0, 0, 0)), area)]
    normals = [unit(sums.get(key(p), (0, 1, 0))) for p in points]
    return {"points": points, "normals": normals, "uvs": uvs, "colors": colors, "indices": indices}


def turned(profile, sides=96, top=0.0, bottom=1.0):
    """A profile of (radius, height), from above down on the outside, turned around y; v by its length."""
    lengths = [0]
    for p, q in zip(profile, profile[1:]):
        lengths.append(lengths[-1] + math.dist(p, q))
    angles = [TURN * (k % sides) / sides for k in range(sides + 1)]
    rows = [[(r * math.sin(a), y, r * math.cos(a)) for a in angles] for r, y in profile]
    uvs = [(k / sides, top + (bottom - top) * s / lengths[-1]) for s in lengths for k in range(sides + 1)]
    return mesh(rows, uvs)


def swept(path, side, stations, sides=40, bump=lambda t, angle: 1, down=1.0):
    """Ellipses around a path in the plane that `side` stands on: (where on it from 0 to 1, radius in the plane, radius
    along `side`), in the order in which the surface goes down; it may go back along the path."""
    rows = []
    for t, wide, deep in stations:
        at = t * (len(path) - 1)
        i = min(int(at), len(path) - 2)
        ahead = unit([b - a for a, b in zip(path[max(i - 1, 0)], path[min(i + 2, len(path) - 1)])])
        out, here = cross(ahead, side), mix(path[i], path[i + 1], at - i)
        angles = [TURN * (k % sides) / sides for k in range(sides + 1)]
        rows.append([
            [c + bump(t, a) * (o * wide * math.cos(a) + s * deep * math.sin(a)) for c, o, s in zip(here, out, side)]
            for a in angles
        ])
    high = len(rows) - 1
    return mesh(rows, [(k / sides, down * y / high) for y in range(high + 1) for k in range(sides + 1)])


def slab(width, depth, height, corner, bevel, steps=8):
    """A board with round corners and edges; the texture lies on its top and runs on down the sides."""
    def ring(inset, y, down):
        for x, z, first in ((1, 1, 0), (1, -1, 1), (-1, -1, 2), (-1, 1, 3)):
            for k in range(steps + 1):
                a = TURN / 4 * (first + k / steps)
                out = math.sin(a), math.cos(a)
                px = x * (width / 2 - corner) + out[0] * (corner - inset)
                pz = z * (depth / 2 - corner) + out[1] * (corner - inset)
                yield (px, y, pz), ((px + out[0] * down) / width + 0.5, (pz + out[1] * down) / depth + 0.5)

    angles = [TURN / 4 * k / steps for k in range(steps + 1)]
    arc = [(bevel * (1 - math.sin(a)), bevel * (1 - math.cos(a))) for a in angles]
    levels = [(inset, height - drop, drop) for inset, drop in arc]
    levels += [(inset, drop, height - drop) for inset, drop in reversed(arc)]
    rows = [list(ring(*level)) for level in levels]
    rows = [[((0, height, 0), (0.5, 0.5))] * len(rows[0]), *rows, [((0, 0, 0), (0.5, 0.5))] * len(rows[0])]
    rows = [[*row, row[0]] for row in rows]
    return mesh([[p for p, _ in row] for row in rows], [uv for row in rows for _, uv in row])
