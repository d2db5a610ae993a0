"""Files that are sent are read in processes of their own: what becomes of these costs a refusal, not the daemon."""

import base64
import concurrent.futures
import glob
import hashlib
import json
import os
import signal
import struct
import time
import unittest
import zlib

from daemon import Daemon
from documents import SMALL_JOB


def processes(daemon, name):
    """The processes below the daemon of that name that haven't ended."""
    found, parents = [], {daemon.process.pid}
    while parents:
        children = set()
        for path in glob.glob("/proc/[0-9]*/stat"):
            try:
                with open(path, encoding="ascii") as stat:
                    head, tail = stat.read().rsplit(")", 1)
            except OSError:
                continue
            number, called = head.split(" (", 1)
            state, parent = tail.split()[:2]
            if int(parent) in parents and state != "Z":
                children.add(int(number))
                if called == name:
                    found.append(int(number))
        parents = children
    return found


def is_running(pid):
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
            return stat.read().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def wait_for(what, seconds=60):
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if found := what():
            return found
    raise AssertionError("it never came to that")


def png_file(rgb):
    """One texel."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" + bytes(rgb)))
            + chunk(b"IEND", b""))


def put_blob(daemon, content):
    blob = "sha256:" + hashlib.sha256(content).hexdigest()
    reply = daemon.request("PUT", "/v1/blobs/" + blob, content)
    assert reply.status in (200, 201), reply.body
    return blob


def long_obj(megabytes=48):
    """Takes a second or so to read."""
    lines = b"".join(b"v %d 0.25 %d.5\n" % (i % 1000, i % 777) for i in range(1, 20_000)) + b"f 1 2 3\n" * 20_000
    return lines * (megabytes * (1 << 20) // len(lines))


def textured_gltf(image):
    """A triangle with that image on it."""
    data = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<6f", 0, 0, 1, 0, 0, 1)
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "textures": [{"source": 0}],
            "images": [{"uri": "data:image/png;base64," + base64.b64encode(image).decode()}],
            "buffers": [{"byteLength": len(data), "uri": uri}],
            "bufferViews": [
                {"buffer": 0, "byteLength": 36},
                {"buffer": 0, "byteOffset": 36, "byteLength": 24},
            ],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
                {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
            ],
        }
    ).encode()


def scene_with(blob, kind):
    return {"objects": [{"type": "file", "blob": blob, "format": kind}]}


class IsolationTest(unittest.TestCase):
    def assert_works(self, daemon):
        job = daemon.submit(SMALL_JOB)
        self.assertEqual(daemon.wait_ended(job)["state"], "completed")

    def post_and(self, daemon, do, kind="obj"):
        """The answer to a scene whose file takes long, once something has been done to the process that reads it."""
        blob = put_blob(daemon, long_obj())
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            posted = pool.submit(daemon.request, "POST", "/v1/scenes", scene_with(blob, kind))
            (reader,) = wait_for(lambda: processes(daemon, "tessera-reader"))
            do(reader)
            return blob, posted.result()

    def assert_refused(self, blob, reply, words):
        self.assertEqual(reply.status, 422, reply.body)
        problem = reply.json()
        self.assertEqual(problem["code"], "invalid_document")
        self.assertEqual([error["pointer"] for error in problem["errors"]], [blob])
        self.assertIn(words, problem["errors"][0]["detail"])

    def test_a_crash(self):
        with Daemon() as daemon:
            # Sanitizers take SIGSEGV for themselves, and this one for what it is.
            blob, reply = self.post_and(daemon, lambda pid: os.kill(pid, signal.SIGILL))
            self.assert_refused(blob, reply, "crashed (ILL)")
            self.assert_works(daemon)

    def test_killed(self):
        with Daemon() as daemon:
            blob, reply = self.post_and(daemon, lambda pid: os.kill(pid, signal.SIGKILL))
            self.assert_refused(blob, reply, "ended by the system")
            self.assert_works(daemon)

    def test_a_hang(self):
        with Daemon("--max-parse-seconds", "1") as daemon:
            blob, reply = self.post_and(daemon, lambda pid: os.kill(pid, signal.SIGSTOP))
            self.assert_refused(blob, reply, "took too long")
            wait_for(lambda: not processes(daemon, "tessera-reader"))
            self.assert_works(daemon)

    def test_nobody_waits_any_more(self):
        with Daemon() as daemon:
            blob = put_blob(daemon, long_obj())
            connection = daemon.connect()
            connection.request("POST", "/v1/scenes", json.dumps(scene_with(blob, "obj")),
                               {"Content-Type": "application/json"})
            (reader,) = wait_for(lambda: processes(daemon, "tessera-reader"))
            os.kill(reader, signal.SIGSTOP)
            connection.close()
            wait_for(lambda: not processes(daemon, "tessera-reader"))

    def test_what_makes_processes_has_ended(self):
        with Daemon() as daemon:
            blob = put_blob(daemon, b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
            self.assertEqual(daemon.request("POST", "/v1/scenes", scene_with(blob, "obj")).status, 201)
            other = put_blob(daemon, b"v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n")
            checks = daemon.request("GET", "/readyz").json()["checks"]
            self.assertEqual(checks["isolation"]["ready"], True)
            (zygote,) = processes(daemon, "tessera-zygote")
            os.kill(zygote, signal.SIGKILL)
            wait_for(lambda: daemon.request("GET", "/readyz").status == 503)
            self.assertIn("isolation", daemon.request("GET", "/readyz").json()["detail"])
            reply = daemon.request("POST", "/v1/scenes", scene_with(other, "obj"))
            self.assertEqual((reply.status, reply.json()["code"]), (503, "reader_unavailable"))
            self.assertIn("Retry-After", reply.headers)
            self.assert_works(daemon)  # Which takes no file.

    def test_a_broken_image_is_white(self):
        image = png_file((255, 0, 0))
        broken = image[:-24] + bytes(24)
        with Daemon() as daemon:
            for content, warnings in ((image, 1), (broken, 2)):  # One is that there is no light.
                blob = put_blob(daemon, textured_gltf(content))
                job = daemon.submit({"scene": scene_with(blob, "gltf"), "image": {"width": 8, "height": 8}})
                status = daemon.wait_ended(job)
                self.assertEqual((status["state"], status["warnings"]), ("completed", warnings))
            wait_for(lambda: not processes(daemon, "tessera-reader"))

    def test_nothing_stays_behind(self):
        with Daemon() as daemon:
            blob = put_blob(daemon, textured_gltf(png_file((255, 0, 0))))
            job = daemon.submit({"scene": scene_with(blob, "gltf"), "image": {"width": 8, "height": 8}})
            daemon.wait_ended(job)
            zygotes = processes(daemon, "tessera-zygote")
            self.assertTrue(zygotes)
            daemon.process.kill()
            daemon.process.wait()

            def are_gone():
                return not any(is_running(pid) for pid in zygotes)

            wait_for(are_gone)

    def test_files_stay_as_many(self):
        with Daemon() as daemon:
            def post(i):
                blob = put_blob(daemon, b"v 0 0 0\nv %d 0 0\nv 0 1 0\nf 1 2 3\n" % (i + 1))
                return daemon.request("POST", "/v1/scenes", scene_with(blob, "obj")).status

            def open_files():
                return len(os.listdir(f"/proc/{daemon.process.pid}/fd"))

            self.assertEqual(post(0), 201)
            before = open_files()
            with concurrent.futures.ThreadPoolExecutor(8) as pool:
                self.assertEqual(set(pool.map(post, range(1, 100))), {201})
            wait_for(lambda: open_files() <= before)


if __name__ == "__main__":
    unittest.main()
