"""Scene and job documents that several tests send."""

SPHERE = {
    "lights": [{"type": "ambient", "radiance": [1, 1, 1]}],
    "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
}
SMALL_JOB = {"scene": SPHERE, "image": {"width": 16, "height": 16}}


def endless_job(tile_size=4):
    """Takes far longer than any test waits; a row of its pixels is done in a moment."""
    image = {"width": 16, "height": 16000}
    return {"scene": SPHERE, "image": image, "settings": {"samples": 4000, "tile_size": tile_size}}


# A unit of work without an end, unless it is done in steps.
ENDLESS_PIXEL = {"scene": SPHERE, "image": {"width": 1, "height": 1}, "settings": {"samples": 2**32 - 1}}


def keep_busy(daemon):
    """A job beside which one of low priority waits: with one thread, for 2 s."""
    busy = daemon.submit({**ENDLESS_PIXEL, "priority": "high"})
    daemon.wait_until(busy, lambda status: status["state"] == "rendering")
    return busy


def grid_of_spheres(side):
    """side³ spheres: a scene whose structure takes a while to build."""
    centers = ([x * 3, y * 3, z * 3] for x in range(side) for y in range(side) for z in range(side))
    return {"objects": [{"type": "sphere", "center": center, "radius": 1} for center in centers]}
