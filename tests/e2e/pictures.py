"""Decodes what the daemon sends, with nothing but zlib."""

import array
import struct
import sys
import zlib


class Picture:
    """Rows of samples, of 8 or 16 bits or floats, side by side; from the top."""

    def __init__(self, width, height, channels, depth, samples):
        self.width, self.height, self.channels, self.depth, self.samples = width, height, channels, depth, samples

    def at(self, x, y):
        first = (y * self.width + x) * self.channels
        pixel = tuple(self.samples[first : first + self.channels])
        return pixel if self.channels > 1 else pixel[0]

    def rows(self):
        return [[self.at(x, y) for x in range(self.width)] for y in range(self.height)]

    def pixels(self):
        return zip(*(self.samples[channel :: self.channels] for channel in range(self.channels)))


def decode_png(file):
    assert file.startswith(b"\x89PNG\r\n\x1a\n"), file[:100]
    at, data = 8, b""
    while at < len(file):
        size, kind = struct.unpack(">I4s", file[at : at + 8])
        chunk = file[at + 8 : at + 8 + size]
        assert struct.unpack(">I", file[at + 8 + size : at + 12 + size])[0] == zlib.crc32(kind + chunk)
        at += 12 + size
        if kind == b"IHDR":
            width, height, depth, color, *how = struct.unpack(">IIBBBBB", chunk)
            assert depth in (8, 16) and how == [0, 0, 0], (depth, how)
            channels = {0: 1, 2: 3, 4: 2, 6: 4}[color]
        if kind == b"IDAT":
            data += chunk
    data = zlib.decompress(data)
    pixel = channels * depth // 8
    stride = width * pixel
    assert len(data) == height * (stride + 1)
    rows, above = bytearray(), bytes(stride)
    for y in range(height):
        kind, row = data[y * (stride + 1)], bytearray(data[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        if kind == 2:
            row = bytearray((a + b) & 255 for a, b in zip(row, above))
        elif kind > 0:
            for i in range(stride):
                left, up = (row[i - pixel] if i >= pixel else 0), above[i]
                corner = above[i - pixel] if i >= pixel else 0
                if kind == 4:
                    guess = min((left, up, corner), key=lambda v, p=left + up - corner: abs(p - v))
                else:
                    guess = left if kind == 1 else (left + up) // 2
                row[i] = (row[i] + guess) & 255
        rows += row
        above = bytes(row)
    if depth == 8:
        return Picture(width, height, channels, depth, rows)
    words = array.array("H", bytes(rows))
    if sys.byteorder == "little":
        words.byteswap()
    return Picture(width, height, channels, depth, words)


def decode_tiff(file):
    """One channel, not compressed, in one strip."""
    order = {b"II": "<", b"MM": ">"}[file[:2]]
    assert struct.unpack(order + "HI", file[2:8]) == (42, 8)
    fields = {}
    for i in range(struct.unpack(order + "H", file[8:10])[0]):
        tag, kind, count = struct.unpack(order + "HHI", file[10 + 12 * i : 18 + 12 * i])
        assert count == 1
        layout = {3: order + "Hxx", 4: order + "I", 5: order + "I"}[kind]
        fields[tag] = struct.unpack(layout, file[18 + 12 * i : 22 + 12 * i])[0]
    assert list(fields) == sorted(fields)
    assert (fields[259], fields[262], fields[274], fields[277]) == (1, 1, 1, 1), fields
    width, height, depth, kind = fields[256], fields[257], fields[258], fields[339]
    assert (depth, kind) in ((32, 3), (16, 1)), fields
    assert fields[278] == height and fields[279] == width * height * depth // 8
    samples = array.array("f" if depth == 32 else "H", file[fields[273] : fields[273] + fields[279]])
    if order != ("<" if sys.byteorder == "little" else ">"):
        samples.byteswap()
    return Picture(width, height, 1, depth, samples)
