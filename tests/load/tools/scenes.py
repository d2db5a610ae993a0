"""Documents that parts of the campaign send."""

from documents import SPHERE

FILLED = dict(SPHERE, camera={"type": "perspective", "from": [0, 0, 9], "at": [0, 0, 0], "up": [0, 1, 0], "fov": 2})


MOST_SAMPLES = 1 << 36  # That all pixels of an image may have together.


def heavy_job(side=1024):
    """Every pixel has something to do, for hours."""
    return {
        "scene": FILLED,
        "image": {"width": side, "height": side},
        "settings": {"samples": min(65536, MOST_SAMPLES // side**2), "tile_size": 16},
    }
