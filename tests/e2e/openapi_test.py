"""The OpenAPI document and the running daemon know the same routes, parameters, statuses and fields."""

import contextlib
import hashlib
import json
import os
import resource
import shutil
import socket
import sqlite3
import subprocess
import tempfile
import time
import unittest

import drake_test
from daemon import SOURCE, Daemon, Reply, bearer, make_key
from documents import ENDLESS_PIXEL, SMALL_JOB, SPHERE, keep_busy
from schema import faults, resolve

METHODS = ("get", "put", "post", "delete")
TRIANGLE = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
TRIANGLE += "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


def content_hash(data):
    return "sha256:" + hashlib.sha256(data).hexdigest()


class OpenApiTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with open(os.path.join(SOURCE, "proto", "openapi.json"), encoding="utf-8") as file:
            cls.document = json.load(file)

    def setUp(self):
        self.seen = set()

    def operations(self):
        for path, item in self.document["paths"].items():
            for method in METHODS:
                if method in item:
                    yield method, path, item[method]

    def test_routes_and_parameters(self):
        documented = set()
        for method, path, operation in self.operations():
            names = [parameter["name"] for parameter in operation.get("parameters", [])]
            documented.add(" ".join([method.upper(), path, *names]))
        printed = subprocess.run([os.environ["TESSERAD"], "--print-routes"], capture_output=True, text=True, check=True)
        self.assertEqual(documented, set(printed.stdout.splitlines()))

    def test_the_type_of_a_problem_leads_somewhere(self):
        with Daemon() as daemon:
            for page in daemon.request("GET", "/problems/").json()["problems"]:
                self.assertEqual(daemon.request("GET", page["type"]).json(), page)
            codes = self.document["components"]["schemas"]["Problem"]["properties"]["code"]["enum"]
            problem = daemon.request("GET", "/nothing").json()
            self.assertIn(problem["code"], codes)
            self.assertIn(b"<h1>", daemon.request("GET", problem["type"], headers={"Accept": "text/html,*/*;q=0.8"}).body)
            for path in daemon.request("GET", "/schemas/").json()["schemas"]:
                self.assertEqual(daemon.request("GET", path).media_type, "application/schema+json")

    def test_served_documents(self):
        with Daemon() as daemon:
            self.assertEqual(daemon.request("GET", "/openapi.json").json(), self.document)
            for name in ("scene.schema.json", "job.schema.json"):
                with open(os.path.join(SOURCE, "proto", "schemas", name), encoding="utf-8") as file:
                    self.assertEqual(daemon.request("GET", f"/schemas/{name}").json(), json.load(file))

    def check(self, method, template, reply):
        """A reply is what the document says of its status."""
        context = f"{method.upper()} {template} {reply.status}"
        responses = self.document["paths"][template][method]["responses"]
        self.assertIn(str(reply.status), responses, f"{context} isn't documented: {reply.body[:300]}")
        self.seen.add((method, template, str(reply.status)))
        response = resolve(self.document, responses[str(reply.status)])
        for name, header in response.get("headers", {}).items():
            header = resolve(self.document, header)
            if header.get("required") is False and name not in reply.headers:
                continue
            self.assertIn(name, reply.headers, context)
            value = reply.headers[name]
            value = int(value) if header["schema"].get("type") == "integer" else value
            self.assertEqual(faults(self.document, header["schema"], value, name), [], context)
        content = response.get("content", {})
        if not content:
            self.assertEqual(reply.body, b"", context)
            return
        self.assertIn(reply.media_type, content, context)
        if "json" in reply.media_type:
            self.assertEqual(faults(self.document, content[reply.media_type]["schema"], reply.json()), [], context)

    def ask(self, daemon, status, method, template, body=None, headers=None, query="", **parameters):
        """One request that has to be answered with this status, as documented."""
        reply = daemon.request(method.upper(), template.format(**parameters) + query, body, headers)
        self.assertEqual(reply.status, status, f"{method} {template}{query}: {reply.body[:500]}")
        self.check(method, template, reply)
        return reply

    def test_every_documented_response(self):
        self.exercise_documents()
        self.exercise_jobs()
        self.exercise_events()
        self.exercise_render()
        self.exercise_drake()
        self.exercise_bad_requests()
        self.exercise_strangers()
        self.exercise_full_disk()
        self.exercise_shutdown()
        documented = {
            (method, path, status)
            for method, path, operation in self.operations()
            for status in operation["responses"]
            if status != "default"
        }
        self.assertEqual(documented - self.seen, set(), "documented, and not seen in this test")

    def exercise_documents(self):
        """Blobs and scenes."""
        with tempfile.TemporaryDirectory() as root:
            asset = os.path.join(root, "triangle.ply")
            with open(asset, "w", encoding="ascii") as file:
                file.write(TRIANGLE)
            flags = ["--max-body", "2000", "--max-blob", "2000", "--scene-cache", "0", "--asset-root", root]
            with Daemon(*flags) as daemon:
                blob = b"some bytes"
                for status in (201, 200):
                    self.ask(daemon, status, "put", "/v1/blobs/{hash}", blob, hash=content_hash(blob))
                self.ask(daemon, 422, "put", "/v1/blobs/{hash}", b"others", hash=content_hash(blob))
                self.ask(daemon, 422, "put", "/v1/blobs/{hash}", blob, hash="md5:00")
                self.ask(daemon, 413, "put", "/v1/blobs/{hash}", b"x" * 2001, hash=content_hash(blob))

                scene = {"objects": [{"type": "file", "path": "triangle.ply"}]}
                reply = self.ask(daemon, 201, "post", "/v1/scenes", scene)
                self.ask(daemon, 200, "post", "/v1/scenes", scene)
                posted = reply.json()["scene"]
                self.assertEqual(self.ask(daemon, 200, "get", "/v1/scenes/{hash}", hash=posted).json(), reply.json())
                self.ask(daemon, 404, "get", "/v1/scenes/{hash}", hash=content_hash(b""))
                os.remove(os.path.join(daemon.data_dir, "blobs", content_hash(TRIANGLE.encode())[len("sha256:") :]))
                self.ask(daemon, 422, "get", "/v1/scenes/{hash}", hash=posted)

                as_json = {"Content-Type": "application/json"}
                for template in ("/v1/scenes", "/v1/jobs"):
                    self.ask(daemon, 422, "post", template, {"wrong": 1})
                    self.ask(daemon, 400, "post", template, "{", as_json)
                    self.ask(daemon, 413, "post", template, " " * 2001, as_json)
                    self.ask(daemon, 415, "post", template, "{}", {"Content-Type": "text/plain"})
        with Daemon() as daemon:
            key = {"Idempotency-Key": '"5"'}
            self.ask(daemon, 201, "post", "/v1/jobs", SMALL_JOB, key)
            self.ask(daemon, 200, "post", "/v1/jobs", SMALL_JOB, key)
            other = {"Idempotency-Key": '"6"', "Content-Type": "application/json"}
            with contextlib.closing(sqlite3.connect(os.path.join(daemon.data_dir, "journal.db"))) as journal:
                journal.execute("BEGIN IMMEDIATE")  # Until it is given back, the daemon can't write.
                first = daemon.connect()
                first.request("POST", "/v1/jobs", json.dumps(SMALL_JOB), other)
                while len(daemon.request("GET", "/v1/jobs").json()["jobs"]) < 2:
                    pass
                self.ask(daemon, 409, "post", "/v1/jobs", SMALL_JOB, other)
                journal.rollback()
            self.assertEqual(Reply(first.getresponse()).status, 201)
            first.close()
        with Daemon("--max-bodies", "10") as daemon:
            self.ask(daemon, 503, "post", "/v1/scenes", SPHERE)
            self.ask(daemon, 503, "post", "/v1/jobs", SMALL_JOB)
        self.exercise_deletion(content_hash(TRIANGLE.encode()))
        with Daemon() as daemon:
            resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (100, resource.RLIM_INFINITY))
            self.ask(daemon, 507, "put", "/v1/blobs/{hash}", TRIANGLE, hash=content_hash(TRIANGLE.encode()))
            self.ask(daemon, 507, "post", "/v1/scenes", SPHERE)
            self.ask(daemon, 507, "post", "/v1/render", TRIANGLE, query="?width=8&samples=1")
            shutil.rmtree(os.path.join(daemon.data_dir, "blobs"))
            self.ask(daemon, 503, "put", "/v1/blobs/{hash}", TRIANGLE, hash=content_hash(TRIANGLE.encode()))

    def exercise_deletion(self, blob):
        """Of a blob and of a scene that names it, by clients and by age."""
        scene = {"objects": [{"type": "file", "blob": blob, "format": "ply"}]}
        with tempfile.TemporaryDirectory() as data_dir:
            with Daemon("--threads", "1", data_dir=data_dir) as daemon:
                self.ask(daemon, 404, "delete", "/v1/blobs/{hash}", hash=blob)
                self.ask(daemon, 201, "put", "/v1/blobs/{hash}", TRIANGLE, hash=blob)
                posted = self.ask(daemon, 201, "post", "/v1/scenes", scene).json()["scene"]
                self.ask(daemon, 409, "delete", "/v1/blobs/{hash}", hash=blob)
                job = daemon.submit({"scene": posted, "image": {"width": 1, "height": 1}, "settings": {"samples": 2**32 - 1}})
                self.ask(daemon, 409, "delete", "/v1/scenes/{hash}", hash=posted)
                self.ask(daemon, 202, "post", "/v1/jobs/{id}/cancel", id=job)
                self.ask(daemon, 204, "delete", "/v1/scenes/{hash}", hash=posted)
                self.ask(daemon, 404, "delete", "/v1/scenes/{hash}", hash=posted)
                self.ask(daemon, 204, "delete", "/v1/blobs/{hash}", hash=blob)
                self.ask(daemon, 201, "put", "/v1/blobs/{hash}", TRIANGLE, hash=blob)
                self.ask(daemon, 201, "post", "/v1/scenes", scene)
            for folder in ("blobs", "scenes"):
                for name in os.listdir(os.path.join(data_dir, folder)):
                    os.utime(os.path.join(data_dir, folder, name), (0, 0))
            with Daemon("--max-blob-age", "1d", "--max-scene-age", "1d", data_dir=data_dir) as daemon:
                while os.path.exists(os.path.join(data_dir, "blobs", blob[len("sha256:") :])):
                    time.sleep(0.005)
                self.ask(daemon, 410, "get", "/v1/scenes/{hash}", hash=posted)
                self.ask(daemon, 410, "delete", "/v1/scenes/{hash}", hash=posted)
                self.ask(daemon, 410, "delete", "/v1/blobs/{hash}", hash=blob)

    def exercise_jobs(self):
        """One thread, and in the end a job that waits for it."""
        with Daemon("--threads", "1", "--max-jobs", "2") as daemon:
            done = self.ask(daemon, 201, "post", "/v1/jobs", SMALL_JOB).json()["id"]
            self.assertEqual(daemon.wait_ended(done)["state"], "completed")
            for path in ("", "/stats"):
                self.ask(daemon, 200, "get", f"/v1/jobs/{{id}}{path}", id=done)
            plan = self.ask(daemon, 200, "get", "/v1/jobs/{id}/plan", id=done).json()
            self.assertEqual(plan.keys(), self.document["components"]["schemas"]["Plan"]["properties"].keys())
            self.assertIs(plan["ready"], True)
            slabs = {"kind": "bvh", "bound": "slabs", "normals": [[1, 2, 3]]}
            counted = {**SMALL_JOB, "settings": {"accel": slabs, "count_tests": True}}
            counted = self.ask(daemon, 201, "post", "/v1/jobs", counted).json()["id"]
            self.assertEqual(daemon.wait_ended(counted)["state"], "completed")
            for path in ("/plan", "/stats"):
                self.ask(daemon, 200, "get", f"/v1/jobs/{{id}}{path}", id=counted)
            self.ask(daemon, 404, "get", "/v1/jobs/{id}/image", query="?aov=depth", id=done)
            self.ask(daemon, 406, "get", "/v1/jobs/{id}/image", headers={"Accept": "text/html"}, id=done)
            for media_type in ("image/png", "image/jpeg", "image/x-exr", "image/vnd.radiance"):
                reply = self.ask(daemon, 200, "get", "/v1/jobs/{id}/image", headers={"Accept": media_type}, id=done)
                self.assertEqual(reply.media_type, media_type)
            etag = {"If-None-Match": reply.headers["ETag"], "Accept": media_type}
            self.ask(daemon, 304, "get", "/v1/jobs/{id}/image", headers=etag, id=done)
            for status, part in ((206, "bytes=0-1"), (416, "bytes=999999999-")):
                self.ask(daemon, status, "get", "/v1/jobs/{id}/image", headers={"Range": part}, id=done)

            busy = keep_busy(daemon)
            waiting = self.ask(daemon, 201, "post", "/v1/jobs", {**SMALL_JOB, "priority": "low"}).json()["id"]
            plan = self.ask(daemon, 200, "get", "/v1/jobs/{id}/plan", id=waiting).json()
            self.assertEqual(plan, {"ready": False})
            self.ask(daemon, 200, "get", "/v1/jobs/{id}", id=waiting)
            self.ask(daemon, 200, "get", "/v1/jobs/{id}/stats", id=waiting)
            self.ask(daemon, 409, "get", "/v1/jobs/{id}/image", id=waiting)
            self.ask(daemon, 429, "post", "/v1/jobs", SMALL_JOB)
            self.ask(daemon, 200, "get", "/v1/jobs", query=f"?state=queued&after={busy}")
            self.ask(daemon, 200, "get", "/v1/jobs", query="?limit=1")
            self.ask(daemon, 200, "get", "/v1/jobs/{id}/stats", id=busy)
            self.ask(daemon, 200, "get", "/v1/jobs/{id}/image", query="?partial=1", id=busy)
            self.ask(daemon, 409, "delete", "/v1/jobs/{id}", id=busy)
            self.ask(daemon, 202, "post", "/v1/jobs/{id}/cancel", id=busy)
            self.ask(daemon, 409, "post", "/v1/jobs/{id}/cancel", id=busy)
            self.ask(daemon, 204, "delete", "/v1/jobs/{id}", id=busy)
            for method, path in [("delete", ""), ("post", "/cancel"), *(("get", p) for p in ("", "/plan", "/stats"))]:
                self.ask(daemon, 404, method, f"/v1/jobs/{{id}}{path}", id=busy)
            self.ask(daemon, 404, "get", "/v1/jobs/{id}/image", id=busy)

        with Daemon("--max-film-memory", str(16 * 16 * 12)) as daemon:
            gone = daemon.request("POST", "/v1/render?samples=1", SMALL_JOB).headers["Location"].rsplit("/", 1)[1]
            daemon.wait_ended(daemon.submit(SMALL_JOB))
            self.ask(daemon, 410, "get", "/v1/jobs/{id}/image", id=gone)
            self.ask(daemon, 200, "get", "/v1/jobs/{id}", id=gone)

        with Daemon("--max-ended-jobs", "1") as daemon:
            expired = daemon.submit(SMALL_JOB)
            daemon.wait_ended(expired)
            daemon.wait_ended(daemon.submit(SMALL_JOB))
            self.ask(daemon, 410, "delete", "/v1/jobs/{id}", id=expired)
            self.ask(daemon, 410, "post", "/v1/jobs/{id}/cancel", id=expired)
            for path in ("", "/plan", "/stats", "/image", "/events"):
                self.ask(daemon, 410, "get", f"/v1/jobs/{{id}}{path}", id=expired)

    def exercise_events(self):
        """One stream ends with its job, the others with the daemon."""
        with Daemon("--max-connections", "2") as daemon:
            job = daemon.submit(ENDLESS_PIXEL)
            first = daemon.connect()
            first.request("GET", "/v1/events")
            watching = first.getresponse()  # The connection is its own by now.
            watching.read(1)
            self.ask(daemon, 503, "get", "/v1/events")
            self.ask(daemon, 503, "get", "/v1/jobs/{id}/events", id=job)
            watching.close()
        with Daemon() as daemon:
            job = daemon.submit(SMALL_JOB)
            stream = self.ask(daemon, 200, "get", "/v1/jobs/{id}/events", id=job)
            ids = [line for line in stream.body.decode().splitlines() if line.startswith("id: ")]
            end = {"Last-Event-ID": ids[-1].removeprefix("id: ")}
            self.ask(daemon, 204, "get", "/v1/jobs/{id}/events", headers=end, id=job)
            self.ask(daemon, 404, "get", "/v1/jobs/{id}/events", id="0")
            endless = daemon.connect()
            endless.request("GET", "/v1/events")
            response = endless.getresponse()
            daemon.terminate()
            self.check("get", "/v1/events", Reply(response))
            endless.close()

    def exercise_render(self):
        """One thread, so that what comes after the endless waits."""
        render = ("post", "/v1/render")
        with Daemon("--threads", "1", "--max-jobs", "2", "--max-blob", "2000") as daemon:
            reply = self.ask(daemon, 200, *render, TRIANGLE, query="?width=8&samples=1")
            for media_type in ("image/jpeg", "image/x-exr", "image/vnd.radiance"):
                headers = {"Accept": media_type}
                self.assertEqual(
                    self.ask(daemon, 200, *render, TRIANGLE, headers, "?width=8&samples=1").media_type, media_type
                )
            self.ask(daemon, 304, *render, TRIANGLE, {"If-None-Match": reply.headers["ETag"]}, "?width=8&samples=1")
            self.ask(daemon, 400, *render, TRIANGLE, query="?width=0")
            self.ask(daemon, 406, *render, TRIANGLE, {"Accept": "text/html"})
            self.ask(daemon, 413, *render, TRIANGLE + " " * 2000)
            self.ask(daemon, 415, *render, "words")
            self.ask(daemon, 422, *render, {"objects": 1})
            endless = self.ask(daemon, 202, *render, ENDLESS_PIXEL, {"Prefer": "respond-async"})
            waiting = daemon.connect()
            body = json.dumps({**ENDLESS_PIXEL, "name": "2"})
            waiting.request("POST", "/v1/render", body, {"Content-Type": "application/json"})
            endless = [endless.json()["id"]]
            while len(endless) < 2:
                endless = [job["id"] for job in daemon.request("GET", "/v1/jobs").json()["jobs"][1:]]
            self.ask(daemon, 429, *render, TRIANGLE)
            for job in endless:
                self.ask(daemon, 202, "post", "/v1/jobs/{id}/cancel", id=job)
            reply = Reply(waiting.getresponse())
            waiting.close()
            self.assertEqual(reply.status, 409)
            self.check(*render, reply)
        with Daemon("--max-bodies", "10") as daemon:
            self.ask(daemon, 503, *render, TRIANGLE)

    def exercise_drake(self):
        kind = {"Content-Type": f"multipart/form-data; boundary={drake_test.BOUNDARY}"}
        gltf = drake_test.scene(drake_test.triangles(drake_test.wall(-1, -1, 1, 1, -2), [1, 0, 0]))
        body = drake_test.form(drake_test.fields("label", gltf))
        with Daemon("--drake") as daemon:
            self.ask(daemon, 200, "post", "/render", body, kind)
        with Daemon("--drake", "--max-bodies", "10") as daemon:
            self.ask(daemon, 500, "post", "/render", body, kind)

    def exercise_bad_requests(self):
        """Everything answers; nothing takes a query parameter that isn't documented."""
        with Daemon("--drake") as daemon:
            for media_type in ("application/json", "text/html"):
                for path in ("/problems/", "/problems/{code}"):
                    reply = self.ask(daemon, 200, "get", path, headers={"Accept": media_type}, code="not_found")
                    self.assertEqual(reply.media_type, media_type)
            self.ask(daemon, 404, "get", "/problems/{code}", code="nothing")
            for method, template, _ in self.operations():
                if "{" not in template and method == "get" and template != "/v1/events":
                    self.ask(daemon, 200, method, template)
                path = template.format(hash=content_hash(b""), id="0", code="not_found")
                headers = {"Content-Type": "application/json"}
                self.check(method, template, daemon.request(method.upper(), path + "?no_such=1", headers=headers))
                self.assertIn((method, template, "400"), self.seen)
                head = daemon.request("PATCH", path)
                self.assertEqual((head.status, head.media_type), (405, "application/problem+json"))
                self.assertIn(method.upper(), head.headers["Allow"].split(", "))
                options = daemon.request("OPTIONS", path)
                self.assertEqual((options.status, options.headers["Allow"]), (204, head.headers["Allow"]))

    def exercise_strangers(self):
        """What anybody is told, of every route."""
        with Daemon("--drake") as daemon:
            for method, template, _ in self.operations():
                names = {"hash": content_hash(b""), "id": "0", "code": "not_found"}
                self.ask(daemon, 421, method, template, headers={"Host": "evil.example"}, **names)
                if method != "get":
                    self.ask(daemon, 403, method, template, headers={"Origin": "http://evil.example"}, **names)
        with tempfile.TemporaryDirectory() as data_dir:
            reader, sender = make_key(data_dir, "--scope", "read"), make_key(data_dir, "--scope", "submit")
            once = make_key(data_dir, "--requests-per-second", "0.001")
            with Daemon("--drake", data_dir=data_dir) as daemon:
                self.assertEqual(daemon.request("GET", "/v1/version", headers=bearer(once)).status, 200)
                for method, template, operation in self.operations():
                    names = {"hash": content_hash(b""), "id": "0", "code": "not_found"}
                    if operation.get("security") == []:
                        continue
                    self.ask(daemon, 401, method, template, **names)
                    other = sender if method == "get" else reader
                    reply = self.ask(daemon, 403, method, template, headers=bearer(other), **names)
                    self.assertIn("insufficient_scope", reply.headers["WWW-Authenticate"])
                    self.ask(daemon, 429, method, template, headers=bearer(once), **names)

    def exercise_full_disk(self):
        """As good as full: no file may grow, whatever writes it."""
        with Daemon() as daemon:
            ended, endless = daemon.submit(SMALL_JOB), daemon.submit(ENDLESS_PIXEL)
            daemon.wait_ended(ended)
            with daemon.full_disk():
                self.ask(daemon, 507, "post", "/v1/jobs", SMALL_JOB)
                self.ask(daemon, 507, "post", "/v1/render", ENDLESS_PIXEL, {"Prefer": "respond-async"})
                self.ask(daemon, 507, "delete", "/v1/jobs/{id}", id=ended)
                self.ask(daemon, 507, "post", "/v1/jobs/{id}/cancel", id=endless)
            self.ask(daemon, 204, "delete", "/v1/jobs/{id}", id=ended)

    def exercise_shutdown(self):
        """While one request is still being sent, another hears that the daemon is about to stop."""
        with Daemon() as daemon:
            body = json.dumps(SMALL_JOB).encode()
            head = f"POST /v1/jobs HTTP/1.1\r\nHost: {daemon.host}\r\nContent-Type: application/json\r\n"
            head += f"Expect: 100-continue\r\nContent-Length: {len(body)}\r\n\r\n"
            other = daemon.connect()
            with socket.create_connection((daemon.host, daemon.port), timeout=60) as half_sent:
                half_sent.sendall(head.encode())
                self.assertTrue(half_sent.recv(1000).startswith(b"HTTP/1.1 100 "))  # It is in progress now.
                other.request("GET", "/livez")
                other.getresponse().read()
                daemon.terminate()
                status = 200
                while status == 200:  # Until the signal has arrived.
                    other.request("GET", "/readyz")
                    reply = Reply(other.getresponse())
                    status = reply.status
                self.check("get", "/readyz", reply)
                half_sent.sendall(body)
                self.assertTrue(half_sent.recv(1000).startswith(b"HTTP/1.1 503 "))
            other.close()
            self.assertEqual(daemon.stop(), 0)


if __name__ == "__main__":
    unittest.main()
