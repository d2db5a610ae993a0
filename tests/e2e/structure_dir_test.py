"""Hierarchies of meshes that one daemon has built are another's, from disk, and a damaged file costs no more than time."""

import hashlib
import os
import shutil
import tempfile
import unittest

from daemon import Daemon


def wavy_sheet(n, height):
    """A mesh of 2·n·n triangles."""
    positions = [[x / n, ((7 * x * x + 3 * y) % 11) / 11 * height, y / n] for y in range(n + 1) for x in range(n + 1)]
    triangles = []
    for y in range(n):
        for x in range(n):
            i = y * (n + 1) + x
            triangles += [[i, i + n + 1, i + 1], [i + 1, i + n + 1, i + n + 2]]
    return {"type": "mesh", "positions": positions, "triangles": triangles}


SCENE = {
    "camera": {"type": "perspective", "from": [0.5, 1.5, 2.5], "at": [0.5, 0, 0.5], "fov": 40},
    "lights": [{"type": "point", "position": [2, 3, 2], "intensity": [9, 9, 9]}],
    "geometries": {"sheet": wavy_sheet(70, 0.2), "rough": wavy_sheet(66, 0.5), "unseen": wavy_sheet(65, 0.1)},
    "objects": [
        {"type": "instance", "of": "sheet", "transform": {"translate": [0, 0, 0]}},
        {"type": "instance", "of": "rough", "transform": {"translate": [0.5, 0.2, -0.5]}},
        {"type": "instance", "of": "unseen", "transform": {"translate": [0, 0, 50]}},
    ],
}


class StructureDirTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="tessera-structures-")
        self.addCleanup(shutil.rmtree, self.folder)

    def render(self, daemon):
        """The image's hash, meshes built, meshes loaded and meshes never built."""
        settings = {"accel": {"kind": "wide"}}
        job = daemon.submit({"scene": SCENE, "image": {"width": 60, "height": 40}, "settings": settings})
        self.assertEqual(daemon.wait_ended(job)["state"], "completed")
        image = daemon.request("GET", f"/v1/jobs/{job}/image?format=exr").body
        stats = daemon.request("GET", f"/v1/jobs/{job}/stats").json()
        plan = daemon.request("GET", f"/v1/jobs/{job}/plan").json()
        self.assertIn(("meshes", 3), [(skip["what"], skip["count"]) for skip in plan["skips"]])
        found = stats["structure"]
        self.assertEqual(found["meshes"], 3)
        unseen = stats["skipped"]["meshes_never_built"]
        self.assertEqual(found["meshes_built"] + found["meshes_loaded"] + unseen, found["meshes"])
        return hashlib.sha256(image).hexdigest(), found["meshes_built"], found["meshes_loaded"], unseen

    def daemon(self, *flags):
        daemon = Daemon("--threads", "2", "--structure-dir", self.folder, *flags)
        self.addCleanup(daemon.stop)
        return daemon

    def files(self):
        return sorted(os.path.join(self.folder, name) for name in os.listdir(self.folder))

    def test_a_restart_builds_nothing(self):
        with Daemon("--threads", "2") as plain:
            image, *counts = self.render(plain)
            self.assertEqual(counts, [2, 0, 1])
        first = self.daemon()
        self.assertEqual(self.render(first), (image, 2, 0, 1))
        self.assertEqual(self.render(first), (image, 2, 0, 1), "it is the same structure")
        self.assertEqual(len(self.files()), 2)
        first.stop()
        self.assertEqual(self.render(self.daemon()), (image, 0, 2, 1))

    def test_damaged_files_are_replaced(self):
        first = self.daemon()
        image, *_ = self.render(first)
        first.stop()
        one, other = self.files()
        with open(one, "r+b") as file:
            file.seek(1000)
            byte = file.read(1)
            file.seek(1000)
            file.write(bytes([byte[0] ^ 1]))
        os.truncate(other, os.path.getsize(other) // 2)
        second = self.daemon()
        self.assertEqual(self.render(second), (image, 2, 0, 1))
        self.assertEqual(second.count_in_log("set aside as", 2), 2)
        second.stop()
        self.assertEqual(self.render(self.daemon()), (image, 0, 2, 1))

    def test_damage_while_it_runs(self):
        one = self.daemon()
        image, *_ = self.render(one)
        one.stop()
        one = self.daemon()
        self.assertEqual(self.render(one), (image, 0, 2, 1))
        for path in self.files():
            with open(path, "r+b") as file:
                file.seek(300)
                file.write(b"x" * 20000)
            os.truncate(path, 30000)
        self.assertEqual(self.render(one), (image, 0, 2, 1), "it is in memory")
        other = self.daemon()
        self.assertEqual(self.render(other), (image, 2, 0, 1))
        self.assertEqual(other.count_in_log("set aside as", 2), 2)

    def test_daemons_share_a_folder(self):
        one, other = self.daemon(), self.daemon()
        image, *_ = self.render(one)
        self.assertEqual(self.render(other), (image, 0, 2, 1))

    def test_the_folder_stays_within_its_limit(self):
        daemon = self.daemon("--max-structure-dir", "500KiB")
        image, *counts = self.render(daemon)
        self.assertEqual(counts, [2, 0, 1])
        self.assertLessEqual(sum(map(os.path.getsize, self.files())), 500 << 10)


if __name__ == "__main__":
    unittest.main()
