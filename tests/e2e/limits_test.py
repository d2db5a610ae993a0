"""What peers may take: memory, connections, threads' time. Whatever runs out, the daemon refuses and lives."""

import concurrent.futures
import http.client
import json
import select
import os
import socket
import tempfile
import time
import unittest

from daemon import Daemon
from documents import SMALL_JOB, SPHERE

POST = b"POST /v1/scenes HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
MIB = 1 << 20


def large_scene(spheres=150_000):
    """Takes a while to parse."""
    sphere = {"type": "sphere", "center": [0, 0, 0], "radius": 1}
    return json.dumps({"objects": [sphere] * spheres}).encode()


def whole_post(body, path=b"/v1/scenes"):
    head = POST.replace(b"/v1/scenes", path) + b"Content-Length: %d\r\n\r\n" % len(body)
    return head + body


def connect(daemon):
    return socket.create_connection((daemon.host, daemon.port), timeout=120)


def read_all(connection):
    answer = b""
    while piece := connection.recv(65536):
        answer += piece
    return answer


class MemoryTest(unittest.TestCase):
    """Under `prlimit --as`: what is asked for from the system fails sooner or later."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.script = os.path.join(folder.name, "limited")

    def limited(self, room, *flags):
        """A daemon that may take so many bytes more than one that has rendered a job."""
        with Daemon("--threads", "2") as daemon:
            daemon.wait_ended(daemon.submit(SMALL_JOB))
            with open(f"/proc/{daemon.process.pid}/status", encoding="ascii") as status:
                (size,) = (int(line.split()[1]) << 10 for line in status if line.startswith("VmPeak:"))
        if size > 1 << 40:
            self.skipTest("a sanitizer takes terabytes of addresses")
        with open(self.script, "w", encoding="ascii") as script:
            script.write(f'#!/bin/sh\nexec prlimit --as={size + room} "$TESSERAD" "$@"\n')
        os.chmod(self.script, 0o755)
        return Daemon("--threads", "2", "--timeout", "5", *flags, program=self.script)

    def send_until_refused(self, daemon, begin, repeated=b"", times=64):
        """Whatever is answered, up to the end of the connection."""
        with connect(daemon) as connection:
            try:
                connection.sendall(begin)
                for _ in range(times):
                    connection.sendall(repeated)
            except OSError:  # Refused and closed.
                pass
            try:
                return read_all(connection)
            except OSError:
                return b""

    def post_and_close(self, daemon, body):
        sent = whole_post(body, b"/v1/jobs").replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n", 1)
        self.send_until_refused(daemon, sent)

    def attack(self, daemon):
        chunked = POST + b"Transfer-Encoding: chunked\r\n\r\n"
        filler = b"x" * MIB
        for begin in (chunked + b"1;a=", chunked + b"0\r\nX: ", chunked + b"0;", POST + b"X: ", b"GET /"):
            answer = self.send_until_refused(daemon, begin, filler)
            self.assertTrue(answer == b"" or answer.startswith((b"HTTP/1.1 4", b"HTTP/1.1 503")), answer[:100])
        announced = POST + b"Content-Length: %d\r\n\r\n" % (256 * MIB)
        with concurrent.futures.ThreadPoolExecutor(8) as pool:  # Large bodies, several at once.
            work = [pool.submit(self.send_until_refused, daemon, announced, b" " * MIB) for _ in range(8)]
            for each in work:
                self.assertRegex(each.result()[:12], rb"^(HTTP/1.1 [45].*)?$")
        held = []
        try:
            for _ in range(400):  # Many connections, all in the middle of a request.
                held.append(connect(daemon))
                held[-1].sendall(POST + b"X: " + b"y" * 16_000)
        except OSError:
            pass
        finally:
            for connection in held:
                connection.close()
        for i in range(60):  # Many jobs, whose images and structures want memory.
            body = json.dumps({"scene": SPHERE, "image": {"width": 700 + i, "height": 700}}).encode()
            self.post_and_close(daemon, body)
        scene = json.loads(large_scene(20_000))
        for accel in ("wide", "bvh", "kd", "grid", "octree", "bsp"):
            body = json.dumps({"scene": scene, "settings": {"accel": accel}}).encode()
            self.post_and_close(daemon, body)

    def test_refuses_and_lives(self):
        for room in (8 * MIB, 64 * MIB, 300 * MIB):
            with self.subTest(room=room), self.limited(room, "--scene-cache", "1MiB", "--structure-cache", "1MiB") as daemon:
                self.attack(daemon)
                self.assertIsNone(daemon.process.poll(), daemon.log())
                deadline = time.monotonic() + 120
                state = None
                while state != "completed" and time.monotonic() < deadline:  # Once what was held is given back.
                    self.assertEqual(self.patiently(daemon, "GET", "/livez"), 200)
                    for job in self.unless_closed(daemon, "GET", "/v1/jobs?limit=1000").get("jobs", []):
                        if self.patiently(daemon, "DELETE", f"/v1/jobs/{job['id']}") == 409:
                            self.patiently(daemon, "POST", f"/v1/jobs/{job['id']}/cancel")
                    job = self.unless_closed(daemon, "POST", "/v1/jobs", SMALL_JOB).get("id")
                    if job:
                        state = daemon.wait_ended(job)["state"]
                self.assertEqual(state, "completed", daemon.log()[-2000:])
                self.assertEqual(daemon.stop(), 0)

    @staticmethod
    def unless_closed(daemon, method, path, body=None):
        """The answer's document; an empty one where the connection was closed for want of memory."""
        try:
            return daemon.request(method, path, body).json()
        except (OSError, http.client.HTTPException, ValueError):
            return {}

    def patiently(self, daemon, method, path):
        """The status, tried again for as long as there is no memory for an answer."""
        for _ in range(100):
            try:
                reply = daemon.request(method, path)
            except (OSError, http.client.HTTPException):
                continue
            if reply.status != 503:
                return reply.status
        return 503


class ConnectionsTest(unittest.TestCase):
    def test_more_than_may_be_wait_for_those_at_work(self):
        """And for those that are waited for: a render that doesn't end."""
        light = {"type": "environment", "radiance": [1, 1, 1]}
        job = json.dumps({"scene": {**SPHERE, "lights": [light]}, "image": {"width": 512, "height": 512}}).encode()
        with Daemon("--max-connections", "3", "--timeout", "60") as daemon:
            held = [connect(daemon) for _ in range(3)]
            for connection in held:
                connection.sendall(b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n")
                self.assertTrue(connection.recv(1000).startswith(b"HTTP/1.1 200 "))
                connection.sendall(b"POST /v1/render?samples=100000 HTTP/1.1\r\nHost: localhost\r\n"
                                   b"Content-Type: application/json\r\nContent-Length: %d\r\n\r\n%b" % (len(job), job))
            with connect(daemon) as waiting:
                waiting.sendall(b"GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                self.assertEqual(select.select([waiting, *held], [], [], 1)[0], [])
                held.pop().close()
                self.assertTrue(read_all(waiting).startswith(b"HTTP/1.1 200 "))
            for connection in held:
                connection.close()

    def test_the_slowest_make_room(self):
        """Between requests, in a header and in a body, and in an answer that isn't read."""
        beginnings = [
            b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n",
            b"GET /livez HTTP/1.1\r\nHost: localhost\r\nX-Slow: ",
            b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{",
            b"GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n" * 1000,
        ]
        with Daemon("--max-connections", "4", "--timeout", "60") as daemon:
            held = [connect(daemon) for _ in beginnings]
            for connection, beginning in zip(held, beginnings):
                connection.setblocking(False)
                connection.send(beginning)
            for _ in range(50):
                self.assertEqual(daemon.request("GET", "/livez").status, 200)
            self.assertGreaterEqual(daemon.count_in_log("connections are open, as many as may be"), 1)
            for connection in held:
                connection.close()


class LanesTest(unittest.TestCase):
    def test_small_requests_overtake_large_ones(self):
        scene = large_scene()
        with Daemon("--threads", "1") as daemon, concurrent.futures.ThreadPoolExecutor(6) as pool:
            slow = [pool.submit(daemon.request, "POST", "/v1/scenes", scene, {"Content-Type": "application/json"})
                    for _ in range(6)]
            quick = daemon.connect()
            overtaken = 0
            while not all(each.done() for each in slow):
                quick.request("POST", "/v1/jobs", json.dumps(SMALL_JOB), {"Content-Type": "application/json"})
                response = quick.getresponse()
                response.read()
                self.assertIn(response.status, (201, 429))  # A slow machine has all jobs that it takes.
                overtaken += sum(not each.done() for each in slow)
            quick.close()
            self.assertGreater(overtaken, len(slow))  # In one queue at most all but one would still be open, once.
            for each in slow:
                self.assertIn(each.result().status, (200, 201))

    def test_small_documents_that_name_large_files(self):
        """They begin in the quick lane, and are moved."""
        with tempfile.TemporaryDirectory() as root:
            with open(os.path.join(root, "large.obj"), "w", encoding="ascii") as file:
                file.write("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" + "# filler\n" * 40_000)
            with Daemon("--asset-root", root, "--scene-cache", "0") as daemon:
                scene = {"objects": [{"type": "file", "path": "large.obj"}]}
                posted = daemon.request("POST", "/v1/scenes", scene)
                self.assertEqual((posted.status, posted.json()["primitives"]), (201, 1))
                again = daemon.request("GET", posted.headers["Location"])
                self.assertEqual((again.status, again.json()["primitives"]), (200, 1))
                for named in (scene, posted.json()["scene"]):
                    job = daemon.submit({"scene": named, "image": {"width": 8, "height": 8}})
                    self.assertEqual(daemon.wait_ended(job)["state"], "completed")


class HangUpTest(unittest.TestCase):
    def test_work_that_nobody_waits_for_isnt_begun(self):
        scene = large_scene()
        with Daemon("--log-level", "debug", "--timeout", "60") as daemon:
            gone = [connect(daemon) for _ in range(20)]
            for connection in gone:
                connection.sendall(whole_post(scene))
            for connection in gone:
                connection.close()
            deadline = time.monotonic() + 120
            while daemon.log().count("POST /v1/scenes ") < len(gone):
                self.assertLess(time.monotonic(), deadline, daemon.log()[-2000:])
                time.sleep(0.02)
            # All but those that the slow lane's threads may have been at before their clients went.
            self.assertGreater(daemon.log().count("POST /v1/scenes abandoned"), 0, daemon.log()[-2000:])

    def test_who_only_says_no_more_is_answered(self):
        """As `nc -N` does: closing one's own side isn't hanging up."""
        scene = large_scene()
        with Daemon() as daemon:
            waiting = [connect(daemon) for _ in range(4)]
            for version, connection in zip((b"1.1", b"1.0", b"1.1", b"1.0"), waiting):
                connection.sendall(whole_post(scene).replace(b"HTTP/1.1", b"HTTP/" + version))
                connection.shutdown(socket.SHUT_WR)
            for version, connection in zip((b"1.1", b"1.0", b"1.1", b"1.0"), waiting):
                answer = read_all(connection)
                interim, found, _ = answer.partition(b"HTTP/1.1 20")
                self.assertIn(b"1 20", found, answer[:300])
                self.assertIn(interim, (b"", b"HTTP/1.1 102 Processing\r\n\r\n") if version == b"1.1" else (b"",))
                connection.close()

    def test_requests_behind_it_arent_lost(self):
        scene = large_scene()
        with Daemon() as daemon, connect(daemon) as connection:
            connection.sendall(whole_post(scene) + b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n" * 3)
            connection.shutdown(socket.SHUT_WR)
            answer = read_all(connection)
            self.assertEqual(answer.count(b"HTTP/1.1 200 "), 3, answer[:300])
            self.assertEqual(answer.count(b"HTTP/1.1 201 "), 1)


if __name__ == "__main__":
    unittest.main()
