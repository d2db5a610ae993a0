"""POST /v1/render: a file in, its picture out."""

import base64
import io
import json
import os
import struct
import time
import unittest
import zipfile

from concurrency_test import all_at_once
from daemon import ENDED, Daemon, Reply
from documents import ENDLESS_PIXEL, SPHERE
from pictures import decode_png

# A square that faces +z, the front.
OBJ = b"v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n"
PLY = b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
PLY += b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"
PLY += b"-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n4 0 1 2 3\n"
NFF = b"b 0.2 0.4 0.6\nv\nfrom 0 0 4\nat 0 0 0\nup 0 1 0\nangle 40\nhither 1\nresolution 20 10\nl 4 3 2\n"
NFF += b"f 1 1 1 1 0 0 0 0\ns 0 0 0 0.5\n"
# The same with a library, which makes it red.
WITH_MTL = b"mtllib a.mtl\nusemtl red\n" + OBJ
MTL = b"newmtl red\nKd 1 0 0\n"
# The same as glTF, in two files, with a camera that sees it from behind.
CORNERS = struct.pack("<12f", -1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0) + struct.pack("<6H", 0, 1, 2, 0, 2, 3)
GLTF = {
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0, 1]}],
    "nodes": [{"mesh": 0}, {"camera": 0, "rotation": [0, 1, 0, 0], "translation": [0, 0, -4]}],
    "cameras": [{"name": "behind", "type": "perspective", "perspective": {"yfov": 0.2, "znear": 0.1}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
    "materials": [{"doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
    ],
    "bufferViews": [
        {"buffer": 0, "byteLength": 48, "target": 34962},
        {"buffer": 0, "byteOffset": 48, "byteLength": 12, "target": 34963},
    ],
    "buffers": [{"uri": "buffers/corners%201.bin", "byteLength": 60}],
}
JOB = {"scene": SPHERE, "image": {"width": 8, "height": 6}, "settings": {"samples": 2}}


def pixels(png):
    """Width, height and rows of pixels of a PNG."""
    picture = decode_png(png)
    return picture.width, picture.height, picture.rows()


def form(files, boundary="b0undary"):
    """The body of a form of files, by their names, and its type."""
    body = b""
    for name, content in files:
        body += f'--{boundary}\r\nContent-Disposition: form-data; name="f"; filename="{name}"\r\n\r\n'.encode()
        body += content + b"\r\n"
    return body + f"--{boundary}--\r\n".encode(), {"Content-Type": f"multipart/form-data; boundary={boundary}"}


def archive(files):
    """A ZIP archive of files by their names."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as out:
        for name, content in files:
            out.writestr(name, content)
    return data.getvalue()


class RenderTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def render(self, body, query="", headers=None, status=200, daemon=None):
        reply = (daemon or self.daemon).request("POST", "/v1/render" + query, body, headers)
        self.assertEqual(reply.status, status, reply.body[:1000])
        return reply

    def places(self, reply):
        """Where a refusal says that something is wrong."""
        return [error["pointer"] for error in reply.json()["errors"]]

    def test_a_file_becomes_a_picture(self):
        for body in (OBJ, PLY):
            reply = self.render(body, "?width=32&height=24&samples=4&azimuth=0&elevation=0")
            self.assertEqual(reply.media_type, "image/png")
            width, height, rows = pixels(reply.body)
            self.assertEqual((width, height), (32, 24))
            self.assertEqual(rows[0][0], (255, 255, 255))
            self.assertLess(max(rows[12][16]), 250)
            for name in ("parse", "build", "render", "encode"):
                self.assertRegex(reply.headers["Server-Timing"], rf"\b{name};dur=\d")
            job = self.daemon.request("GET", reply.headers["Location"]).json()
            self.assertEqual((job["state"], job["width"], job["samples_per_pixel"]["max"]), ("completed", 32, 4))

    def test_the_type_is_told_by_the_header_or_by_the_content(self):
        plain = self.render(OBJ, "?width=8&samples=1")
        for media_type in ("model/obj", "application/octet-stream", "application/x-www-form-urlencoded", "text/plain"):
            self.assertEqual(self.render(OBJ, "?width=8&samples=1", {"Content-Type": media_type}).body, plain.body)
        reply = self.render(OBJ, headers={"Content-Type": "model/ply"}, status=422)
        self.assertIn("OBJ", reply.json()["errors"][0]["detail"])
        self.render(b"\x89PNG\r\n\x1a\n", status=415)
        self.render(OBJ, headers={"Content-Encoding": "gzip"}, status=415)
        self.render(b"", status=400)

    def middle(self, reply):
        width, height, rows = pixels(reply.body)
        return rows[height // 2][width // 2]

    def test_files_come_with_those_that_they_name(self):
        query = "?width=16&samples=4&azimuth=0&elevation=0"
        red = self.render(*self.with_query(query, form([("a.obj", WITH_MTL), ("a.mtl", MTL)])))
        self.assertGreater(self.middle(red)[0], 2 * self.middle(red)[1])
        grey = self.render(*self.with_query(query, form([("a.obj", WITH_MTL)])))
        self.assertEqual(len(set(self.middle(grey))), 1)
        warnings = [self.daemon.request("GET", r.headers["Location"]).json()["warnings"] for r in (red, grey)]
        self.assertNotIn("Tessera-Warnings", red.headers)
        self.assertEqual(grey.headers["Tessera-Warnings"], str(warnings[1]))
        scene = grey.headers["Link"].removesuffix('>; rel="describedby"').removeprefix("<")
        self.assertIn("material library", str(self.daemon.request("GET", scene).json()["warnings"]))
        self.assertEqual((warnings[0], warnings[1] > 0), (0, True))
        # Whatever the boundary is, the order, or the way, it is the same job.
        for body, headers in (
            form([("./a.mtl", MTL), ("a.obj", WITH_MTL)], "another"),
            (archive([("a.obj", WITH_MTL), ("a.mtl", MTL)]), {"Content-Type": "application/zip"}),
            (archive([("in/a.mtl", MTL), ("in/a.obj", WITH_MTL), ("__MACOSX/in/._a.obj", b"?")]), {}),
            form([("whole.zip", archive([("a.obj", WITH_MTL), ("a.mtl", MTL)]))]),
        ):
            again = self.render(body, query, headers)
            self.assertEqual((again.headers["Location"], again.body), (red.headers["Location"], red.body))
        self.render(*self.with_query("?width=16&samples=1", form([("scene.json", json.dumps(SPHERE).encode())])))

    def test_a_gltf_comes_in_many_ways(self):
        query = "?width=16&samples=4&azimuth=0&elevation=0"
        text = json.dumps(GLTF).encode()
        red = self.render(*self.with_query(query, form([("a.gltf", text), ("buffers/corners 1.bin", CORNERS)])))
        self.assertGreater(self.middle(red)[0], 2 * self.middle(red)[1])
        # curl sends no folders; that is told.
        flat = self.render(*self.with_query(query, form([("a.gltf", text), ("corners 1.bin", CORNERS)])))
        self.assertEqual(flat.body, red.body)
        self.assertEqual(self.daemon.request("GET", flat.headers["Location"]).json()["warnings"], 0)
        zipped = self.render(archive([("x/a.gltf", text), ("x/buffers/corners 1.bin", CORNERS)]), query)
        self.assertEqual(zipped.headers["Location"], red.headers["Location"])
        uri = "data:application/octet-stream;base64," + base64.b64encode(CORNERS).decode()
        whole = json.dumps({**GLTF, "buffers": [{"uri": uri, "byteLength": 60}]}).encode()
        for media_type in ("model/gltf+json", "application/json", "application/octet-stream"):
            self.assertEqual(self.render(whole, query, {"Content-Type": media_type}).body, red.body)
        self.assertEqual(self.places(self.render(text, query, status=422)), ["body/buffers/0/uri"])
        # One of its cameras: all that it sees is the square.
        for camera in ("behind", "0"):
            _, _, rows = pixels(self.render(whole, f"?width=16&samples=4&camera={camera}").body)
            self.assertTrue(all(pixel[0] > 2 * pixel[1] for row in rows for pixel in row))
        self.assertEqual(self.places(self.render(whole, "?camera=beside", status=422)), ["?camera"])
        refused = self.render(whole, "?variant=none", status=422)
        self.assertEqual(self.places(refused), ["?variant"])
        self.assertEqual(refused.json()["errors"][0]["detail"], 'There is no variant "none"; the file has none.')
        extension = {"KHR_materials_variants": {"variants": [{"name": "red"}, {"name": "blue"}]}}
        varied = json.dumps({**json.loads(whole), "extensionsUsed": [*extension], "extensions": extension}).encode()
        refused = self.render(varied, "?variant=none", status=422)
        self.assertEqual(self.places(refused), ["?variant"])
        self.assertIn('"red", "blue"', refused.json()["errors"][0]["detail"])
        refused = self.render(whole, "?camera=beside", status=422)
        self.assertIn('0 ("behind")', refused.json()["errors"][0]["detail"])

    def with_query(self, query, body_and_headers):
        return body_and_headers[0], query, body_and_headers[1]

    def test_a_file_of_a_form_may_have_no_name(self):
        query = "?width=16&samples=4&azimuth=0&elevation=0"
        red = self.render(*self.with_query(query, form([("a.obj", WITH_MTL), ("a.mtl", MTL)])))
        body, headers = form([("a.obj", WITH_MTL), ("a.mtl", MTL)])
        named = b'name="f"; filename="a.obj"'
        for name in (b"scene", b"file", b"asset"):
            without = body.replace(named, b'name="' + name + b'"')
            self.assertEqual(self.render(without, query, headers).body, red.body)
        escaped = body.replace(named, b"name=f; filename*=UTF-8''%61.obj")
        self.assertEqual(self.render(escaped, query, headers).headers["Location"], red.headers["Location"])
        detail = self.render(body.replace(named, b'name="f"'), query, headers, 400).json()["detail"]
        self.assertIn('"f" is no file', detail)
        scene, headers = form([("s", json.dumps(SPHERE).encode())])
        scene = scene.replace(b'name="f"; filename="s"', b'name="scene"')
        self.assertEqual(self.render(scene, "?width=8&samples=1", headers).body,
                         self.render(SPHERE, "?width=8&samples=1").body)

    def test_forms_and_archives_that_cannot_be_used(self):
        for files, words in (
            ([("a.obj", OBJ), ("b/c.ply", PLY)], ["a.obj", "b/c.ply"]),
            ([("a.txt", b"x"), ("b", b"y")], ["a.txt"]),
            ([("../a.obj", OBJ), ("b", b"")], ["../a.obj"]),
            ([("/a.obj", OBJ), ("b", b"")], ["/a.obj"]),
            ([("a.obj", OBJ), ("./a.obj", OBJ)], ["a.obj"]),
        ):
            zipped = (archive(files), {"Content-Type": "application/zip"})
            for body, headers in (form(files), zipped):
                detail = self.render(body, "", headers, 400).json()["detail"]
                for word in words:
                    self.assertIn(word, detail)
        body, headers = form([("a.obj", OBJ)])
        self.render(body[:-10], "", headers, 400)
        self.render(body, "", {"Content-Type": "multipart/form-data"}, 400)
        self.render(archive([("a.obj", OBJ)])[:-30], "", {"Content-Type": "application/zip"}, 400)
        self.render(archive([("a.obj", b"\n" * (40 << 20))]), "", {}, 413)
        broken = form([("a.obj", b"v 1 x\nf 1\n"), ("a.mtl", b"")])
        self.assertEqual(self.places(self.render(broken[0], "", broken[1], 422))[0], "a.obj:1")
        self.assertEqual(os.listdir(os.path.join(self.daemon.data_dir, "blobs")), [])

    def test_scenes_are_taken_as_they_are(self):
        width, height, rows = pixels(self.render(NFF).body)
        self.assertEqual((width, height), (20, 10))
        plain = self.daemon.submit(JOB)
        self.daemon.wait_ended(plain)
        look = "exposure=1&tone_map=none"
        image = self.daemon.request("GET", f"/v1/jobs/{plain}/image?{look}").body
        self.assertEqual(self.render(JOB, "?" + look).body, image)
        scene = self.render(SPHERE, f"?width=8&height=6&samples=2&{look}")
        self.assertEqual(scene.body, image)
        job = self.daemon.request("GET", scene.headers["Location"]).json()
        self.assertEqual(job["scene"], self.daemon.request("POST", "/v1/scenes", SPHERE).json()["scene"])

    def test_a_document_and_the_query_may_not_both_say_something(self):
        reply = self.render(JOB, "?width=3&samples=1&fov=20", status=400)
        self.assertEqual(self.places(reply), ["?width", "?samples"])
        reply = self.render({**SPHERE, "camera": {"type": "perspective"}}, "?azimuth=3&up=z", status=400)
        self.assertEqual(sorted(self.places(reply)), ["?azimuth", "?up"])

    def test_what_is_wrong_is_named_as_it_was_sent(self):
        self.assertEqual(self.places(self.render(OBJ, "?width=0&error=x&aov=no&azimuth=400", status=400)),
                         ["?width", "?error", "?azimuth"])
        self.assertEqual(self.places(self.render(OBJ, "?aov=no&background=pink", status=400)), ["?aov", "?background"])
        self.assertEqual(self.places(self.render(OBJ, "?width=100000000", status=422)), ["?width"])
        for asked in ("error=0", "seconds=0", "fov=0", "fov=180", "environment=1e30", "error=1e-60", "error=1e300"):
            self.assertEqual(self.places(self.render(OBJ, "?" + asked, status=400)), ["?" + asked.split("=")[0]])
        self.assertEqual(self.places(self.render(OBJ, "?wdith=1", status=400)), ["?wdith"])
        reply = self.render(b"v 1 2 x\nf 1 2 3\n", "", {"Content-Type": "model/obj"}, 422)
        self.assertEqual(self.places(reply), ["body:1", "body:2"])
        self.assertEqual(self.places(self.render({"objects": [{"type": "sphere"}]}, status=422))[0][:10], "/objects/0")
        self.render(b'{"objects": [}', headers={"Content-Type": "application/json"}, status=400)

    def test_the_camera_goes_around(self):
        """Seen from the side, a flat square is a line; with z up, it lies."""
        def covered(query):
            query = "?width=32&samples=4&ground=none&background=transparent&" + query
            _, _, rows = pixels(self.render(OBJ, query).body)
            return sum(pixel[3] > 0 for row in rows for pixel in row)

        front = covered("azimuth=0&elevation=0")
        self.assertGreater(front, 600)
        self.assertLess(covered("azimuth=90&elevation=0"), 100)
        self.assertEqual(covered("azimuth=0&elevation=90&up=z"), front)
        self.assertEqual(covered("azimuth=17&elevation=90&up=z"), covered("azimuth=17&elevation=90&up=z&fov=30"))

    def test_the_background_is_what_was_asked_for(self):
        for asked, corner in (("102a3f", (0x10, 0x2A, 0x3F)), ("%23FFfe01", (255, 254, 1)), ("black", (0, 0, 0))):
            _, _, rows = pixels(self.render(OBJ, f"?width=16&samples=1&background={asked}").body)
            self.assertEqual(rows[0][0], corner)
        _, _, rows = pixels(self.render(OBJ, "?width=16&samples=1&background=transparent").body)
        self.assertEqual(rows[0][0], (0, 0, 0, 0))
        query = "?width=16&samples=1&background=environment&environment=0.5&tone_map=none"
        _, _, rows = pixels(self.render(OBJ, query).body)
        self.assertEqual(rows[0][0], (188, 188, 188))
        path = self.render(OBJ, "?width=16&samples=1").headers["Location"] + "/image"
        _, _, rows = pixels(self.daemon.request("GET", path + "?background=112233").body)
        self.assertEqual(rows[0][0], (0x11, 0x22, 0x33))
        opaque = self.render(SPHERE, "?width=8&samples=1").headers["Location"] + "/image"
        reply = self.daemon.request("GET", opaque + "?background=112233")
        self.assertEqual((reply.status, self.places(reply)), (400, ["?background"]))

    def test_the_same_again_is_known(self):
        with Daemon() as daemon:
            query = "?width=16&samples=2"
            first = self.render(OBJ, query, daemon=daemon)
            again = self.render(OBJ, query, daemon=daemon)
            self.assertEqual(again.headers["Location"], first.headers["Location"])
            self.assertEqual((again.headers["ETag"], again.body), (first.headers["ETag"], first.body))
            jpeg = self.render(OBJ, query + "&format=jpeg", daemon=daemon)
            self.assertEqual(jpeg.headers["Location"], first.headers["Location"])
            self.assertNotEqual(jpeg.headers["ETag"], first.headers["ETag"])
            etag = {"If-None-Match": first.headers["ETag"]}
            self.assertEqual(self.render(OBJ, query, etag, 304, daemon).body, b"")
            self.assertEqual(self.render(OBJ, query + "&fov=20", etag, daemon=daemon).status, 200)
            # Nothing of it is left on the disk, and a job that has been deleted is rendered again.
            self.assertEqual(daemon.request("DELETE", first.headers["Location"]).status, 204)
            anew = self.render(OBJ, query, daemon=daemon)
            self.assertNotEqual(anew.headers["Location"], first.headers["Location"])
            self.assertEqual((anew.headers["ETag"], anew.body), (first.headers["ETag"], first.body))
        with Daemon() as daemon:
            self.render(OBJ, query, etag, 304, daemon)
            self.assertEqual(self.render(OBJ, query, daemon=daemon).body, first.body)

    def test_images_that_gave_way_are_rendered_again(self):
        room = 2 * 16 * 16 * 16 * 3
        with Daemon("--max-film-memory", str(room), "--image-cache", "0", "--threads", "2") as daemon:
            first = self.render(OBJ, "?width=16&samples=1", daemon=daemon)
            for i in range(8):
                self.render(OBJ, f"?width=16&samples=1&azimuth={i}", daemon=daemon)
            self.assertEqual(daemon.request("GET", first.headers["Location"]).json()["image"], "gone")
            self.assertEqual(self.render(OBJ, "?width=16&samples=1", daemon=daemon).body, first.body)

    def test_identical_requests_at_once_render_once(self):
        with Daemon() as daemon:
            replies = all_at_once(8, lambda _: daemon.request("POST", "/v1/render?width=64&samples=64", OBJ))
            self.assertEqual({reply.status for reply in replies}, {200})
            self.assertEqual(len({reply.body for reply in replies}), 1)
            self.assertEqual(len(daemon.request("GET", "/v1/jobs").json()["jobs"]), 1)

    def test_files_by_path_may_change(self):
        scene = {"objects": [{"type": "file", "path": "a.obj"}], "background": [1, 1, 1]}
        with Daemon("--asset-root", self.daemon.folder) as daemon:
            images = []
            for size in (1, 2):
                with open(self.daemon.folder + "/a.obj", "wb") as file:
                    file.write(OBJ.replace(b"v 1", b"v %d" % size))
                images.append(self.render(scene, "?width=16&samples=1", daemon=daemon))
            self.assertNotEqual(images[0].headers["ETag"], images[1].headers["ETag"])

    def jobs(self, daemon):
        return daemon.request("GET", "/v1/jobs").json()["jobs"]

    def test_who_prefers_not_to_wait(self):
        with Daemon("--threads", "1") as daemon:
            for prefer in ("respond-async", "wait=0", "RESPOND-ASYNC, wait=1", "foo=1; x, wait=1", "wait=0, wait=60"):
                reply = self.render({**ENDLESS_PIXEL, "name": prefer}, "", {"Prefer": prefer}, 202, daemon)
                self.assertIn(reply.headers["Preference-Applied"], prefer.lower())
                job = reply.json()["id"]
                self.assertEqual(reply.headers["Location"], f"/v1/jobs/{job}")
                self.assertNotIn(daemon.status(job)["state"], ("completed", "canceled"))
                daemon.request("POST", f"/v1/jobs/{job}/cancel")
            reply = self.render(OBJ, "?width=8&samples=1", {"Prefer": "wait=60"}, 200, daemon)
            self.assertNotIn("Preference-Applied", reply.headers)

    def open_endless(self, daemon):
        """A connection on which an image without an end is waited for."""
        asked = daemon.log().count(": wanted")
        connection = daemon.connect()
        connection.request("POST", "/v1/render", json.dumps(ENDLESS_PIXEL), {"Content-Type": "application/json"})
        self.wait_for_log(daemon, ": wanted", asked + 1)
        return connection

    def wait_for_log(self, daemon, words, count):
        deadline = time.monotonic() + 60
        while daemon.log().count(words) < count:
            self.assertLess(time.monotonic(), deadline, daemon.log())
            time.sleep(0.005)

    def hang_up(self, daemon, connection):
        """Until the daemon knows."""
        gone = daemon.log().count("abandoned")
        connection.close()
        self.wait_for_log(daemon, "abandoned", gone + 1)

    def test_a_client_that_hangs_up_ends_its_job(self):
        with Daemon("--threads", "1", "--log-level", "debug") as daemon:
            self.hang_up(daemon, self.open_endless(daemon))
            self.assertEqual([job["state"] for job in self.jobs(daemon)], ["canceled"])
            # It was nobody else's wish: who asks now isn't told of it.
            self.hang_up(daemon, self.open_endless(daemon))
            self.assertEqual([job["state"] for job in self.jobs(daemon)], ["canceled"] * 2)

    def test_a_job_that_others_wait_for_goes_on(self):
        with Daemon("--threads", "1", "--log-level", "debug") as daemon:
            first, second = self.open_endless(daemon), self.open_endless(daemon)
            self.hang_up(daemon, first)
            self.assertNotIn(self.jobs(daemon)[0]["state"], ENDED)
            self.hang_up(daemon, second)
            self.assertEqual([job["state"] for job in self.jobs(daemon)], ["canceled"])

    def test_who_joined_while_a_job_was_made_ready_keeps_it(self):
        """A file that takes a while to read, asked for twice, and the first client goes meanwhile."""
        grid = b"".join(b"v %d %d 0\n" % (i % 500, i // 500) for i in range(250_000))
        grid += b"".join(b"f %d %d %d\n" % (i + 1, i + 2, i + 501) for i in range(249_000))
        with Daemon("--threads", "1", "--log-level", "debug") as daemon:
            connections = []
            for _ in range(2):
                connections.append(daemon.connect())
                connections[-1].request("POST", "/v1/render?width=8&samples=1", grid, {"Content-Type": "model/obj"})
            connections[0].close()
            self.assertEqual(Reply(connections[1].getresponse()).status, 200)
            states = [job["state"] for job in self.jobs(daemon)]
            self.assertEqual(states, ["completed"], daemon.log())

    def test_a_job_that_was_accepted_outlives_everybody(self):
        with Daemon("--threads", "1", "--log-level", "debug") as daemon:
            self.render(ENDLESS_PIXEL, "", {"Prefer": "respond-async"}, 202, daemon)
            self.hang_up(daemon, self.open_endless(daemon))
            self.assertNotIn(self.jobs(daemon)[0]["state"], ENDED)

    def test_no_thread_waits(self):
        """More clients than lanes have threads wait for an image; others are answered meanwhile."""
        with Daemon("--threads", "1", "--log-level", "debug") as daemon:
            waiting = []
            for i in range(20):
                connection = daemon.connect()
                body = json.dumps({**ENDLESS_PIXEL, "name": str(i)})
                connection.request("POST", "/v1/render", body, {"Content-Type": "application/json"})
                waiting.append(connection)
            self.wait_for_log(daemon, ": wanted", 20)
            self.assertEqual(daemon.request("POST", "/v1/scenes", SPHERE).status, 201)
            self.render(OBJ, "?width=8&samples=1", daemon=daemon)
            daemon.terminate()
            for connection in waiting:
                self.assertEqual(Reply(connection.getresponse()).status, 503)
                connection.close()
            self.assertEqual(daemon.stop(), 0)

    def test_nothing_of_a_large_file_stays(self):
        body = OBJ + b"# what takes its place on the disk\n" * 20000
        self.render(body, "?width=8&samples=1")
        self.assertEqual(os.listdir(os.path.join(self.daemon.data_dir, "blobs")), [])


if __name__ == "__main__":
    unittest.main()
