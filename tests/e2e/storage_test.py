"""What lies on disk: damage is noticed, told and healed; the disk's errors are answers; what isn't needed goes."""

import contextlib
import hashlib
import os
import resource
import shutil
import subprocess
import tempfile
import time
import unittest

from daemon import Daemon
from documents import ENDLESS_PIXEL, SMALL_JOB, SPHERE

TRIANGLE = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
TRIANGLE += b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


def content_hash(data):
    return "sha256:" + hashlib.sha256(data).hexdigest()


def digits(content):
    return content[len("sha256:") :]


def flip(path, at):
    """One bit of a byte, in its place."""
    with open(path, "r+b") as file:
        file.seek(at)
        byte = file.read(1)
        file.seek(at)
        file.write(bytes([byte[0] ^ 1]))


def scene_of(blob):
    return {"lights": SPHERE["lights"], "objects": [{"type": "file", "blob": blob, "format": "ply"}]}


BLOB = content_hash(TRIANGLE)
SCENE = scene_of(BLOB)


class StorageTest(unittest.TestCase):
    def setUp(self):
        self.data = tempfile.mkdtemp(prefix="tessera-storage-")
        self.addCleanup(shutil.rmtree, self.data, ignore_errors=True)

    def daemon(self, *flags):
        daemon = Daemon("--threads", "1", *flags, data_dir=self.data)
        self.addCleanup(daemon.stop)
        return daemon

    def path(self, *parts):
        return os.path.join(self.data, *parts)

    def files(self, folder):
        """What is there to be used, or set aside."""
        if not os.path.exists(self.path(folder)):
            return []
        return sorted(name for name in os.listdir(self.path(folder)) if name != ".gone")

    def put(self, daemon, content=TRIANGLE):
        return daemon.request("PUT", "/v1/blobs/" + content_hash(content), content)

    def post(self, daemon, scene=None):
        return daemon.request("POST", "/v1/scenes", scene or SCENE)

    def assert_problem(self, reply, status, code, *words):
        self.assertEqual((reply.status, reply.json()["code"]), (status, code), reply.body)
        for word in words:
            self.assertIn(word, reply.body.decode())


class DamageTest(StorageTest):
    def blob_path(self):
        return self.path("blobs", digits(BLOB))

    def test_of_a_blob_while_it_runs(self):
        daemon = self.daemon()
        self.assertEqual(self.put(daemon).status, 201)
        self.assertEqual(self.post(daemon).status, 201)
        flip(self.blob_path(), 150)
        for _ in range(2):
            self.assert_problem(self.post(daemon), 422, "invalid_document", BLOB, "damaged", "PUT /v1/blobs/")
            self.assertEqual(self.files("blobs"), [])
        self.assertEqual(self.files("set-aside"), ["blobs-" + digits(BLOB)])
        self.assertEqual(daemon.count_in_log("set aside as"), 1)
        metrics = daemon.request("GET", "/metrics").body.decode()
        self.assertRegex(metrics, r"(?m)^tessera_files_set_aside_total 1$")
        self.assertRegex(metrics, r"(?m)^tessera_disk_free_bytes [1-9]\d*$")
        self.assertEqual(self.put(daemon).status, 201)
        self.assertEqual(self.put(daemon).status, 200)
        self.assertEqual(self.post(daemon).status, 200)

    def test_of_a_blob_between_runs(self):
        daemon = self.daemon()
        self.put(daemon)
        posted = self.post(daemon).json()["scene"]
        daemon.stop()
        flip(self.blob_path(), 150)
        daemon = self.daemon()
        self.assert_problem(daemon.request("GET", "/v1/scenes/" + posted), 422, "invalid_document", "damaged")
        job = {"scene": posted, "image": {"width": 8, "height": 8}}
        self.assert_problem(daemon.request("POST", "/v1/jobs", job), 422, "invalid_document", "/scene", "damaged")
        daemon.stop()
        daemon = self.daemon()  # It is known still.
        self.assert_problem(daemon.request("GET", "/v1/scenes/" + posted), 422, "invalid_document", "damaged")
        self.assertEqual(self.put(daemon).status, 201)
        self.assertEqual(daemon.wait_ended(daemon.submit(job))["state"], "completed")

    def test_a_put_heals_before_anybody_has_noticed(self):
        daemon = self.daemon()
        for at in (0, 100):
            self.put(daemon)
            self.post(daemon)
            flip(self.blob_path(), at)
            self.assertEqual(self.put(daemon).status, 201)
            self.assertEqual(self.put(daemon).status, 200)
        os.truncate(self.blob_path(), 10)
        self.assertEqual(self.put(daemon).status, 201)
        daemon.stop()
        flip(self.blob_path(), 7)
        self.assertEqual(self.put(self.daemon()).status, 201)
        self.assertEqual(len(self.files("set-aside")), 4)
        with open(self.blob_path(), "rb") as file:
            self.assertEqual(file.read(), TRIANGLE)

    def test_of_a_large_blob(self):
        """One that isn't looked through in the quick lane."""
        content = TRIANGLE + b"\n" * (3 << 20)
        blob = content_hash(content)
        daemon = self.daemon()
        self.assertEqual(self.put(daemon, content).status, 201)
        flip(self.path("blobs", digits(blob)), 2 << 20)
        self.assert_problem(self.post(daemon, scene_of(blob)), 422, "invalid_document", "damaged")
        self.assertEqual(self.put(daemon, content).status, 201)
        self.assertEqual(self.post(daemon, scene_of(blob)).status, 201)

    def test_of_a_scene(self):
        daemon = self.daemon()
        posted = self.post(daemon, SPHERE).json()["scene"]
        path = self.path("scenes", digits(posted) + ".scene")
        for at in (3, 70, 80, 120):
            daemon.stop()
            flip(path, at)
            daemon = self.daemon()
            for _ in range(2):
                reply = daemon.request("GET", "/v1/scenes/" + posted)
                self.assert_problem(reply, 404, "not_found", "damaged", "POST it again")
            job = {"scene": posted, "image": {"width": 8, "height": 8}}
            self.assert_problem(daemon.request("POST", "/v1/jobs", job), 422, "invalid_document", "damaged")
            self.assertEqual(daemon.count_in_log("set aside as"), 1)
            self.assertEqual(self.post(daemon, SPHERE).status, 201)
            self.assertEqual(daemon.request("GET", "/v1/scenes/" + posted).status, 200)
        flip(path, 100)
        self.assertEqual(self.post(daemon, SPHERE).status, 201, "it is healed while it is in memory, too")
        self.assertEqual(self.post(daemon, SPHERE).status, 200)
        self.assertEqual(len(self.files("set-aside")), 5)

    def test_scenes_of_an_earlier_version(self):
        daemon = self.daemon()
        self.put(daemon)
        posted = self.post(daemon).json()["scene"]
        daemon.stop()
        path = self.path("scenes", digits(posted))
        with open(path + ".scene", "rb") as file:
            document = file.read().split(b"\n", 2)[2]
        os.remove(path + ".scene")
        with open(path + ".json", "wb") as file:
            file.write(document)
        daemon = self.daemon()
        self.assertEqual(self.files("scenes"), [digits(posted) + ".scene"])
        self.assert_problem(daemon.request("DELETE", "/v1/blobs/" + BLOB), 409, "in_use")
        self.assertEqual(daemon.request("GET", "/v1/scenes/" + posted).status, 200)

    def test_what_was_left_half_written_goes(self):
        self.daemon().stop()
        for folder in ("blobs", "scenes"):
            with open(self.path(folder, ".receiving-abc"), "wb") as file:
                file.write(b"half")
        self.daemon()
        self.assertEqual(os.listdir(self.path("blobs")) + os.listdir(self.path("scenes")), [])


class ScrubTest(StorageTest):
    def scrub(self, *flags):
        command = [os.environ["TESSERAD"], "--scrub", "--data-dir", self.data, *flags]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        return done.returncode, done.stdout.splitlines(), done.stderr

    def test_it_finds_all_damage(self):
        daemon = self.daemon()
        self.put(daemon)
        self.put(daemon, b"other bytes")
        self.post(daemon)
        posted = self.post(daemon, SPHERE).json()["scene"]
        status, lines, errors = self.scrub()
        self.assertEqual((status, lines), (2, []), "a daemon has the folder")
        self.assertIn("in use", errors)
        daemon.stop()
        status, lines, errors = self.scrub()
        self.assertEqual((status, len(lines), errors), (0, 1, ""))
        self.assertRegex(lines[0], r"^5 files of \d+ bytes checked, 0 damaged$")
        blob, scene = self.path("blobs", digits(BLOB)), self.path("scenes", digits(posted) + ".scene")
        flip(blob, 0)
        flip(scene, os.path.getsize(scene) - 1)
        status, lines, _ = self.scrub()
        self.assertEqual(status, 1)
        self.assertEqual(len(lines), 3)
        self.assertIn(blob, lines[0])
        self.assertIn(scene, lines[1])
        self.assertRegex(lines[2], r"^5 files of \d+ bytes checked, 2 damaged$")
        self.assertEqual(len(self.files("set-aside")), 2)
        self.assertEqual(self.scrub()[0], 0)
        daemon = self.daemon()
        self.assert_problem(daemon.request("GET", "/v1/scenes/" + posted), 404, "not_found", "damaged")
        self.assert_problem(self.post(daemon), 422, "invalid_document", "damaged")

    def test_images_of_jobs_that_nobody_knows_are_set_aside(self):
        """Each time: a scrub that made a new journal, which didn't know them any more, may have been killed then."""
        self.daemon().stop()
        stranger = self.path("images", "0" * 26 + ".film")
        with open(stranger, "wb") as file:
            file.write(b"an image")
        status, lines, errors = self.scrub()
        self.assertEqual((status, errors), (0, ""), lines)
        self.assertIn(stranger, lines[0])
        self.assertEqual(self.files("set-aside"), [f"images-{os.path.basename(stranger)}"])
        self.daemon().stop()
        self.assertEqual(len(self.files("set-aside")), 1)

    def test_it_makes_no_folder(self):
        shutil.rmtree(self.data)
        self.assertEqual(self.scrub()[0], 2)
        self.assertFalse(os.path.exists(self.data))


class FullDiskTest(StorageTest):
    """On a small disk where one can be made; where not, with a limit for files, which the daemon is told of alike."""

    def setUp(self):
        super().setUp()
        mount = ["mount", "-t", "tmpfs", "-o", "size=4m", "tessera", self.data]
        self.is_small = os.geteuid() == 0 and subprocess.run(mount, stderr=subprocess.DEVNULL, check=False).returncode == 0
        if self.is_small:
            self.addCleanup(subprocess.run, ["umount", "-l", self.data], check=True)

    def limited(self):
        daemon = self.daemon()
        if not self.is_small:
            resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (3 << 20, resource.RLIM_INFINITY))
        return daemon

    def test_what_doesnt_fit_is_507_and_leaves_nothing(self):
        daemon = self.limited()
        large = b"x" * (5 << 20)
        for _ in range(3):
            self.assert_problem(self.put(daemon, large), 507, "insufficient_storage")
            reply = daemon.request("POST", "/v1/render", large)
            self.assert_problem(reply, 507, "insufficient_storage")
            self.assertEqual(os.listdir(self.path("blobs")), [])
        self.assertEqual(self.put(daemon, b"y" * (2 << 20)).status, 201, "what fits is kept")
        self.assertEqual(daemon.wait_ended(daemon.submit(SMALL_JOB))["state"], "completed")
        self.assertEqual(daemon.stop(), 0)

    def test_a_disk_that_is_full(self):
        if not self.is_small:
            self.skipTest("no small disk can be made here")
        daemon = self.limited()
        self.put(daemon)
        filler = os.open(self.path("filler"), os.O_CREAT | os.O_WRONLY)
        with contextlib.suppress(OSError):
            while os.write(filler, b"x" * 4096):
                pass
        os.close(filler)
        for reply in (self.put(daemon, b"some bytes"), self.post(daemon), self.post(daemon, SPHERE)):
            self.assert_problem(reply, 507, "insufficient_storage")
        self.assertEqual(self.files("scenes"), [])
        self.assertEqual(self.files("blobs"), [digits(BLOB)])
        self.assertEqual(self.put(daemon).status, 200, "it is there")
        self.assert_problem(daemon.request("POST", "/v1/jobs", SMALL_JOB), 507, "insufficient_storage")
        self.assertEqual(daemon.request("POST", "/v1/render", SMALL_JOB).status, 200, "what needs no disk goes on")
        os.remove(self.path("filler"))
        self.assertEqual(self.post(daemon).status, 201)

    def test_a_disk_that_becomes_read_only(self):
        if not self.is_small:
            self.skipTest("no disk can be made here")
        daemon = self.daemon()
        self.put(daemon)
        self.assertEqual(self.post(daemon, SPHERE).status, 201)
        folders = [self.path("blobs"), self.path("scenes")]
        for folder in folders:
            subprocess.run(["mount", "--bind", folder, folder], check=True)
            subprocess.run(["mount", "-o", "remount,bind,ro", folder], check=True)
        reply = self.put(daemon, b"some bytes")
        self.assert_problem(reply, 503, "storage_unavailable")
        self.assertGreaterEqual(int(reply.headers["Retry-After"]), 1)
        self.assert_problem(self.post(daemon), 503, "storage_unavailable")
        self.assert_problem(daemon.request("DELETE", "/v1/blobs/" + BLOB), 503, "storage_unavailable")
        self.assertEqual(self.post(daemon, SPHERE).status, 200, "it is there, and can be read")
        for folder in folders:
            subprocess.run(["umount", "-l", folder], check=True)
        self.assertEqual(self.post(daemon).status, 201)


class LostFolderTest(StorageTest):
    def test_a_folder_that_goes_and_comes_back(self):
        daemon = self.daemon("--scene-cache", "0")
        self.put(daemon)
        posted = self.post(daemon, SPHERE).json()["scene"]
        aside = self.data + "-moved"
        os.rename(self.data, aside)
        self.addCleanup(shutil.rmtree, aside, ignore_errors=True)
        large = b"x" * (1 << 20)
        job = {"scene": posted, "image": {"width": 8, "height": 8}}
        for method, path, body in (
            ("PUT", "/v1/blobs/" + BLOB, TRIANGLE),
            ("PUT", "/v1/blobs/" + content_hash(large), large),
            ("POST", "/v1/scenes", SPHERE),
            ("POST", "/v1/scenes", SCENE),
            ("GET", "/v1/scenes/" + posted, None),
            ("DELETE", "/v1/scenes/" + posted, None),
            ("DELETE", "/v1/blobs/" + BLOB, None),
            ("POST", "/v1/jobs", job),
            ("POST", "/v1/jobs", SMALL_JOB),
            ("POST", "/v1/render", large),
            ("POST", "/v1/render?width=8&samples=1", TRIANGLE),
        ):
            with self.subTest(method + " " + path):
                reply = daemon.request(method, path, body)
                self.assert_problem(reply, 503, "storage_unavailable")
                self.assertGreaterEqual(int(reply.headers["Retry-After"]), 1)
        self.assertEqual(daemon.request("POST", "/v1/render", SMALL_JOB).status, 200, "what needs no disk goes on")
        self.assertFalse(os.path.exists(self.data), "and it isn't made anew")
        os.rename(aside, self.data)
        self.assertEqual(daemon.wait_ended(daemon.submit(job))["state"], "completed")
        self.assertEqual(self.post(daemon).status, 201)
        self.assertEqual(daemon.stop(), 0)


class DeletionTest(StorageTest):
    def delete(self, daemon, path):
        return daemon.request("DELETE", path)

    def test_of_a_blob(self):
        daemon = self.daemon()
        self.assert_problem(self.delete(daemon, "/v1/blobs/" + BLOB), 404, "not_found")
        self.put(daemon)
        reply = self.delete(daemon, "/v1/blobs/" + BLOB)
        self.assertEqual((reply.status, reply.body), (204, b""))
        self.assertEqual(self.files("blobs"), [])
        self.assert_problem(self.delete(daemon, "/v1/blobs/" + BLOB), 404, "not_found")
        self.assert_problem(self.post(daemon), 422, "invalid_document", "upload it first")
        self.assert_problem(self.delete(daemon, "/v1/blobs/md5:0"), 404, "not_found")

    def test_what_a_stored_scene_names_stays(self):
        daemon = self.daemon()
        self.put(daemon)
        scenes = [SCENE, {**SCENE, "lights": []}]
        posted = [self.post(daemon, scene).json()["scene"] for scene in scenes]
        self.assert_problem(self.delete(daemon, "/v1/blobs/" + BLOB), 409, "in_use", "scene")
        daemon.stop()
        daemon = self.daemon()  # Which knows it too.
        for scene in posted:
            self.assert_problem(self.delete(daemon, "/v1/blobs/" + BLOB), 409, "in_use")
            self.assertEqual(self.delete(daemon, "/v1/scenes/" + scene).status, 204)
            self.assert_problem(daemon.request("GET", "/v1/scenes/" + scene), 404, "not_found")
        self.assertEqual(self.delete(daemon, "/v1/blobs/" + BLOB).status, 204)

    def test_what_an_unfinished_job_needs_stays(self):
        daemon = self.daemon()
        for inline in (False, True):
            posted = self.post(daemon, SPHERE).json()["scene"]
            path = "/v1/scenes/" + posted
            job = daemon.submit(ENDLESS_PIXEL if inline else {**ENDLESS_PIXEL, "scene": posted})
            self.assert_problem(self.delete(daemon, path), 409, "in_use", "job")
            daemon.request("POST", f"/v1/jobs/{job}/cancel")
            self.assertEqual(self.delete(daemon, path).status, 204)
            self.assert_problem(self.delete(daemon, path), 404, "not_found")
            self.assert_problem(daemon.request("GET", path), 404, "not_found")


class RetentionTest(StorageTest):
    def age(self, folder, name, hours):
        then = time.time() - 3600 * hours
        os.utime(self.path(folder, name), (then, then))

    def wait_for(self, folder, names):
        deadline = time.monotonic() + 60
        while self.files(folder) != sorted(names):
            self.assertLess(time.monotonic(), deadline, self.files(folder))
            time.sleep(0.005)

    def test_by_age_but_for_what_is_needed(self):
        daemon = self.daemon()
        self.put(daemon)
        self.put(daemon, b"unused")
        self.put(daemon, b"old")
        posted = self.post(daemon).json()["scene"]
        old = self.post(daemon, SPHERE).json()["scene"]
        daemon.stop()
        for content in (TRIANGLE, b"old"):
            self.age("blobs", digits(content_hash(content)), 49)
        self.age("scenes", digits(old) + ".scene", 30)
        daemon = self.daemon("--max-blob-age", "2d", "--max-scene-age", "24h")
        self.wait_for("scenes", [digits(posted) + ".scene"])
        self.wait_for("blobs", [digits(BLOB), digits(content_hash(b"unused"))])
        self.assert_problem(daemon.request("GET", "/v1/scenes/" + old), 410, "gone", "POST it again")
        self.assert_problem(self.delete(daemon, "/v1/blobs/" + content_hash(b"old")), 410, "gone")
        job = {"scene": old, "image": {"width": 8, "height": 8}}
        self.assert_problem(daemon.request("POST", "/v1/jobs", job), 422, "invalid_document", "expired")
        daemon.stop()
        daemon = self.daemon()
        self.assert_problem(daemon.request("GET", "/v1/scenes/" + old), 410, "gone")
        self.assertEqual(self.post(daemon, SPHERE).status, 201)
        self.assertEqual(daemon.request("GET", "/v1/scenes/" + old).status, 200)

    def delete(self, daemon, path):
        return daemon.request("DELETE", path)

    def test_by_bytes_the_longest_unused_first(self):
        daemon = self.daemon()
        contents = [bytes([letter]) * 1000 for letter in b"abcdef"]
        for content in contents:
            self.put(daemon, content)
        daemon.stop()
        for hours, content in enumerate(contents):
            self.age("blobs", digits(content_hash(content)), 10 - hours)
        daemon = self.daemon("--max-blob-bytes", "3500")
        self.wait_for("blobs", [digits(content_hash(content)) for content in contents[3:]])
        self.put(daemon, contents[3])  # It is used now.
        self.put(daemon, b"z" * 1000)
        self.wait_for("blobs", [digits(content_hash(c)) for c in (contents[3], contents[5], b"z" * 1000)])


if __name__ == "__main__":
    unittest.main()
