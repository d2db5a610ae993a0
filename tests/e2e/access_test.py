"""Who may use the daemon, and for what: a stranger with a browser comes first."""

import concurrent.futures
import hashlib
import json
import os
import shutil
import signal
import socket
import stat
import subprocess
import tempfile
import time
import unittest

from daemon import Daemon, bearer, make_key
from documents import ENDLESS_PIXEL, SMALL_JOB, SPHERE
from openapi_test import TRIANGLE, content_hash

PAGE = "https://shop.example"
EVIL = "http://evil.example"


class BrowserTest(unittest.TestCase):
    """A page that is open in a browser on this machine."""

    def test_a_name_of_its_own_leads_nowhere(self):
        with Daemon() as daemon:
            job = daemon.submit(SMALL_JOB)
            for host in ("evil.example", f"evil.example:{daemon.port}", "", "0.0.0.0"):
                for method, path in (("GET", "/v1/jobs"), ("GET", f"/v1/jobs/{job}/image"), ("GET", "/livez"),
                                     ("GET", "/openapi.json"), ("POST", "/v1/jobs"), ("OPTIONS", "/v1/jobs")):
                    reply = daemon.request(method, path, headers={"Host": host})
                    self.assertEqual((reply.status, reply.json()["code"]), (421, "misdirected_request"), (host, path))
                    self.assertNotIn("Access-Control-Allow-Origin", reply.headers)
            for host in ("localhost", "LOCALHOST:1", f"127.0.0.1:{daemon.port}", "[::1]:8080"):
                self.assertEqual(daemon.request("GET", "/v1/jobs", headers={"Host": host}).status, 200, host)

    def test_the_server_has_the_names_that_it_is_given(self):
        environment = {"TESSERA_HOST_NAME": "render.example,other.example"}
        with Daemon(env=environment) as daemon:
            for host, status in (("render.example", 200), ("other.example:443", 200), ("example", 421)):
                self.assertEqual(daemon.request("GET", "/livez", headers={"Host": host}).status, status, host)
        with Daemon("--host-name", "flag.example", env=environment) as daemon:  # A flag wins over the environment.
            for host, status in (("flag.example", 200), ("render.example", 421)):
                self.assertEqual(daemon.request("GET", "/livez", headers={"Host": host}).status, status, host)

    def test_a_page_can_change_nothing(self):
        with Daemon() as daemon:
            job = daemon.submit(SMALL_JOB)
            daemon.wait_ended(job)
            same = {"Origin": daemon.url, "Sec-Fetch-Site": "same-origin"}
            requests = [("POST", "/v1/render", "words", {"Content-Type": "text/plain"}),
                        ("POST", "/v1/jobs", SMALL_JOB, {}), ("DELETE", f"/v1/jobs/{job}", None, {}),
                        ("POST", f"/v1/jobs/{job}/cancel", None, {})]
            for foreign in ({"Origin": EVIL}, {"Origin": "null"}, {"Sec-Fetch-Site": "cross-site"},
                            {"Origin": "http://127.0.0.1:1"}, {"Origin": EVIL, "Sec-Fetch-Site": "same-site"}):
                for method, path, body, headers in requests:
                    reply = daemon.request(method, path, body, {**headers, **foreign})
                    self.assertEqual((reply.status, reply.json()["code"]), (403, "forbidden"), (foreign, path))
                    self.assertNotIn("Access-Control-Allow-Origin", reply.headers)
                reply = daemon.request("GET", "/v1/jobs", headers=foreign)  # What the browser keeps from the page.
                self.assertEqual(reply.status, 200)
                self.assertNotIn("Access-Control-Allow-Origin", reply.headers)
            self.assertEqual(len(daemon.request("GET", "/v1/jobs").json()["jobs"]), 1)
            self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB, same).status, 201)
            self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{job}", headers=same).status, 204)

    def test_a_page_that_is_named_may(self):
        with Daemon("--cors-origin", PAGE, "--cors-origin", "http://localhost:3000") as daemon:
            asked = {"Access-Control-Request-Method": "DELETE", "Access-Control-Request-Headers": "authorization"}
            reply = daemon.request("OPTIONS", "/v1/jobs/0", headers={"Origin": PAGE, **asked})
            self.assertEqual(reply.status, 204)
            self.assertEqual(reply.headers["Access-Control-Allow-Origin"], PAGE)
            self.assertIn("DELETE", reply.headers["Access-Control-Allow-Methods"].split(", "))
            self.assertEqual(reply.headers["Access-Control-Allow-Headers"], "authorization")
            self.assertIn("Origin", ", ".join(reply.headers.get_all("Vary")))
            reply = daemon.request("POST", "/v1/jobs", SMALL_JOB, {"Origin": PAGE, "Sec-Fetch-Site": "cross-site"})
            self.assertEqual((reply.status, reply.headers["Access-Control-Allow-Origin"]), (201, PAGE))
            self.assertIn("Location", reply.headers["Access-Control-Expose-Headers"])
            refused = daemon.request("GET", "/v1/jobs/0", headers={"Origin": "http://localhost:3000"})
            self.assertEqual(refused.status, 404)  # Which the page can read, too.
            self.assertEqual(refused.headers["Access-Control-Allow-Origin"], "http://localhost:3000")

            for origin in (EVIL, PAGE + ".evil.example", "https://SHOP.example", "http://shop.example", "null"):
                reply = daemon.request("OPTIONS", "/v1/jobs/0", headers={"Origin": origin, **asked})
                for name in ("Access-Control-Allow-Origin", "Access-Control-Allow-Methods"):
                    self.assertNotIn(name, reply.headers, origin)
                self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB, {"Origin": origin}).status, 403, origin)
            self.assertEqual(daemon.request("GET", "/livez").headers["Vary"], "Origin")

    def test_settings_that_make_no_sense_are_refused(self):
        for flags in (("--host-name", "a/b"), ("--host-name", "a:80"), ("--host-name", ""), ("--cors-origin", "*"),
                      ("--cors-origin", "https://a/"), ("--cors-origin", "null"), ("--cors-origin", "https://A.example")):
            with self.assertRaises(RuntimeError) as raised:
                Daemon(*flags).stop()
            self.assertIn(flags[0], str(raised.exception))


def tool(*arguments, env=None):
    """Runs the client; what came of it."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith("TESSERA_")}
    return subprocess.run([os.environ["TESSERA"], *arguments], capture_output=True, text=True, check=False,
                          env={**clean, **(env or {})})


def routes():
    """Method and path of all of them."""
    printed = subprocess.run([os.environ["TESSERAD"], "--print-routes"], capture_output=True, text=True, check=True)
    for line in printed.stdout.splitlines():
        method, pattern = line.split()[:2]
        yield method, pattern.replace("{hash}", content_hash(b"")).replace("{code}", "not_found").replace("{id}", "0")


PUBLIC = ("/livez", "/readyz", "/openapi.json", "/schemas/", "/problems/")


class FolderTest(unittest.TestCase):
    """Each test has a data folder of its own."""

    def setUp(self):
        self.data_dir = tempfile.mkdtemp(prefix="tessera-keys-")
        self.addCleanup(shutil.rmtree, self.data_dir, ignore_errors=True)


class KeysTest(FolderTest):
    def hang_up(self, daemon, expected):
        """Has the daemon read its keys again."""
        seen = daemon.log().count("SIGHUP: " + expected)
        daemon.process.send_signal(signal.SIGHUP)
        deadline = time.monotonic() + 60
        while daemon.log().count("SIGHUP: " + expected) == seen:
            self.assertLess(time.monotonic(), deadline, daemon.log())
            time.sleep(0.005)

    def test_strangers_are_told_nothing(self):
        key = make_key(self.data_dir, "--scope", "admin")
        with Daemon(data_dir=self.data_dir) as daemon:
            wrong = [{}, {"Authorization": "Bearer"}, {"Authorization": f"Basic {key}"}, {"Authorization": key},
                     bearer(key[:-1]), bearer(key + "a"), bearer(f"{key}, {key}"), bearer(key.swapcase()),
                     bearer("tsk_000000000000_" + "0" * 43)]
            for method, path in routes():
                if path == "/render":
                    continue
                if path.startswith(PUBLIC):
                    self.assertEqual(daemon.request(method, path).status, 200, path)
                    continue
                for headers in wrong:
                    reply = daemon.request(method, path, headers=headers)
                    self.assertEqual((reply.status, reply.json()["code"]), (401, "unauthorized"), (method, path))
                    challenge = reply.headers["WWW-Authenticate"]
                    self.assertRegex(challenge, '^Bearer realm="tessera"')
                    self.assertEqual("invalid_token" in challenge, "Authorization" in headers)
                    self.assertNotIn(key[20:], reply.body.decode())
                if path != "/v1/events":  # Which doesn't end.
                    status = daemon.request(method, path, headers=bearer(key)).status
                    self.assertNotIn(status, (401, 403), (method, path))
            head = daemon.request("HEAD", "/v1/jobs")
            self.assertEqual((head.status, head.body), (401, b""))

    def test_a_body_without_a_key_is_not_read(self):
        make_key(self.data_dir)
        with Daemon(data_dir=self.data_dir) as daemon, socket.create_connection(
            (daemon.host, daemon.port), timeout=60
        ) as connection:
            connection.sendall(b"PUT /v1/blobs/sha256:" + b"0" * 64 + b" HTTP/1.1\r\nHost: localhost\r\n"
                               b"Content-Length: 1000000\r\nExpect: 100-continue\r\n\r\n")
            self.assertRegex(connection.recv(1000), b"^HTTP/1.1 401 ")

    def test_scopes(self):
        keys = {scope: make_key(self.data_dir, "--scope", scope) for scope in ("read", "submit", "admin")}
        with Daemon(data_dir=self.data_dir) as daemon:
            requests = (("GET", "/v1/jobs", None, "read", 200), ("POST", "/v1/jobs", SMALL_JOB, "submit", 201),
                        ("GET", "/v1/capabilities", None, "read", 200), ("DELETE", "/v1/jobs/0", None, "submit", 404))
            for method, path, body, needed, status in requests:
                for scope, key in keys.items():
                    reply = daemon.request(method, path, body, bearer(key))
                    if scope in (needed, "admin"):
                        self.assertEqual(reply.status, status, (path, scope))
                        continue
                    self.assertEqual((reply.status, reply.json()["code"]), (403, "forbidden"), (path, scope))
                    self.assertIn(f'error="insufficient_scope", scope="{needed}"', reply.headers["WWW-Authenticate"])

    def test_keys_come_and_go(self):
        with Daemon(data_dir=self.data_dir) as daemon:
            self.assertEqual(daemon.request("GET", "/v1/jobs").status, 200)
            key, other = make_key(self.data_dir), make_key(self.data_dir, "--days", "1")
            self.assertEqual(daemon.request("GET", "/v1/jobs").status, 200)  # It notices nothing by itself.
            self.hang_up(daemon, "there are 2 keys")
            self.assertEqual(daemon.request("GET", "/v1/jobs").status, 401)
            self.assertEqual(daemon.request("GET", "/v1/jobs", headers=bearer(key)).status, 200)

            listed = json.loads(tool("keys", "list", "--data-dir", self.data_dir, "--json").stdout)
            self.assertEqual([entry["state"] for entry in listed], ["valid", "valid"])
            revoked = tool("keys", "revoke", listed[0]["id"], "--data-dir", self.data_dir)
            self.assertEqual(revoked.returncode, 0, revoked.stderr)
            self.hang_up(daemon, "there are 2 keys")
            self.assertEqual(daemon.request("GET", "/v1/jobs", headers=bearer(key)).status, 401)
            self.assertEqual(daemon.request("GET", "/v1/jobs", headers=bearer(other)).status, 200)

            with open(os.path.join(self.data_dir, "keys.json"), "w", encoding="ascii") as file:
                file.write("{")
            self.hang_up(daemon, "the keys stay as they are")
            self.assertEqual(daemon.request("GET", "/v1/jobs", headers=bearer(other)).status, 200)
            os.remove(os.path.join(self.data_dir, "keys.json"))
            self.hang_up(daemon, "there are 0 keys")
            self.assertEqual(daemon.request("GET", "/v1/jobs").status, 401)  # Not open again by accident.

    def test_the_tool(self):
        key = make_key(self.data_dir, "--name", "for\x1b a test", owner="alice@example.org")
        self.assertRegex(key, "^tsk_[0-9A-Za-z]{12}_[0-9A-Za-z]{43}$")
        path = os.path.join(self.data_dir, "keys.json")
        self.assertEqual(stat.S_IMODE(os.stat(path).st_mode), 0o600)
        with open(path, encoding="utf-8") as file:
            self.assertNotIn(key[17:], file.read())
        listed = tool("keys", "list", "--data-dir", self.data_dir)
        self.assertIn("alice@example.org", listed.stdout)
        self.assertIn(key[4:16], listed.stdout)
        for secret in (key[17:], "sha256:", "\x1b"):
            self.assertNotIn(secret, listed.stdout)
        for flags, status in ((("add", "--owner", "../x"), 2), (("add",), 2), (("add", "--owner", "a", "--scope", "x"), 2),
                              (("revoke", "nobody"), 2), ((), 2)):
            done = tool("keys", *flags, "--data-dir", self.data_dir)
            self.assertEqual(done.returncode, status, (flags, done.stderr))
        with open(path, "w", encoding="ascii") as file:
            file.write("[]")
        done = tool("keys", "add", "--data-dir", self.data_dir, "--owner", "a")
        self.assertEqual(done.returncode, 5)
        self.assertIn("keys.json", done.stderr)
        with self.assertRaises(RuntimeError) as raised:
            Daemon(data_dir=self.data_dir).stop()
        self.assertIn("keys.json", str(raised.exception))

    def test_several_make_keys_at_once(self):
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            keys = set(pool.map(lambda _: make_key(self.data_dir), range(16)))
        self.assertEqual(len(keys), 16)
        with Daemon(data_dir=self.data_dir) as daemon:
            for key in keys:
                self.assertEqual(daemon.request("GET", "/v1/jobs", headers=bearer(key)).status, 200)

    def test_no_log_has_a_key(self):
        key = make_key(self.data_dir)
        daemon = Daemon("--log-level", "trace", data_dir=self.data_dir)
        try:
            for headers in (bearer(key), bearer(key[:-1] + "?"), {"Authorization": key}, {**bearer(key), "Host": "x"}):
                daemon.request("POST", "/v1/jobs", SMALL_JOB, headers)
                daemon.request("GET", "/v1/jobs", headers=headers)
            self.assertGreater(daemon.count_in_log("/v1/jobs", 8), 0)
            self.assertNotIn(key[17:50], daemon.log())
        finally:
            daemon.stop()

    def test_beyond_loopback_keys_are_needed(self):
        for host in ("0.0.0.0", "::"):
            with self.assertRaises(RuntimeError) as raised:
                Daemon("--host", host, data_dir=self.data_dir).stop()
            self.assertIn("tessera keys add --data-dir", str(raised.exception))
            self.assertIn("--insecure-no-keys", str(raised.exception))
        for host in ("127.0.0.2", "::1"):
            try:
                Daemon("--host", host, data_dir=self.data_dir).stop()
            except RuntimeError as error:
                self.assertIn("cannot listen", str(error))  # There is no IPv6, say.
        # In a network without any interface, so that nobody is let in meanwhile.
        alone = os.path.join(self.data_dir, "alone")
        with open(alone, "w", encoding="ascii") as file:
            file.write(f'#!/bin/sh\nexec unshare --net --map-root-user "{os.environ["TESSERAD"]}" "$@"\n')
        os.chmod(alone, 0o700)
        if subprocess.run(["unshare", "--net", "--map-root-user", "true"], capture_output=True, check=False).returncode:
            self.skipTest("no network namespaces here")
        with Daemon("--host", "0.0.0.0", "--insecure-no-keys", data_dir=self.data_dir, program=alone) as daemon:
            daemon.terminate()
            daemon.process.wait(timeout=60)  # Then all of its log is there.
            self.assertRegex(daemon.log(), "warn.*no keys")
        make_key(self.data_dir)
        with Daemon("--host", "0.0.0.0", data_dir=self.data_dir, program=alone) as daemon:
            daemon.terminate()
            daemon.process.wait(timeout=60)
            self.assertNotIn("no keys", daemon.log())

    def test_keys_can_be_required_before_there_are_any(self):
        with Daemon("--require-keys", data_dir=self.data_dir) as daemon:
            self.assertEqual(daemon.request("GET", "/v1/jobs").status, 401)
            self.assertEqual(daemon.request("GET", "/livez").status, 200)

    def test_the_client_shows_its_key(self):
        key = make_key(self.data_dir)
        path = os.path.join(self.data_dir, "key")
        with open(path, "w", encoding="ascii") as file:
            file.write(key + "\n")
        scene = os.path.join(self.data_dir, "scene.json")
        with open(scene, "w", encoding="ascii") as file:
            json.dump(SMALL_JOB, file)
        with Daemon(data_dir=self.data_dir) as daemon:
            image = os.path.join(self.data_dir, "out.png")
            for flags, env in ((("--key-file", path), {}), ((), {"TESSERA_KEY": key})):
                done = tool("--server", daemon.url, *flags, "render", scene, "-o", image, env=env)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertNotIn("warning", done.stderr)
            self.assertEqual(tool("--server", daemon.url, "list", env={"TESSERA_KEY": key}).returncode, 0)
            for env in ({}, {"TESSERA_KEY": key[:-1]}):
                done = tool("--server", daemon.url, "list", env=env)
                self.assertEqual(done.returncode, 3)
                self.assertIn("--key-file", done.stderr)
            self.assertEqual(tool("--server", daemon.url, "--key-file", "/nowhere", "list").returncode, 5)
            self.assertEqual(tool("--server", daemon.url, "list", env={"TESSERA_KEY": "a b"}).returncode, 2)


class OwnersTest(FolderTest):
    """What others have looks as if it weren't there."""

    def setUp(self):
        super().setUp()
        same = {"X-Request-Id": "1"}  # So that bodies of refusals can be compared.
        self.alice = bearer(make_key(self.data_dir, owner="alice")) | same
        self.alices_other = bearer(make_key(self.data_dir, owner="alice"))
        self.bob = bearer(make_key(self.data_dir, owner="bob")) | same
        self.admin = bearer(make_key(self.data_dir, "--scope", "admin", owner="root"))
        self.daemon = Daemon(data_dir=self.data_dir)
        self.addCleanup(self.daemon.stop)

    def post(self, document, headers, path="/v1/jobs"):
        return self.daemon.request("POST", path, document, headers)

    def end(self, job):
        deadline = time.monotonic() + 120
        while self.daemon.request("GET", f"/v1/jobs/{job}", headers=self.admin).json()["state"] != "completed":
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.005)

    def listed(self, headers):
        return [job["id"] for job in self.daemon.request("GET", "/v1/jobs", headers=headers).json()["jobs"]]

    def test_jobs(self):
        job = self.post(SMALL_JOB, self.alice).json()["id"]
        self.end(job)
        unknown = {}
        for method, path in (("GET", ""), ("GET", "/image"), ("GET", "/plan"), ("GET", "/stats"), ("POST", "/cancel"),
                             ("DELETE", "")):
            unknown[method, path] = self.daemon.request(method, "/v1/jobs/0" + path, headers=self.alice)
            reply = self.daemon.request(method, f"/v1/jobs/{job}{path}", headers=self.bob)
            self.assertEqual(reply.status, 404, (method, path))
            self.assertEqual(reply.body, unknown[method, path].body, (method, path))
        for who in (self.alice, self.alices_other, self.admin):
            for path in ("", "/image", "/plan", "/stats"):
                self.assertEqual(self.daemon.request("GET", f"/v1/jobs/{job}{path}", headers=who).status, 200, path)
        bobs = self.post(SMALL_JOB, self.bob).json()["id"]
        self.assertEqual(self.listed(self.alice), [job])
        self.assertEqual(self.listed(self.bob), [bobs])
        self.assertEqual(self.listed(self.admin), [job, bobs])
        page = self.daemon.request("GET", "/v1/jobs?limit=1", headers=self.alice).json()
        self.assertNotIn("next", page)
        self.assertEqual(self.daemon.request("DELETE", f"/v1/jobs/{job}", headers=self.alices_other).status, 204)

    def test_files(self):
        data = TRIANGLE.encode()
        blob = content_hash(data)
        job = {"scene": {"objects": [{"type": "file", "format": "ply", "blob": blob}]},
               "image": {"width": 8, "height": 8}}
        self.assertEqual(self.daemon.request("PUT", f"/v1/blobs/{blob}", data, self.alice).status, 201)
        missing = self.post(json.loads(json.dumps(job).replace(blob, content_hash(b"no"))), self.bob)
        for path, document in (("/v1/jobs", job), ("/v1/scenes", job["scene"]), ("/v1/render", job),
                               ("/v1/render", job["scene"])):
            self.assertIn(self.post(document, self.alice, path).status, (200, 201), path)
            reply = self.post(document, self.bob, path)
            self.assertEqual(reply.status, 422, path)
            self.assertIn("There is no blob", reply.body.decode())
            if path == "/v1/jobs":
                self.assertEqual(reply.body.decode().replace(blob, content_hash(b"no")), missing.body.decode())
        # Whoever sends the bytes has them.
        self.assertEqual(self.daemon.request("PUT", f"/v1/blobs/{blob}", b"x", self.bob).status, 422)
        self.assertEqual(self.post(job, self.bob).status, 422)
        self.assertEqual(self.daemon.request("PUT", f"/v1/blobs/{blob}", data, self.bob).status, 200)
        self.assertEqual(self.post(job, self.bob).status, 201)
        self.assertEqual(self.post(job, self.admin).status, 201)
        # What is known outlives the daemon.
        self.daemon.stop()
        with Daemon(data_dir=self.data_dir) as again:
            carol = bearer(make_key(self.data_dir, owner="carol"))
            again.process.send_signal(signal.SIGHUP)
            while again.request("POST", "/v1/jobs", job, carol).status == 401:
                time.sleep(0.005)
            for who, status in ((self.alice, 201), (self.bob, 201), (carol, 422)):
                self.assertEqual(again.request("POST", "/v1/jobs", job, who).status, status)

    def test_scenes(self):
        scene = self.post(SPHERE, self.alice, "/v1/scenes").json()["scene"]
        job = {"scene": scene, "image": {"width": 8, "height": 8}}
        for who, status in ((self.alice, 200), (self.alices_other, 200), (self.admin, 200), (self.bob, 404)):
            self.assertEqual(self.daemon.request("GET", f"/v1/scenes/{scene}", headers=who).status, status)
            self.assertEqual(self.post(job, who).status, 201 if status == 200 else 422)
        self.assertEqual(self.post(SPHERE, self.bob, "/v1/scenes").status, 200)
        self.assertEqual(self.daemon.request("GET", f"/v1/scenes/{scene}", headers=self.bob).status, 200)
        self.assertEqual(self.post(job, self.bob).status, 201)

    def test_a_job_shows_its_scene(self):
        inline = self.post(SMALL_JOB, self.alice).json()["scene"]
        self.assertEqual(self.daemon.request("GET", f"/v1/scenes/{inline}", headers=self.alice).status, 200)
        self.assertEqual(self.daemon.request("GET", f"/v1/scenes/{inline}", headers=self.bob).status, 404)

    def test_what_one_has_put_stays_while_another_deletes_it(self):
        def scene_of(turn):
            return {"objects": [{"type": "sphere", "center": [turn, 0, 0], "radius": 1}]}

        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            for turn in range(60):
                content = TRIANGLE.replace("end_header", f"comment {turn}\nend_header").encode()
                blob = "/v1/blobs/sha256:" + hashlib.sha256(content).hexdigest()
                scene = self.post(scene_of(turn), self.alice, "/v1/scenes").json()["scene"]
                self.daemon.request("PUT", blob, content, self.alice)
                for path in (blob, f"/v1/scenes/{scene}"):
                    deleting = pool.submit(self.daemon.request, "DELETE", path, None, self.alice)
                    if path == blob:
                        self.assertIn(self.daemon.request("PUT", blob, content, self.bob).status, (200, 201))
                        file = {"type": "file", "format": "ply", "blob": blob.rpartition("/")[2]}
                        kept = self.post({"objects": [file]}, self.bob, "/v1/scenes")
                        self.assertIn(kept.status, (200, 201), (turn, kept.body))
                    else:
                        self.assertIn(self.post(scene_of(turn), self.bob, "/v1/scenes").status, (200, 201))
                    self.assertIn(deleting.result().status, (204, 409))
                self.assertEqual(self.daemon.request("GET", f"/v1/scenes/{scene}", headers=self.bob).status, 200, turn)

    def test_what_is_known_is_ones_own(self):
        render = lambda who: self.daemon.request("POST", "/v1/render?width=8&samples=1", TRIANGLE, who)
        first, again, bobs = render(self.alice), render(self.alices_other), render(self.bob)
        self.assertEqual([reply.status for reply in (first, again, bobs)], [200, 200, 200])
        self.assertEqual(first.body, bobs.body)
        self.assertEqual(first.headers["Location"], again.headers["Location"])
        self.assertNotEqual(first.headers["Location"], bobs.headers["Location"])
        self.assertEqual(self.daemon.request("GET", bobs.headers["Location"], headers=self.bob).status, 200)
        self.assertEqual(self.daemon.request("GET", bobs.headers["Location"], headers=self.alice).status, 404)


class QuotasTest(FolderTest):
    def refused(self, reply):
        self.assertEqual((reply.status, reply.json()["code"]), (429, "quota_exceeded"))
        self.assertGreater(int(reply.headers["Retry-After"]), 0)

    def test_requests(self):
        slow = bearer(make_key(self.data_dir, "--requests-per-second", "0.01", "--burst", "3"))
        free = bearer(make_key(self.data_dir))
        with Daemon(data_dir=self.data_dir) as daemon:
            for left in ("2", "1", "0"):
                reply = daemon.request("GET", "/v1/jobs", headers=slow)
                self.assertEqual(reply.status, 200)
                self.assertEqual((reply.headers["RateLimit-Limit"], reply.headers["RateLimit-Remaining"]), ("3", left))
            reply = daemon.request("POST", "/v1/jobs", SMALL_JOB, slow)
            self.refused(reply)
            self.assertLessEqual(int(reply.headers["Retry-After"]), 100)
            self.assertEqual(reply.headers["RateLimit-Remaining"], "0")
            self.assertGreater(int(reply.headers["RateLimit-Reset"]), 200)
            for _ in range(20):
                reply = daemon.request("GET", "/v1/jobs", headers=free)
                self.assertEqual((reply.status, reply.headers["RateLimit-Limit"]), (200, None))
            self.assertEqual(daemon.request("GET", "/livez", headers=slow).status, 200)

    def test_unfinished_jobs(self):
        key = bearer(make_key(self.data_dir, "--unfinished-jobs", "1", owner="alice"))
        bob = bearer(make_key(self.data_dir, "--unfinished-jobs", "1", owner="bob"))
        with Daemon("--threads", "1", data_dir=self.data_dir) as daemon:
            job = daemon.request("POST", "/v1/jobs", ENDLESS_PIXEL, key).json()["id"]
            self.refused(daemon.request("POST", "/v1/jobs", SMALL_JOB, key))
            self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB, bob).status, 201)
            self.assertEqual(daemon.request("POST", f"/v1/jobs/{job}/cancel", headers=key).status, 202)
            self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB, key).status, 201)

    def test_samples(self):
        key = bearer(make_key(self.data_dir, "--samples-per-hour", "1000"))
        job = lambda width, samples: {**SMALL_JOB, "image": {"width": width, "height": 10},
                                      "settings": {"samples": samples}}
        with Daemon(data_dir=self.data_dir) as daemon:
            self.assertEqual(daemon.request("POST", "/v1/jobs", job(10, 9), key).status, 201)
            reply = daemon.request("POST", "/v1/jobs", job(10, 2), key)
            self.refused(reply)
            self.assertLessEqual(int(reply.headers["Retry-After"]), 361)
            self.assertEqual(daemon.request("POST", "/v1/jobs", job(5, 1), key).status, 201)
            reply = daemon.request("POST", "/v1/jobs", job(10, 11), key)
            self.assertEqual((reply.status, reply.json()["code"]), (403, "forbidden"))  # It never could.

    def test_bytes(self):
        key = bearer(make_key(self.data_dir, "--stored-bytes", "1KiB", owner="alice"))
        free = bearer(make_key(self.data_dir, owner="bob"))
        with Daemon(data_dir=self.data_dir) as daemon:
            put = lambda data, who: daemon.request("PUT", f"/v1/blobs/{content_hash(data)}", data, who)
            self.assertEqual(put(b"a" * 1000, key).status, 201)
            self.refused(put(b"b" * 25, key))
            self.assertEqual(put(b"a" * 1000, key).status, 200)
            self.assertEqual(put(b"c" * 24, key).status, 201)
            self.refused(daemon.request("POST", "/v1/scenes", SPHERE, key))
            self.assertEqual(put(b"b" * 5000, free).status, 201)


if __name__ == "__main__":
    unittest.main()
