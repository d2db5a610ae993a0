"""POST /render: Drake's glTF Render Client-Server API."""

import base64
import hashlib
import json
import math
import struct
import unittest

from daemon import Daemon, shared_data
from pictures import decode_png, decode_tiff

BOUNDARY = "------------------------c13a866cb4280bc1"
WHITE = (255, 255, 255)


def form(fields, content_type="model/gltf+json"):
    """The body as Drake's client, which is curl, sends it: with the scene as a file, and the rest as text."""
    body = b""
    for name, value in fields.items():
        body += f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="{name}"'.encode()
        if name == "scene":
            body += f'; filename="0000000000000000001-color.gltf"\r\nContent-Type: {content_type}'.encode()
        body += b"\r\n\r\n" + (value if isinstance(value, bytes) else str(value).encode()) + b"\r\n"
    return body + f"--{BOUNDARY}--\r\n".encode()


def triangles(corners, color, **material):
    """A mesh of the corners of triangles; `scene` puts it into a file."""
    return {"corners": corners, "material": {"pbrMetallicRoughness": {"baseColorFactor": [*color, 1]}, **material}}


def wall(x0, y0, x1, y1, z):
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y0, z), (x1, y1, z), (x0, y1, z)]


def scene(*meshes, camera=None, **more):
    """A glTF file with everything in it. The camera is at the origin and looks along -z, unless it has a matrix."""
    node = {"camera": 0, "name": "Camera Node"}
    if camera:
        node["matrix"] = camera
    gltf = {"asset": {"version": "2.0"}, "scene": 0, "nodes": [node], "scenes": [{"nodes": [0]}], "meshes": [],
            "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.01, "aspectRatio": 1}}],
            "materials": [], "buffers": [], "bufferViews": [], "accessors": [], **more}
    for mesh in meshes:
        index = len(gltf["meshes"])
        data = b"".join(struct.pack("<3f", *corner) for corner in mesh["corners"])
        uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        gltf["buffers"].append({"byteLength": len(data), "uri": uri})
        gltf["bufferViews"].append({"buffer": index, "byteLength": len(data)})
        bounds = {"min": list(map(min, *mesh["corners"])), "max": list(map(max, *mesh["corners"]))}
        gltf["accessors"].append(
            {"bufferView": index, "componentType": 5126, "count": len(mesh["corners"]), "type": "VEC3", **bounds}
        )
        gltf["materials"].append(mesh["material"])
        gltf["meshes"].append({"primitives": [{"attributes": {"POSITION": index}, "material": index}]})
        gltf["nodes"].append({"mesh": index})
        gltf["scenes"][0]["nodes"].append(index + 1)
    return json.dumps(gltf).encode()


def fields(image_type, gltf, **changed):
    """Of the requests that the images in the shared data answer, as drake-blender's tests send them."""
    sent = {
        "scene": gltf, "scene_sha256": hashlib.sha256(gltf).hexdigest(), "image_type": image_type,
        "width": 640, "height": 480, "near": "0.010000", "far": "10.000000",
        "focal_x": "579.411255", "focal_y": "579.411255", "fov_x": "1.009136", "fov_y": "0.785398",
        "center_x": "319.500000", "center_y": "239.500000", "submit": "Render",
    }
    if image_type == "depth":
        sent |= {"min_depth": "0.010000", "max_depth": "10.000000"}
    sent |= changed
    return {name: value for name, value in sent.items() if value is not None}


class DrakeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--drake")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def render(self, image_type, gltf, query="", status=200, path="/render", daemon=None, **changed):
        headers = {"Content-Type": f"multipart/form-data; boundary={BOUNDARY}"}
        body = form(fields(image_type, gltf, **changed))
        reply = (daemon or self.daemon).request("POST", path + query, body, headers)
        self.assertEqual(reply.status, status, reply.body[:500])
        return reply

    def small(self, image_type, gltf, query="", **changed):
        """Of 8 by 6 pixels; one is one metre wide, a metre away."""
        small = {"width": 8, "height": 6, "focal_x": 1, "focal_y": 1, "center_x": 3.5, "center_y": 2.5}
        return self.render(image_type, gltf, query, **small | changed)

    def boxes(self):
        with open(shared_data("drake", "two_rgba_boxes.gltf"), "rb") as file:
            return file.read()

    def expected(self, name):
        with open(shared_data("drake", name), "rb") as file:
            return decode_png(file.read())

    # drake-blender takes the principal point for a place counted from the corner of the first pixel, and not, as Drake
    # does, from its middle: so its images are half a pixel aside, as far as its own tests allow that.

    def test_depth_is_what_drakes_own_server_says(self):
        expected = self.expected("depth.png")
        in_millimetres = decode_png(self.render("depth", self.boxes(), "?depth=uint16").body)
        in_metres = decode_tiff(self.render("depth", self.boxes()).body)
        self.assertEqual((in_millimetres.width, in_millimetres.height, in_millimetres.depth), (640, 480, 16))
        self.assertEqual((in_metres.width, in_metres.height, in_metres.depth), (640, 480, 32))
        seen = sum(value != 65535 for value in expected.samples)
        self.assertGreater(seen, 10_000)
        wrong = sum(abs(a - b) > 1 for a, b in zip(expected.samples, in_millimetres.samples))
        self.assertLessEqual(wrong, 0.02 * 640 * 480)
        told = [65535 if math.isinf(metres) else round(metres * 1000) for metres in in_metres.samples]
        wrong = sum(abs(a - b) > 1 for a, b in zip(expected.samples, told))
        self.assertLessEqual(wrong, 0.02 * 640 * 480)

    def test_labels_are_what_drakes_own_server_says(self):
        expected = self.expected("label.png")
        label = decode_png(self.render("label", self.boxes()).body)
        self.assertEqual((label.width, label.height, label.depth), (640, 480, 8))
        pairs = list(zip((pixel[:3] for pixel in expected.pixels()), (pixel[:3] for pixel in label.pixels())))
        seen = sum(a != WHITE for a, _ in pairs)
        self.assertGreater(seen, 10_000)
        self.assertLessEqual(sum(a != b for a, b in pairs), 0.02 * seen)
        self.assertEqual({b for _, b in pairs}, {WHITE, (64, 255, 64), (255, 64, 64)})

    def test_colour_is_lit_about_as_drakes_own_server_lights(self):
        """Blender's Filmic curve, which isn't ours, makes mid tones up to a third brighter or darker."""
        expected = self.expected("two_rgba_boxes.color.png")
        color = decode_png(self.render("color", self.boxes()).body)
        self.assertEqual((color.width, color.height, color.depth, color.channels), (640, 480, 8, 4))
        for place in ((320, 100), (150, 250), (150, 330), (490, 250), (490, 330)):
            for ours, theirs in zip(color.at(*place)[:3], expected.at(*place)[:3]):
                self.assertLess(abs(ours - theirs), 35, (place, color.at(*place), expected.at(*place)))
        self.assertEqual(set(color.samples[3::4]), {255})

    def test_every_answer_is_the_same_again(self):
        for image_type in ("color", "depth", "label"):
            first = self.render(image_type, self.boxes())
            with Daemon("--drake", "--threads", "1") as other:
                self.assertEqual(self.render(image_type, self.boxes(), daemon=other).body, first.body)
            self.assertEqual(self.render(image_type, self.boxes()).body, first.body)

    def test_labels_are_the_numbers_of_the_materials(self):
        """Every label that there can be: Drake writes it as r / 255, g / 255, 0."""
        for first in range(0, 256, 48):
            colors = [((first + i) % 256, (7 * (first + i)) % 256, i % 3) for i in range(48)]
            walls = [
                triangles(wall(-4 + i % 8, -3 + i // 8, -3 + i % 8, -2 + i // 8, -1), [channel / 255 for channel in color])
                for i, color in enumerate(colors)
            ]
            label = decode_png(self.small("label", scene(*walls)).body)
            rows = [colors[8 * (5 - y) : 8 * (5 - y) + 8] for y in range(6)]
            self.assertEqual(list(label.pixels()), [color for row in rows for color in row])

    def test_labels_know_nothing_of_light_and_textures(self):
        pixel = base64.b64encode(
            base64.b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR4nGNgYGBgAAAABQABpfZFQAAAAABJRU5ErkJggg==")
        ).decode()
        textures = {"images": [{"uri": "data:image/png;base64," + pixel}], "textures": [{"source": 0}]}
        lit = triangles(wall(-4, -3, 0, 3, -1), [0.5, 0.25, 0], emissiveFactor=[1, 1, 1])
        unlit = triangles(wall(0, -3, 4, 3, -1), [0.125, 1, 0], extensions={"KHR_materials_unlit": {}})
        for material in (lit["material"], unlit["material"]):
            material["pbrMetallicRoughness"]["metallicFactor"] = 1
        gltf = scene(lit, unlit, extensionsUsed=["KHR_materials_unlit"], **textures)
        label = decode_png(self.small("label", gltf).body)
        self.assertEqual(list(label.pixels()), ([(128, 64, 0)] * 4 + [(32, 255, 0)] * 4) * 6)

    def test_nothing_there(self):
        gltf = scene(triangles(wall(0, 0, 1, 1, 5), [1, 0, 0]))  # behind the camera
        self.assertEqual(set(decode_png(self.small("label", gltf).body).pixels()), {WHITE})
        self.assertEqual(set(decode_tiff(self.small("depth", gltf).body).samples), {math.inf})
        self.assertEqual(set(decode_png(self.small("depth", gltf, "?depth=uint16").body).samples), {65535})
        self.assertEqual(len(set(decode_png(self.small("color", gltf).body).pixels())), 1)

    def test_depth_is_along_the_axis_at_the_middle_of_each_pixel(self):
        """A plane that slants away to the right: z = -2 - x, so that depth d is seen at x = slope * d."""
        plane = [(-9, -90, 7), (90, -90, -92), (90, 90, -92), (-9, -90, 7), (90, 90, -92), (-9, 90, 7)]
        gltf = scene(triangles(plane, [1, 1, 1]))
        depth = decode_tiff(self.small("depth", gltf, focal_x=8, focal_y=8, center_x=3, max_depth=100).body)
        for x in range(8):
            slope = (x - 3) / 8  # Drake's first pixel has its middle at 0
            for y in range(6):
                self.assertAlmostEqual(depth.at(x, y), 2 / (1 - slope), 5)

    def test_the_range_of_a_sensor(self):
        walls = [triangles(wall(i - 4, -3, i - 3, 3, -1), [1, 1, 1]) for i in range(8)]
        for i, depth in enumerate((0.25, 0.5, 0.75, 1, 2, 2.5, 66, 70)):
            walls[i]["corners"] = [(x * depth, y * depth, -depth) for x, y, _ in walls[i]["corners"]]
        gltf, limits = scene(*walls), {"near": 0.1, "far": 100, "min_depth": 0.5, "max_depth": 2}
        told = [0, 0.5, 0.75, 1, 2, math.inf, math.inf, math.inf]
        self.assertEqual(list(decode_tiff(self.small("depth", gltf, **limits).body).samples), told * 6)
        for query in ("?depth=uint16&format=tiff", "?depth=uint16", "?depth=uint16&format=png"):
            decode = decode_tiff if "tiff" in query else decode_png
            picture = decode(self.small("depth", gltf, query, **limits).body)
            self.assertEqual(list(picture.samples), [0, 500, 750, 1000, 2000, 65535, 65535, 65535] * 6)
        limits |= {"max_depth": 100}
        picture = decode_png(self.small("depth", gltf, "?depth=uint16", **limits).body)
        self.assertEqual(list(picture.samples[4:8]), [2000, 2500, 65535, 65535])

    def test_what_is_clipped_isnt_there(self):
        walls = (triangles(wall(-9, -9, 9, 9, -1), [1, 0, 0]), triangles(wall(-9, -9, 9, 9, -2), [0, 1, 0]))
        far_away = triangles(wall(-90, -90, 90, 90, -5), [0, 0, 1])
        gltf = scene(*walls, far_away)
        for near, far, color in ((0.5, 9, (255, 0, 0)), (1.5, 9, (0, 255, 0)), (2.5, 9, (0, 0, 255)), (2.5, 4, WHITE)):
            label = decode_png(self.small("label", gltf, near=near, far=far).body)
            self.assertEqual(set(label.pixels()), {color}, (near, far))

    def test_the_camera_is_the_files(self):
        """Turned about its axis, moved, and under a node that turns it to look along +x."""
        gltf = json.loads(scene(triangles([(3, 1, 1), (3, 0, 1), (3, 0, 2)], [1, 0, 0])))
        gltf["nodes"][0]["matrix"] = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.5, 0, 1, 1]
        gltf["nodes"].append({"children": [0], "rotation": [0, -math.sqrt(0.5), 0, math.sqrt(0.5)]})
        gltf["scenes"][0]["nodes"] = [1, 2]
        # The eye is at (-1, 0, 0.5), right is +z and up is +y: the triangle is 4 away, from 0.5 to 1.5 on the right.
        gltf = json.dumps(gltf).encode()
        where = {"focal_x": 8, "focal_y": 8, "max_depth": 99}
        depth = decode_tiff(self.small("depth", gltf, **where).body)
        seen = {(x, y) for y in range(6) for x in range(8) if depth.at(x, y) < 99}
        self.assertEqual(seen, {(5, 2), (5, 1), (6, 2)} | ({(6, 1)} & seen))
        self.assertAlmostEqual(depth.at(5, 2), 4, 5)

    def test_what_is_seen_from_elsewhere_is_known(self):
        """Files that differ in where the camera stands alone are one scene, and one structure."""
        slanted = triangles([(-9, -90, -3), (90, -90, -102), (-9, 90, -3)], [0.5, 1, 0])
        scenes, images = set(), set()
        for x in range(4):
            with Daemon("--drake") as fresh:
                gltf = scene(slanted, camera=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, 0, 0, 1])
                reply = self.small("depth", gltf, focal_x=8, max_depth=99)
                self.assertEqual(reply.body, self.small("depth", gltf, daemon=fresh, focal_x=8, max_depth=99).body)
            scenes.add(self.daemon.request("GET", reply.headers["Location"]).json()["scene"])
            images.add(reply.body)
        self.assertEqual((len(scenes), len(images)), (1, 4))
        moved = json.loads(scene(slanted))
        moved["nodes"][1]["translation"] = [0, 0, -1]
        reply = self.small("depth", json.dumps(moved).encode(), focal_x=8, max_depth=99)
        self.assertNotIn(self.daemon.request("GET", reply.headers["Location"]).json()["scene"], scenes)

    def test_lights_of_the_file_take_the_place_of_the_lamp(self):
        light = {"type": "directional", "intensity": 683 * math.pi, "color": [0, 1, 0]}
        lights = {"extensionsUsed": ["KHR_lights_punctual"], "extensions": {"KHR_lights_punctual": {"lights": [light]}}}
        gltf = json.loads(scene(triangles(wall(-9, -9, 9, 9, -1), [1, 1, 1]), **lights))
        gltf["nodes"][0]["extensions"] = {"KHR_lights_punctual": {"light": 0}}
        red, green, blue, alpha = decode_png(self.small("color", json.dumps(gltf).encode()).body).at(4, 3)
        self.assertEqual((red, blue, alpha), (0, 0, 255))
        self.assertGreater(green, 200)

    def test_colour_takes_more_samples_when_asked(self):
        gltf = self.boxes()
        few, some = self.render("color", gltf, "?samples=1"), self.render("color", gltf, "?samples=16")
        self.assertNotEqual(few.body, some.body)
        self.assertEqual(some.body, self.render("color", gltf).body)
        stats = self.daemon.request("GET", some.headers["Location"] + "/stats").json()
        self.assertEqual(stats["rays"]["camera"] + stats["skipped"]["camera_rays"], 640 * 480 * 16)

    def test_labels_and_depths_take_camera_rays_alone(self):
        for image_type in ("label", "depth"):
            reply = self.render(image_type, self.boxes(), near=0.02)
            stats = self.daemon.request("GET", reply.headers["Location"] + "/stats").json()
            self.assertGreater(stats["rays"]["camera"], 0)
            self.assertEqual(stats["rays"]["camera"], stats["rays"]["total"])
            self.assertGreater(stats["skipped"]["camera_rays"], 640 * 480 // 2)

    def test_what_is_wrong_is_said_in_plain_text(self):
        gltf = scene(triangles(wall(0, 0, 1, 1, -2), [1, 0, 0]))
        names = set(fields("color", gltf)) - {"submit", "image_type"}
        cases = [("color", {name: None}, name) for name in names] + [(None, {}, "image_type")]
        cases += [("depth", {"min_depth": None}, "min_depth"), ("depth", {"max_depth": None}, "max_depth")]
        for name in ("width", "height"):
            cases += [("label", {name: value}, name) for value in ("0", "-1", "1.5", "", "640x", "4294967296", "70000000")]
        for name in ("near", "far", "focal_x", "focal_y", "fov_x", "fov_y", "center_x", "center_y"):
            cases += [("label", {name: value}, name) for value in ("", "nan", "x", "1e", "1 2")]
        for name in ("focal_x", "focal_y", "fov_x", "fov_y"):
            cases += [("label", {name: value}, name) for value in ("0", "-1", "inf")]
        cases += [("label", {name: value}, name) for name in ("fov_x", "fov_y") for value in ("3.14159274", "3.2")]
        cases += [
            ("label", {"near": 2, "far": 2}, "near"), ("label", {"near": -1}, "near"),
            ("depth", {"min_depth": 3, "max_depth": 1}, "min_depth"), ("depth", {"min_depth": "-0.1"}, "min_depth"),
            ("colour", {}, "image_type"), ("", {}, "image_type"),
            ("color", {"scene_sha256": "0" * 64}, "scene_sha256"), ("color", {"scene_sha256": "x"}, "scene_sha256"),
            ("color", {"scene": b""}, "scene"), ("color", {"depth": "1"}, "depth"), ("label", {"Width": 3}, "Width"),
        ]
        for image_type, changed, name in cases:
            with self.subTest(kind=image_type, changed=changed):
                reply = self.render(image_type, gltf, status=400, **changed)
                self.assertEqual(reply.media_type, "text/plain")
                self.assertIn(name, reply.body.decode())
        for content in (b"{}", b"glTF", gltf[:-9], scene(camera=[0] * 16), b"\x00" * 99,
                        json.dumps({**json.loads(gltf), "cameras": [], "nodes": [{}, {"mesh": 0}]}).encode()):
            with self.subTest(scene=content[:80]):
                reply = self.render("color", content, status=400)
                self.assertEqual(reply.media_type, "text/plain")
                self.assertIn("scene", reply.body.decode())
        broken = json.loads(gltf)
        broken["meshes"][0]["primitives"] *= 2
        for i in range(2):
            broken["meshes"][0]["primitives"][i] = {"attributes": {"POSITION": 9}}
        said = self.render("color", json.dumps(broken).encode(), status=400).body.decode().splitlines()
        self.assertRegex(said[0], r"^scene: /meshes/0/primitives/0/attributes/POSITION: \S")
        self.assertRegex(said[1], r"^scene: /meshes/0/primitives/1/attributes/POSITION: \S")
        self.assertEqual(len(said), len(set(said)), said)
        for query, name in (("?samples=0", "samples"), ("?samples=x", "samples"), ("?depth=uint16", "depth"),
                            ("?format=tiff", "format"), ("?format=jpeg", "format"), ("?aov=depth", "aov")):
            with self.subTest(query=query):
                reply = self.render("color", gltf, query, status=400)
                self.assertEqual(reply.media_type, "text/plain")
                self.assertIn(name, reply.body.decode())
        self.assertIn("format", self.render("depth", gltf, "?format=png", status=400).body.decode())

    def test_a_body_that_is_no_form(self):
        kind = f"multipart/form-data; boundary={BOUNDARY}"
        whole = form(fields("label", scene()))
        for body, content_type in ((b"", kind), (b"{}", "application/json"), (whole[:-9], kind), (b"x", None), (whole, "multipart/form-data")):
            reply = self.daemon.request("POST", "/render", body, {"Content-Type": content_type} if content_type else {})
            self.assertEqual((reply.status, reply.media_type), (400, "text/plain"), reply.body)
        twice = whole.replace(b'name="submit"', b'name="width"')
        reply = self.daemon.request("POST", "/render", twice, {"Content-Type": kind})
        self.assertEqual((reply.status, reply.media_type), (400, "text/plain"), reply.body)
        self.assertIn(b"width", reply.body)

    def test_it_is_off_by_default_and_may_have_a_prefix(self):
        gltf = scene(triangles(wall(-9, -9, 9, 9, -2), [1, 0, 0]))
        with Daemon() as off:
            self.render("label", gltf, status=404, daemon=off)
        with Daemon("--drake", "--drake-prefix", "/robots/drake") as daemon:
            self.render("label", gltf, status=404, daemon=daemon)
            self.render("label", gltf, path="/robots/drake/render", daemon=daemon)
            self.assertEqual(daemon.request("GET", "/robots/drake/render").status, 405)


if __name__ == "__main__":
    unittest.main()
