"""Every structure, bound, space and way of screen bounds that the daemon lists gives one image, and evidence of its cost."""

import hashlib
import itertools
import unittest

from daemon import Daemon
from documents import SMALL_JOB, SPHERE
from pictures import decode_png

OCTAHEDRON = {
    "type": "mesh",
    "positions": [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]],
    "triangles": [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
}
# Every shape; mirrors and glass, so that rays start anywhere; instances that are turned, squeezed and mirrored.
SCENE = {
    "background": [0.1, 0.2, 0.3],
    "camera": {"type": "perspective", "from": [1, 3, 9], "at": [0, 0, 0], "fov": 50},
    "lights": [
        {"type": "point", "position": [4, 6, 5], "intensity": [90, 90, 90]},
        {"type": "directional", "direction": [1, -2, -1], "irradiance": [1, 1, 1]},
    ],
    "materials": {
        "clay": {"type": "diffuse", "color": [0.7, 0.4, 0.2]},
        "silver": {"type": "mirror", "color": [0.9, 0.9, 0.9]},
        "glass": {"type": "dielectric", "ior": 1.5},
    },
    "geometries": {"gem": OCTAHEDRON},
    "objects": [
        {"type": "disk", "center": [0, -1, 0], "normal": [0, 1, 0], "radius": 6, "material": "clay"},
        {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "silver"},
        {"type": "sphere", "center": [1.5, 0, 2], "radius": 0.7, "material": "glass"},
        {"type": "cylinder", "base": [-3, -1, 0], "apex": [-3, 1, 0], "radius": 0.5},
        {"type": "cone", "base": [3, -1, -1], "base_radius": 1, "apex": [3, 1.5, -1], "apex_radius": 0, "material": "silver"},
        {"type": "quad", "corners": [[-4, -1, -4], [4, -1, -4], [4, 3, -4], [-4, 3, -4]]},
        {"type": "instance", "of": "gem", "transform": {"translate": [-1.7, 0, 1.5]}},
        {
            "type": "instance",
            "of": "gem",
            "transform": {"translate": [0, 1.8, 0], "rotate": {"axis": [1, 2, 3], "degrees": 40}, "scale": [-1.5, 0.2, 0.8]},
        },
    ],
}
USER_NORMALS = (
    [[1, 2, 3], [-1, 0.5, 0], [0, 0, 1e-3], [1e30, 1e30, 0], [5, 5, 5.001]],
    [[0, 1, 0]],  # encloses nothing from the sides
)


class StructuresTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--threads", "2")
        cls.addClassCleanup(cls.daemon.stop)
        cls.capabilities = cls.daemon.request("GET", "/v1/capabilities").json()
        cls.kinds = {row["kind"]: {o["name"]: o for o in row["options"]} for row in cls.capabilities["accel"]}

    def get(self, path):
        reply = self.daemon.request("GET", path)
        self.assertEqual(reply.status, 200, reply.body[:300])
        return reply

    def render(self, settings, scene=None, size=40):
        job = self.daemon.submit({"scene": scene or SCENE, "image": {"width": size, "height": size}, "settings": settings})
        self.assertEqual(self.daemon.wait_ended(job)["state"], "completed", settings)
        return job

    def stats(self, job):
        return self.get(f"/v1/jobs/{job}/stats").json()

    def choices(self):
        """An accel for every kind, bound and space, and slabs by the user's normals."""
        for kind, options in self.kinds.items():
            bounds = options["bound"]["values"] if "bound" in options else [None]
            spaces = options["space"]["values"] if "space" in options else [None]
            for bound, space in itertools.product(bounds, spaces):
                accel = {"kind": kind}
                if bound:
                    accel["bound"] = bound
                if space:
                    accel["space"] = space
                yield accel
                if bound == "slabs":
                    for normals in (*options["normals"]["presets"], *USER_NORMALS):
                        yield {**accel, "normals": normals}

    def test_everything_of_the_field_is_listed(self):
        self.assertEqual(list(self.kinds), ["auto", "brute", "bounds", "bvh", "grid", "octree", "kd", "bsp", "wide"])
        for kind in ("bounds", "bvh"):
            self.assertEqual(self.kinds[kind]["bound"]["values"], ["box", "sphere", "slabs", "hull"])
            self.assertEqual(set(self.kinds[kind]["space"]["values"]), {"object", "world"})
        self.assertEqual(self.capabilities["screen_bounds"], ["off", "flat", "hierarchical"])
        self.assertLessEqual({"cost_volumes", "cost_primitives"}, set(self.capabilities["aovs"]))

    def test_one_image_whatever_the_way(self):
        aovs = ["depth", "normal", "primitive_id", "object_id"]
        images = {}
        for accel, screen_bounds in itertools.product(self.choices(), self.capabilities["screen_bounds"]):
            job = self.render({"accel": accel, "screen_bounds": screen_bounds, "aovs": aovs, "samples": 2})
            exr = self.get(f"/v1/jobs/{job}/image?aov=all&format=exr").body
            images.setdefault(hashlib.sha256(exr).hexdigest(), []).append((accel, screen_bounds))
            structure = self.stats(job)["structure"]
            if accel["kind"] != "auto":
                self.assertEqual(structure["kind"], accel["kind"])
                asked = {k: v for k, v in accel.items() if k != "kind" and not (k == "normals" and isinstance(v, int))}
                self.assertLessEqual(asked.keys(), structure["options"].keys())
        self.assertEqual(len(images), 1, images)

    def test_what_is_told_can_be_asked_for(self):
        job = self.render({"accel": {"kind": "bvh", "bound": "slabs", "normals": USER_NORMALS[0], "leaf_size": 2}})
        structure, plan = self.stats(job)["structure"], self.get(f"/v1/jobs/{job}/plan").json()
        self.assertEqual(plan["accel"]["options"], structure["options"])
        self.assertEqual(structure["options"]["leaf_size"], 2)
        again = self.stats(self.render({"accel": {"kind": structure["kind"], **structure["options"]}}))["structure"]
        self.assertEqual(again["options"], structure["options"])
        self.assertIs(again["shared"], True, "equal options, one structure")
        other = self.stats(self.render({"accel": {"kind": "bvh", "bound": "slabs", "leaf_size": 2}}))["structure"]
        self.assertIs(other["shared"], False)

    def test_counts_are_evidence_and_leave_the_image_alone(self):
        tests = {}
        for kind in ("brute", "bounds", "bvh", "grid", "octree", "kd", "bsp", "wide"):
            plain = self.render({"accel": {"kind": kind}})
            counted = self.render({"accel": {"kind": kind}, "count_tests": True})
            images = [self.get(f"/v1/jobs/{job}/image?format=exr").body for job in (plain, counted)]
            self.assertEqual(images[0], images[1])
            self.assertIsNone(self.stats(plain)["tests"])
            stats = self.stats(counted)
            found = tests[kind] = stats["tests"]
            self.assertEqual(found["rays"], stats["rays"]["total"])
            self.assertLessEqual(found["volume_hits"], found["volume_tests"])
            self.assertLessEqual(found["object_hits"], found["object_tests"])
            self.assertGreater(found["object_hits"], 0, kind)
            for what in ("volume_tests", "object_tests"):
                self.assertAlmostEqual(found["per_ray"][what], found[what] / found["rays"])
            if found["volume_hits"]:
                self.assertAlmostEqual(found["false_hit_rate"], found["false_hits"] / found["volume_hits"])
        for kind, found in tests.items():
            self.assertTrue(kind == "brute" or found["object_tests"] < tests["brute"]["object_tests"], tests)

    def test_a_tighter_bound_lets_fewer_rays_through(self):
        def object_tests(**accel):
            job = self.render({"accel": {"kind": "bounds", **accel}, "count_tests": True, "screen_bounds": "off"})
            return self.stats(job)["tests"]["object_tests"]

        few = object_tests(bound="slabs", normals=[[0, 1, 0]])
        self.assertLess(object_tests(bound="slabs", normals=13), few)

    def test_costs_as_pictures(self):
        far = {**SPHERE, "camera": {"type": "perspective", "from": [0, 0, 8], "at": [0, 0, 0]}}
        job = self.render({"aovs": ["cost_volumes", "cost_primitives"], "accel": {"kind": "bvh"}, "tile_size": 4}, far)
        self.assertIsNotNone(self.stats(job)["tests"], "a cost plane counts")
        starts = {"png": b"\x89PNG", "jpeg": b"\xff\xd8", "exr": b"\x76\x2f\x31\x01", "hdr": b"#?RADIANCE"}
        for aov in ("cost_volumes", "cost_primitives"):
            for name, start in starts.items():
                body = self.get(f"/v1/jobs/{job}/image?aov={aov}&format={name}").body
                self.assertTrue(body.startswith(start), (aov, name))
        png = self.get(f"/v1/jobs/{job}/image?aov=cost_primitives&format=png").body
        self.assertEqual(decode_png(png).at(0, 0), (0, 0, 0), "nothing is traced in the corner")
        everything = self.get(f"/v1/jobs/{job}/image?aov=all").body
        for channel in (b"R\0", b"cost.volumes\0", b"cost.primitives\0"):
            self.assertIn(channel, everything)
        reply = self.daemon.request("GET", f"/v1/jobs/{self.render({})}/image?aov=cost_volumes")
        self.assertEqual(reply.status, 404)

    def refused(self, accel, *places):
        reply = self.daemon.request("POST", "/v1/jobs", {**SMALL_JOB, "settings": {"accel": accel}})
        self.assertEqual(reply.status, 422, accel)
        errors = {error["pointer"]: error["detail"] for error in reply.json()["errors"]}
        self.assertEqual(sorted(errors), sorted("/settings/accel" + place for place in places), accel)
        return list(errors.values())

    def test_every_option_of_every_kind(self):
        """An option is taken at its default and at the ends of its range by the kinds that list it, and by no other."""
        names = {name: option for options in self.kinds.values() for name, option in options.items()}
        for kind, options in self.kinds.items():
            for name, option in names.items():
                with self.subTest(kind, option=name):
                    accel = {"kind": kind, name: option["default"]}
                    if name not in options:
                        (detail,) = self.refused(accel, "/" + name)
                        users = [user for user, taken in self.kinds.items() if name in taken]
                        self.assertTrue(all(user in detail for user in users), detail)
                        continue
                    accel.update(option.get("only_with", {}))
                    ends = [option["least"], option["most"]] if option["type"] == "integer" else []
                    for value in [option["default"], *ends]:
                        self.render({"accel": {**accel, name: value}}, SPHERE, 4)
                    if ends:
                        self.refused({**accel, name: option["most"] + 1}, "/" + name)
                    if option["type"] == "word":
                        self.refused({**accel, name: "paper"}, "/" + name)

    def test_refusals_name_the_place(self):
        self.refused({"kind": "magic"}, "/kind")
        self.refused({}, "")
        self.refused({"kind": "bvh", "normals": 3}, "/normals")
        self.refused({"kind": "bvh", "bound": "box", "max_faces": 8}, "/max_faces")
        self.refused({"kind": "brute", "bound": "box", "leaf_size": 2, "bins": 3}, "/bound", "/leaf_size", "/bins")
        slabs = {"kind": "bounds", "bound": "slabs"}
        self.refused({**slabs, "normals": []}, "/normals")
        self.refused({**slabs, "normals": 4}, "/normals")
        self.refused({**slabs, "normals": [[1, 0, 0]] * 33}, "/normals")
        self.refused({**slabs, "normals": [[1, 0, 0], [0, 0, 0], [1, 0, "x"]]}, "/normals/1", "/normals/2/2")


if __name__ == "__main__":
    unittest.main()
