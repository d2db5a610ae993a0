"""What is wrong is refused with a 4xx that names the place; the daemon goes on."""

import hashlib
import json
import os
import re
import socket
import tempfile
import time
import unittest

from daemon import Daemon, shared_data
from documents import SMALL_JOB, SPHERE

AS_JSON = {"Content-Type": "application/json"}
TRIANGLE = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)
MESH = {"type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]}


class BadInputTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.assets = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.assets.cleanup)
        cls.daemon = Daemon("--max-body", "1MiB", "--max-blob", "1MiB", "--asset-root", cls.assets.name)
        cls.addClassCleanup(cls.daemon.stop)

    def tearDown(self):
        self.assertEqual(self.daemon.request("GET", "/readyz").status, 200, self.daemon.log())

    def refused(self, status, code, method, path, body=None, headers=None):
        reply = self.daemon.request(method, path, body, headers)
        self.assertEqual(reply.status, status, reply.body[:500])
        self.assertEqual(reply.media_type, "application/problem+json")
        self.assertEqual(reply.json()["code"], code)
        self.assertEqual(reply.json()["status"], status)
        return reply.json()

    def refused_scene(self, scene, *pointers):
        """Refused as a scene, and as the scene of a job, for faults at these places."""
        problem = self.refused(422, "invalid_document", "POST", "/v1/scenes", scene)
        self.assertEqual([error["pointer"] for error in problem["errors"]], list(pointers), problem)
        self.assertTrue(all(error["detail"] for error in problem["errors"]))
        problem = self.refused(422, "invalid_document", "POST", "/v1/jobs", {"scene": scene})
        self.assertEqual([error["pointer"] for error in problem["errors"]], ["/scene" + p for p in pointers])

    def refused_object(self, thing, *pointers):
        self.refused_scene({"objects": [thing]}, *("/objects/0" + pointer for pointer in pointers))

    def test_the_json_test_suite(self):
        folder = shared_data("json-test-suite", "test_parsing")
        expected = {"y": {422}, "n": {400}, "i": {400, 422}}
        names = sorted(os.listdir(folder))
        self.assertEqual(len(names), 318)
        for name in names:
            with open(os.path.join(folder, name), "rb") as file:
                body = file.read()
            for path in ("/v1/scenes", "/v1/jobs"):
                with self.subTest(name, path=path):
                    reply = self.daemon.request("POST", path, body, AS_JSON)
                    self.assertIn(reply.status, expected[name[0]], reply.body[:300])
                    self.assertEqual(reply.media_type, "application/problem+json")

    def test_deep_nesting(self):
        for body in ("[" * 100_000, "[" * 100_000 + "]" * 100_000, '{"a":' * 100_000 + "1" + "}" * 100_000):
            for path in ("/v1/scenes", "/v1/jobs"):
                self.refused(400, "malformed_json", "POST", path, body, AS_JSON)

    def test_an_image_of_a_thousand_million_pixels(self):
        for size in ({"width": 31623, "height": 31623}, {"width": 1_000_000_000, "height": 1}):
            problem = self.refused(422, "invalid_document", "POST", "/v1/jobs", {"scene": SPHERE, "image": size})
            self.assertTrue(problem["errors"][0]["pointer"].startswith("/image"), problem)

    def test_an_image_that_the_server_has_no_memory_for(self):
        with Daemon("--max-film-memory", "1300000") as daemon:
            job = {"scene": SPHERE, "image": {"width": 1000, "height": 1000}}
            reply = daemon.request("POST", "/v1/jobs", job)
            self.assertEqual((reply.status, reply.json()["errors"][0]["pointer"]), (413, "/image"))
            half = {"scene": SPHERE, "image": {"width": 250, "height": 200}}  # 12 bytes a pixel, 24 between passes.
            ended = daemon.submit(half)
            self.assertEqual(daemon.wait_ended(ended)["image"], "complete")
            endless = {**half, "settings": {"samples": 100_000}}
            waited_for = daemon.request("POST", "/v1/render?samples=1", half).headers["Location"]
            busy = daemon.submit(endless)  # The images of those that have ended give way,
            self.assertEqual(daemon.status(ended)["image"], "complete", "and is on the disk")
            self.assertEqual(daemon.request("GET", f"/v1/jobs/{ended}/image").status, 200)
            self.assertEqual(daemon.request("GET", waited_for).json()["image"], "gone")
            for query in ("", "?partial=1", "?format=exr"):
                gone = daemon.request("GET", f"{waited_for}/image{query}", headers={"If-None-Match": "*"})
                self.assertEqual((gone.status, gone.json()["code"]), (410, "image_gone"))
            reply = daemon.request("POST", "/v1/jobs", half)  # that of one that hasn't doesn't.
            self.assertEqual((reply.status, reply.json()["code"]), (503, "out_of_memory_budget"))
            self.assertEqual(reply.headers["Retry-After"], "1")
            ready = daemon.request("GET", "/readyz")
            self.assertEqual((ready.status, ready.json()["code"]), (503, "not_ready"))
            self.assertEqual(ready.headers["Retry-After"], "1")
            self.assertEqual(daemon.request("GET", "/livez").status, 200)
            self.assertEqual(daemon.request("POST", f"/v1/jobs/{busy}/cancel").status, 202)
            deadline = time.monotonic() + 60  # Its sums are there until its threads have left them.
            while daemon.request("GET", "/readyz").status == 503 and time.monotonic() < deadline:
                pass
            self.assertEqual(daemon.request("GET", "/readyz").status, 200)
            self.assertEqual(daemon.wait_ended(daemon.submit(half))["image"], "complete")

    def test_an_image_that_no_format_can_hold(self):
        """Beyond 2^31 - 1 columns there is none: told before it is rendered."""
        with Daemon("--max-pixels", str(1 << 33), "--max-film-memory", "1TiB") as daemon:
            job = {"scene": SPHERE, "image": {"width": 1 << 31, "height": 1}, "settings": {"aovs": ["depth"]}}
            for size in ({"width": 1 << 31, "height": 1}, {"width": 1, "height": 1 << 31}):
                reply = daemon.request("POST", "/v1/jobs", {**job, "image": size})
                self.assertEqual((reply.status, reply.json()["code"]), (422, "invalid_document"))
                errors = reply.json()["errors"]
                self.assertEqual([error["pointer"] for error in errors], ["/image", "/image"])
                self.assertTrue(all("fits into no format" in error["detail"] for error in errors), errors)

    def test_wrong_fields_all_at_once(self):
        scene = {"objects": [{"type": "sphere", "center": [0, 0], "radius": -1}, {"type": "blob"}], "colour": 1}
        problem = self.refused(422, "invalid_document", "POST", "/v1/scenes", scene)
        pointers = {error["pointer"] for error in problem["errors"]}
        for pointer in ("/colour", "/objects/0/center", "/objects/0/radius"):
            self.assertIn(pointer, pointers)

    def refused_settings(self, settings, pointer, scene=SPHERE):
        """Whether the scene comes with the job or was posted before."""
        posted = self.daemon.request("POST", "/v1/scenes", scene).json()["scene"]
        for named in (scene, posted):
            job = {"scene": named, "image": {"width": 4, "height": 4}, "settings": settings}
            problem = self.refused(422, "invalid_document", "POST", "/v1/jobs", job)
            self.assertEqual([error["pointer"] for error in problem["errors"]], [pointer], problem)

    def test_light_that_cant_be(self):
        def material(rest):
            return {"objects": [], "materials": {"m": {"type": "dielectric", "ior": 1.5, **rest}}}

        for rest, pointer in (({"roughness": 1.1}, "/roughness"), ({"roughness": -0.1}, "/roughness"), ({"ior": 0}, "/ior"),
                              ({"emission": [0, -1, 0]}, "/emission/1"), ({"alpha": 2}, "/alpha")):
            self.refused_scene(material(rest), "/materials/m" + pointer)
        spot = {"type": "spot", "position": [0, 1, 0], "direction": [0, -1, 0], "intensity": [1, 1, 1], "outer_angle": 20}
        self.refused_scene({"objects": [], "lights": [{**spot, "inner_angle": 21}]}, "/lights/0/inner_angle")
        self.refused_scene({"objects": [], "lights": [{"type": "environment"}] * 2}, "/lights/1")
        camera = {"type": "perspective", "from": [0, 0, 5], "at": [0, 0, 0]}
        for rest, pointer in (({"lens": {"radius": 0.1, "focus_distance": -1}}, "/lens/focus_distance"),
                              ({"near": 2, "far": 1}, "/far"), ({"near": 1, "far": 1}, "/far")):
            self.refused_scene({"objects": [], "camera": {**camera, **rest}}, "/camera" + pointer)

    def test_settings_that_cant_be(self):
        for settings, pointer in (({"until": {}}, "/until"), ({"until": {"error": 0}}, "/until/error"),
                                  ({"until": {"seconds": -1}}, "/until/seconds"), ({"until": {"samples": 0}}, "/until/samples"),
                                  ({"until": {"error": 0.1}, "samples": 4}, "/samples"),
                                  ({"integrator": "ambient_occlusion", "sampler": "grid"}, "/sampler")):
            self.refused_settings(settings, "/settings" + pointer)

    def test_an_integrator_that_doesnt_suit_the_scene(self):
        ambient = {"type": "ambient", "radiance": [1, 1, 1]}
        ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
        lamp = {"m": {"type": "diffuse", "color": [0, 0, 0], "emission": [1, 1, 1]}}
        self.refused_settings({"integrator": "whitted"}, "/settings/integrator", {"objects": [ball], "materials": lamp})
        self.refused_settings({"integrator": "path"}, "/settings/integrator")  # SPHERE has an ambient light.
        self.refused_settings({}, "/settings/integrator", {"objects": [ball], "materials": lamp, "lights": [ambient]})

    def test_numbers_and_indices(self):
        self.refused_object({**MESH, "triangles": [[0, 1, 3]]}, "/triangles/0/2")
        self.refused_object({"type": "sphere", "center": [0, 0, "x"], "radius": 1}, "/center/2")
        for text in (b'{"objects": [{"type": "sphere", "center": [0, 0, NaN], "radius": 1}]}', b"\xff\xfe{"):
            self.refused(400, "malformed_json", "POST", "/v1/scenes", text, AS_JSON)

    def test_a_job_for_a_scene_that_isnt_there(self):
        unknown = "sha256:" + "0" * 64
        problem = self.refused(422, "invalid_document", "POST", "/v1/jobs", {"scene": unknown})
        self.assertEqual([error["pointer"] for error in problem["errors"]], ["/scene"])

    def test_a_job_for_a_scene_whose_files_have_gone_since(self):
        with tempfile.TemporaryDirectory() as root, Daemon("--scene-cache", "0", "--asset-root", root) as daemon:
            names = ("a.ply", "b.ply")
            for name in names:
                with open(os.path.join(root, name), "w", encoding="ascii") as file:
                    file.write(TRIANGLE)
            scene = {"objects": [{"type": "file", "path": name} for name in names]}
            posted = daemon.request("POST", "/v1/scenes", scene).json()["scene"]
            for name in names:
                os.remove(os.path.join(root, name))
            job = {"scene": posted, "image": {"width": 8, "height": 8}}
            self.assertEqual(daemon.wait_ended(daemon.submit(job))["state"], "completed", "they were kept with it")

    def test_files_that_arent_there(self):
        self.refused_object({"type": "file", "path": "none.obj"}, "/path")
        self.refused_object({"type": "file", "format": "obj", "blob": "sha256:" + "0" * 64}, "/blob")

    def test_paths_that_leave_the_asset_root(self):
        root = self.assets.name
        with tempfile.TemporaryDirectory() as outside:
            secret = os.path.join(outside, "secret.obj")
            with open(secret, "w", encoding="ascii") as file:
                file.write("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
            os.symlink(secret, os.path.join(root, "link.obj"))
            os.symlink(outside, os.path.join(root, "folder"))
            os.mkfifo(os.path.join(root, "pipe.obj"))
            os.mkdir(os.path.join(root, "inside.obj"))
            climbing = os.path.relpath(secret, root)
            for path in (climbing, "x/../../" + climbing, secret, "link.obj", "folder/secret.obj", "pipe.obj",
                         "inside.obj", "", ".", "..", "a\0.obj"):
                with self.subTest(path=path):
                    self.refused_object({"type": "file", "path": path, "format": "obj"}, "/path")

    def test_without_an_asset_root_no_path_is_taken(self):
        with Daemon() as daemon:
            reply = daemon.request("POST", "/v1/scenes", {"objects": [{"type": "file", "path": "a.obj"}]})
            self.assertEqual((reply.status, reply.json()["errors"][0]["pointer"]), (422, "/objects/0/path"))

    def test_blobs(self):
        blob, other = b"one", b"two"
        path = "/v1/blobs/sha256:" + hashlib.sha256(blob).hexdigest()
        self.refused(422, "hash_mismatch", "PUT", path, other)
        problem = self.refused(422, "invalid_document", "PUT", path.replace("sha256", "SHA256"), blob)
        mend = "Write sha256: and 64 lower-case hexadecimal digits."
        self.assertEqual(problem["errors"], [{"pointer": "{hash}", "detail": mend}])
        self.refused(413, "payload_too_large", "PUT", path, b"x" * ((1 << 20) + 1))
        pieces = (b"x" * 4096 for _ in range(300))  # Chunked: its length isn't announced.
        self.refused(413, "payload_too_large", "PUT", path, pieces)
        self.assertEqual(os.listdir(os.path.join(self.daemon.data_dir, "blobs")), [])

    def test_documents_that_arent_taken(self):
        for path in ("/v1/scenes", "/v1/jobs"):
            body = json.dumps(SMALL_JOB)
            self.refused(413, "payload_too_large", "POST", path, " " * ((1 << 20) + 1), AS_JSON)
            self.refused(415, "unsupported_media_type", "POST", path, body, {"Content-Type": "text/json"})
            self.refused(415, "unsupported_media_type", "POST", path, body, {**AS_JSON, "Content-Encoding": "gzip"})
            self.refused(400, "malformed_json", "POST", path, "", AS_JSON)

    def test_requests_that_make_no_sense(self):
        self.refused(404, "not_found", "GET", "/v2/jobs")
        self.refused(404, "not_found", "GET", "/v1/jobs/")
        self.refused(404, "not_found", "GET", "/v1/jobs/../jobs")
        self.refused(404, "not_found", "GET", "/v1/jobs/%2e%2e%2f%00")
        self.refused(400, "malformed_request", "GET", "/v1/jobs/%zz")
        self.refused(400, "malformed_request", "GET", "/v1/jobs?limit=0")
        self.refused(400, "malformed_request", "GET", "/v1/jobs?limit=ten")
        self.refused(400, "malformed_request", "GET", "/v1/jobs?limit=1&limit=2")
        self.refused(400, "malformed_request", "GET", "/v1/jobs?state=done")
        self.refused(400, "malformed_request", "GET", "/v1/jobs?Limit=1")
        for query, wrong in (("Limit=1&page=2", ["?Limit", "?page"]), ("state=done&limit=0", ["?limit", "?state"])):
            problem = self.refused(400, "malformed_request", "GET", f"/v1/jobs?{query}")
            self.assertEqual([error["pointer"] for error in problem["errors"]], wrong)
        self.refused(400, "malformed_request", "POST", "/v1/jobs/0/cancel", "why")
        self.refused(405, "method_not_allowed", "DELETE", "/v1/scenes")


class RawRequestTest(unittest.TestCase):
    """Bytes that no HTTP library would send; http_test has more."""

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--timeout", "1")
        cls.addClassCleanup(cls.daemon.stop)

    def tearDown(self):
        self.assertEqual(self.daemon.request("GET", "/livez").status, 200, self.daemon.log())

    def exchange(self, *pieces, half_close=False):
        """Sends bytes; everything that comes back until the daemon closes the connection."""
        with socket.create_connection((self.daemon.host, self.daemon.port), timeout=30) as connection:
            for piece in pieces:
                connection.sendall(piece)
            if half_close:
                connection.shutdown(socket.SHUT_WR)
            answer = b""
            while piece := connection.recv(65536):
                answer += piece
            return answer

    def test_requests_that_break_off(self):
        whole = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 50\r\n\r\n{"
        for length in (1, 20, 60, len(whole)):
            with self.subTest(length=length):
                answer = self.exchange(whole[:length], half_close=True)
                self.assertTrue(answer.startswith(b"HTTP/1.1 400 "), answer)

    def test_pipelined_requests_are_answered_in_order(self):
        body = json.dumps({"wrong": 1}).encode()
        one = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n%b"
        requests = [b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n", one % (len(body), body),
                    b"HEAD /v1/version HTTP/1.1\r\nHost: localhost\r\n\r\n",
                    b"GET http://localhost/readyz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"]
        answer = self.exchange(b"".join(requests))
        statuses = re.findall(rb"^HTTP/1.1 (\d+) ", answer, re.MULTILINE)
        self.assertEqual(statuses, [b"200", b"422", b"200", b"200"])
        self.assertIn(b'"status":"ready"}', answer)


if __name__ == "__main__":
    unittest.main()
