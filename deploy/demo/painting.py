"""Textures as PNG files, from functions that say what is where."""

import math
import random
import struct
import zlib

from shapes import unit


class Noise:
    """Smooth values from 0 to 1 at (u, v), repeating at whole numbers, `across` by `down` of them in between."""

    def __init__(self, seed, across, down):
        rng = random.Random(seed)
        self.across, self.down = across, down
        self.rows = [[rng.random() for _ in range(across)] for _ in range(down)]

    def __call__(self, u, v):
        x, y = u * self.across, v * self.down
        i, j = math.floor(x), math.floor(y)
        x, y = x - i, y - j
        x, y = x * x * (3 - 2 * x), y * y * (3 - 2 * y)
        low, high = self.rows[j % self.down], self.rows[(j + 1) % self.down]
        i, k = i % self.across, (i + 1) % self.across
        top = low[i] + (low[k] - low[i]) * x
        return top + (high[i] + (high[k] - high[i]) * x - top) * y


def png(width, height, pixel):
    """An image of what pixel(x, y) gives: a list of red, green and blue from 0 to 255."""
    data = bytearray()
    for y in range(height):
        row = bytes(min(max(int(c + 0.5), 0), 255) for x in range(width) for c in pixel(x, y))
        data += b"\1" + row[:3] + bytes((a - b) & 255 for a, b in zip(row[3:], row))  # each less the one left of it

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data, 9)) + chunk(b"IEND", b"")


def normal_map(heights, strength):
    """What the slopes of the heights, in pixels, do to the normal."""
    high, wide = len(heights), len(heights[0])

    def pixel(x, y):
        row = heights[y]
        normal = unit([
            (row[x - 1] - row[(x + 1) % wide]) * strength,
            (heights[(y + 1) % high][x] - heights[y - 1][x]) * strength,
            1,
        ])
        return [127.5 + 127.5 * c for c in normal]

    return png(wide, high, pixel)


def table(width, height, value):
    return [[value((x + 0.5) / width, (y + 0.5) / height) for x in range(width)] for y in range(height)]
