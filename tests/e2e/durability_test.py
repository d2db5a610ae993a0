"""What a client was told stays true when the daemon is killed, or stopped, and started again."""

import contextlib
import http.client
import os
import shutil
import sqlite3
import subprocess
import tempfile
import threading
import time
import unittest
from random import Random

from daemon import ENDED, Daemon
from documents import SMALL_JOB, SPHERE, endless_job

TRIANGLE = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
TRIANGLE += "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


def noisy_job(seed=0, side=64, samples=16):
    """A job whose image no other seed has."""
    scene = {"lights": [{"type": "environment", "radiance": [1, 1, 1]}], "objects": SPHERE["objects"]}
    return {"scene": scene, "image": {"width": side, "height": side}, "settings": {"samples": samples, "seed": seed}}


class DurabilityTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tessera-e2e-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.data_dir = os.path.join(self.folder, "data")

    def start(self, *flags):
        daemon = Daemon(*flags, data_dir=self.data_dir)
        self.addCleanup(daemon.stop)
        return daemon

    def restarted(self, daemon, *flags):
        daemon.kill()
        return self.start(*flags)

    def report(self, daemon, job, what):
        reply = daemon.request("GET", f"/v1/jobs/{job}/{what}")
        self.assertEqual(reply.status, 200)
        return reply.json()

    def test_a_job_that_has_ended_is_there_again(self):
        daemon = self.start()
        job = daemon.submit({**noisy_job(), "name": "é"})
        status = daemon.wait_ended(job)
        plan, stats = self.report(daemon, job, "plan"), self.report(daemon, job, "stats")
        canceled = daemon.submit(endless_job())
        self.assertEqual(daemon.request("POST", f"/v1/jobs/{canceled}/cancel").status, 202)
        deleted = daemon.submit(SMALL_JOB)
        daemon.wait_ended(deleted)
        self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{deleted}").status, 204)
        daemon = self.restarted(daemon)
        again = daemon.status(job)
        for key in status:
            if key not in ("elapsed", "image", "links"):
                self.assertEqual(again[key], status[key], key)
        self.assertAlmostEqual(again["elapsed"], status["elapsed"], delta=0.01)
        self.assertEqual(self.report(daemon, job, "plan"), plan)
        stats_again = self.report(daemon, job, "stats")
        for key in stats:
            if key not in ("timing", "mrays_per_second"):
                self.assertEqual(stats_again[key], stats[key], key)
        for key, seconds in stats["timing"].items():
            self.assertAlmostEqual(stats_again["timing"][key], seconds, delta=0.001)
        self.assertEqual(daemon.status(canceled)["state"], "canceled")
        self.assertEqual(daemon.request("GET", f"/v1/jobs/{deleted}").status, 404)

    def test_jobs_that_have_not_ended_are_rendered_in_their_order(self):
        daemon = self.start("--threads", "1")
        jobs = [daemon.submit(endless_job())] + [daemon.submit(noisy_job(seed)) for seed in range(3)]
        daemon.wait_until(jobs[0], lambda status: status["samples_done"] > 0)
        daemon = self.restarted(daemon, "--threads", "1")
        listed = [job["id"] for job in daemon.request("GET", "/v1/jobs").json()["jobs"]]
        self.assertEqual(listed, jobs)
        daemon.wait_until(jobs[0], lambda status: status["samples_done"] > 0)
        self.assertEqual(daemon.request("POST", f"/v1/jobs/{jobs[0]}/cancel").status, 202)
        for job in jobs[1:]:
            self.assertEqual(daemon.wait_ended(job)["state"], "completed")
        images = [daemon.request("GET", f"/v1/jobs/{job}/image?format=exr").body for job in jobs[1:]]
        for seed, image in enumerate(images):
            job = daemon.submit(noisy_job(seed))
            daemon.wait_ended(job)
            self.assertEqual(daemon.request("GET", f"/v1/jobs/{job}/image?format=exr").body, image)

    def test_jobs_go_on_after_a_clean_stop(self):
        daemon = self.start()
        job = daemon.submit(endless_job())
        daemon.wait_until(job, lambda status: status["state"] == "rendering")
        self.assertEqual(daemon.stop(), 0)
        daemon = self.start()
        self.assertNotIn(daemon.status(job)["state"], ENDED)

    def test_an_order_keeps_the_files_that_it_was_given(self):
        assets = os.path.join(self.folder, "assets")
        os.mkdir(assets)
        path = os.path.join(assets, "triangle.ply")
        with open(path, "w", encoding="ascii") as file:
            file.write(TRIANGLE)
        scene = {**SPHERE, "objects": [{"type": "file", "path": "triangle.ply"}]}
        daemon = self.start("--asset-root", assets, "--threads", "1")
        first = daemon.submit(endless_job())
        daemon.wait_until(first, lambda status: status["samples_done"] > 0)
        inline = daemon.submit({**SMALL_JOB, "scene": scene})
        posted = daemon.request("POST", "/v1/scenes", scene)
        self.assertIn(posted.status, (200, 201))
        by_hash = daemon.submit({**SMALL_JOB, "scene": posted.json()["scene"]})
        os.remove(path)
        daemon = self.restarted(daemon, "--asset-root", assets)
        for job in (inline, by_hash):
            status = daemon.wait_ended(job)
            self.assertEqual(status["state"], "completed", status)
            self.assertEqual(status["scene"], posted.json()["scene"])

    def test_what_is_rendered_later_than_its_client_waits_is_kept(self):
        daemon = self.start("--threads", "1")
        first = daemon.submit(endless_job())
        daemon.wait_until(first, lambda status: status["samples_done"] > 0)
        headers = {"Prefer": "respond-async", "Content-Type": "model/ply"}
        bodies = [
            ("/v1/render?width=16", TRIANGLE.encode(), headers),
            ("/v1/render", SMALL_JOB, {"Prefer": "respond-async"}),
            ("/v1/render", SPHERE, {"Prefer": "respond-async"}),
        ]
        jobs = []
        for path, body, given in bodies:
            reply = daemon.request("POST", path, body, given)
            self.assertEqual(reply.status, 202, reply.body)
            jobs.append(reply.json()["id"])
        daemon = self.restarted(daemon)
        self.assertEqual(daemon.request("POST", f"/v1/jobs/{first}/cancel").status, 202)
        for job in jobs:
            self.assertEqual(daemon.wait_ended(job)["state"], "completed")

    def test_a_job_whose_scene_has_gone_fails_and_says_so(self):
        daemon = self.start("--threads", "1")
        first, job = daemon.submit(endless_job()), daemon.submit(endless_job())
        daemon.kill()
        scenes = os.path.join(self.data_dir, "scenes")
        for name in os.listdir(scenes):
            os.remove(os.path.join(scenes, name))
        daemon = self.start("--threads", "1")
        for lost in (first, job):
            status = daemon.wait_ended(lost)
            self.assertEqual(status["state"], "failed")
            self.assertIn("scene", status["error"])

    def test_the_journal_of_a_newer_program_is_left_alone(self):
        self.start().stop()
        with sqlite3.connect(os.path.join(self.data_dir, "journal.db")) as database:
            database.execute("PRAGMA user_version = 1000")
        database.close()
        with self.assertRaisesRegex(RuntimeError, "version 1000"):
            Daemon(data_dir=self.data_dir)


    def image(self, daemon, job):
        reply = daemon.request("GET", f"/v1/jobs/{job}/image?format=exr&aov=all")
        self.assertEqual(reply.status, 200, reply.body)
        return reply.body

    def in_journal(self, *statement):
        with contextlib.closing(sqlite3.connect(os.path.join(self.data_dir, "journal.db"))) as journal, journal:
            return journal.execute(*statement).fetchall()

    def images_on_disk(self):
        """Of these jobs: small ones lie in the journal, the others are files."""
        files = {name.removesuffix(".film") for name in os.listdir(os.path.join(self.data_dir, "images"))}
        return files | {job for (job,) in self.in_journal("SELECT job FROM images")}

    def damage_image(self, job):
        """By a bit."""
        path = os.path.join(self.data_dir, "images", f"{job}.film")
        if os.path.exists(path):
            with open(path, "r+b") as file:
                file.seek(1000)
                byte = file.read(1)
                file.seek(1000)
                file.write(bytes([byte[0] ^ 1]))
            return
        ((image,),) = self.in_journal("SELECT image FROM images WHERE job = ?", (job,))
        damaged = image[:1000] + bytes([image[1000] ^ 1]) + image[1001:]
        self.in_journal("UPDATE images SET image = ? WHERE job = ?", (damaged, job))

    def test_images_are_there_again_to_the_last_bit(self):
        daemon = self.start()
        document = noisy_job()
        document["settings"]["aovs"] = ["depth", "object_id", "normal", "alpha", "variance"]
        jobs = [daemon.submit(document), daemon.submit(noisy_job(1, 30, 1)), daemon.submit(noisy_job(1, 128, 128))]
        for job in jobs:
            daemon.wait_ended(job)
        images = [self.image(daemon, job) for job in jobs]
        tags = [daemon.request("HEAD", f"/v1/jobs/{job}/image").headers["ETag"] for job in jobs]
        daemon = self.restarted(daemon)
        self.assertEqual([daemon.status(job)["image"] for job in jobs], ["complete"] * 3)
        self.assertEqual([self.image(daemon, job) for job in jobs], images)
        again = [daemon.request("HEAD", f"/v1/jobs/{job}/image").headers["ETag"] for job in jobs]
        self.assertEqual(again, tags)
        self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{jobs[0]}").status, 204)
        self.assertEqual(self.images_on_disk(), {jobs[1], jobs[2]})
        self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{jobs[2]}").status, 204)
        self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{jobs[1]}").status, 204)
        self.assertEqual(self.images_on_disk(), set())

    def test_images_that_memory_has_no_room_for_are_on_disk(self):
        room = 64 * 64 * 12 * 3
        daemon = self.start("--max-film-memory", str(room), "--image-cache", "0")
        jobs = []
        for seed in range(5):
            jobs.append(daemon.submit(noisy_job(seed)))
            daemon.wait_ended(jobs[-1])
        images = [self.image(daemon, job) for job in jobs]
        self.assertEqual(len(set(images)), 5)
        self.assertEqual([daemon.status(job)["image"] for job in jobs], ["complete"] * 5)

    def test_a_damaged_image_is_rendered_again(self):
        daemon = self.start("--image-cache", "0")
        timed = noisy_job(1)
        timed["settings"] = {"until": {"seconds": 0.2}}
        timed = daemon.submit(timed)
        jobs = [daemon.submit(noisy_job(seed, size, size)) for seed, size in ((0, 64), (1, 128))]
        for job in (*jobs, timed):
            daemon.wait_ended(job)
        images = [self.image(daemon, job) for job in jobs]
        daemon.kill()
        for job in (*jobs, timed):
            self.damage_image(job)
        daemon = self.start("--image-cache", "0")
        for job, image in zip(jobs, images):
            reply = daemon.request("GET", f"/v1/jobs/{job}/image?format=exr&aov=all")
            self.assertEqual(reply.status, 409, reply.body)
            self.assertEqual(daemon.wait_ended(job)["state"], "completed")
            self.assertEqual(self.image(daemon, job), image)
        self.assertEqual(daemon.request("GET", f"/v1/jobs/{timed}/image").status, 410)
        self.assertEqual(daemon.status(timed)["image"], "gone")
        self.assertEqual(len(os.listdir(os.path.join(self.data_dir, "set-aside"))), 3)
        self.assertIn("damaged", daemon.log())

    def test_an_image_that_has_been_removed_is_rendered_again(self):
        daemon = self.start()
        jobs = [daemon.submit(noisy_job(0, size, size)) for size in (64, 128)]
        for job in jobs:
            daemon.wait_ended(job)
        images = [self.image(daemon, job) for job in jobs]
        daemon.kill()
        os.remove(os.path.join(self.data_dir, "images", f"{jobs[1]}.film"))
        self.in_journal("DELETE FROM images")
        daemon = self.start()
        for job, image in zip(jobs, images):
            self.assertEqual(daemon.wait_ended(job)["state"], "completed")
            self.assertEqual(self.image(daemon, job), image)

    def test_a_full_disk_holds_jobs_up_and_loses_none(self):
        daemon = self.start("--threads", "1")
        job = daemon.submit(noisy_job(0, 128, 64))
        daemon.wait_until(job, lambda status: status["state"] == "rendering")
        with daemon.full_disk():
            self.assertEqual(daemon.request("POST", "/v1/jobs", noisy_job(1)).status, 507)
            self.assertEqual(daemon.request("GET", "/v1/jobs").json()["jobs"][1:], [])
            daemon.wait_until(job, lambda status: status["samples_done"] == status["samples_total"])
            self.assertNotIn(daemon.status(job)["state"], ENDED)
        self.assertEqual(daemon.wait_ended(job)["state"], "completed")
        image = self.image(daemon, job)
        daemon = self.restarted(daemon)
        self.assertEqual(self.image(daemon, job), image)

    def test_a_cancel_that_cannot_be_written_stops_the_work_and_says_so(self):
        daemon = self.start("--threads", "1")
        job = daemon.submit(noisy_job(0, 128, 4096))
        daemon.wait_until(job, lambda status: status["state"] == "rendering")
        with daemon.full_disk():
            refused = daemon.request("POST", f"/v1/jobs/{job}/cancel")
            self.assertEqual(refused.status, 507)
            self.assertIn("has stopped all the same", refused.json()["detail"])
            self.assertEqual(daemon.status(job)["state"], "canceled")
        daemon.submit(noisy_job(1, 8, 1))  # What is written later is written behind it.
        self.assertEqual(self.restarted(daemon).status(job)["state"], "canceled")

    def test_a_job_goes_on_from_its_tiles(self):
        """Of a job that renders for seconds, nothing is done twice; its figures and its image are as ever."""
        document = noisy_job(0, 320, 96)  # In passes up to 1, 4, 16, 64 and 96 samples.
        daemon = self.start("--threads", "1")
        job = daemon.submit(document)
        pixels = 320 * 320
        for part in (0.2, 0.5):
            enough = pixels * (64 + 32 * part)
            status = daemon.wait_until(job, lambda status: status["samples_done"] > enough)
            self.assertEqual(status["state"], "rendering")
            daemon = self.restarted(daemon, "--threads", "1")
            again = daemon.wait_until(job, lambda status: status["state"] == "rendering")
            self.assertGreater(again["samples_done"], status["samples_done"] - pixels * 32 * 0.1)
            self.assertEqual(again["passes"], 4)
        status = daemon.wait_ended(job)
        self.assertEqual(status["samples_done"], status["samples_total"])
        undisturbed = daemon.submit(document)
        expected = daemon.wait_ended(undisturbed)
        for key in ("passes", "tiles_done", "samples_done", "samples_per_pixel"):
            self.assertEqual(status[key], expected[key], key)
        rays, expected = (self.report(daemon, it, "stats")["rays"] for it in (job, undisturbed))
        self.assertEqual(rays, expected)
        self.assertEqual(self.image(daemon, job), self.image(daemon, undisturbed))
        daemon = self.restarted(daemon)
        self.assertEqual(os.listdir(os.path.join(self.data_dir, "tiles")), [])

    def scrub(self):
        command = [os.environ["TESSERAD"], "--scrub", "--data-dir", self.data_dir]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        return done.returncode, done.stdout + done.stderr

    def test_a_damaged_journal_is_told_of_and_what_can_be_read_is_kept(self):
        """Nothing starts with it, or changes it, but who runs the server; then all that isn't on damaged pages is there."""
        daemon = self.start()
        jobs = [daemon.submit(noisy_job(seed, 16 if seed else 128, 1)) for seed in range(40)]
        for job in jobs:
            daemon.wait_ended(job)
        images = {job: self.image(daemon, job) for job in jobs}
        daemon.kill()
        journal = os.path.join(self.data_dir, "journal.db")
        whole, saved = self.data_dir, self.data_dir + "-saved"
        shutil.copytree(whole, saved)

        def overwrite(path, at, text):
            with open(path, "r+b") as file:
                file.seek(at)
                file.write(text)

        def checkpointed():
            self.in_journal("PRAGMA wal_checkpoint(TRUNCATE)")

        def page_overwritten():
            checkpointed()
            overwrite(journal, 20 * 4096, os.urandom(4096))

        def header_overwritten():
            checkpointed()
            overwrite(journal, 0, b"garbage " * 16)

        def cut_off():
            checkpointed()
            os.truncate(journal, os.path.getsize(journal) // 8192 * 4096)

        def emptied():
            checkpointed()
            os.truncate(journal, 0)

        def gone():
            checkpointed()
            os.remove(journal)

        def entry_changed():
            self.in_journal("UPDATE events SET body = replace(body, '128', '127') WHERE job = ?", (jobs[0],))
            checkpointed()

        def log_damaged():
            overwrite(journal + "-wal", 32 + 4120 * 40 + 1000, b"garbage")

        def log_header_damaged():
            overwrite(journal + "-wal", 10, b"garbage")

        def file_emptied_beside_its_log():
            os.truncate(journal, 0)

        for damage, least in (
            (page_overwritten, 35),
            (header_overwritten, 40),
            (cut_off, 5),
            (emptied, 0),
            (gone, 0),
            (entry_changed, 39),
            (log_damaged, 35),
            (log_header_damaged, 40),
            (file_emptied_beside_its_log, 40),
        ):
            with self.subTest(damage.__name__):
                shutil.rmtree(whole)
                shutil.copytree(saved, whole)
                damage()
                for _ in range(2):
                    with self.assertRaisesRegex(RuntimeError, "journal.db is damaged: .*tesserad --scrub"):
                        Daemon(data_dir=self.data_dir)
                self.assertEqual(len(os.listdir(os.path.join(whole, "images"))), 1, "none is removed")
                status, said = self.scrub()
                self.assertEqual(status, 1, said)
                self.assertIn("damaged, and set aside: " + journal, said)
                daemon = Daemon(data_dir=self.data_dir)
                listed = [job["id"] for job in daemon.request("GET", "/v1/jobs?limit=1000").json()["jobs"]]
                self.assertGreaterEqual(len(listed), least, said)
                self.assertLessEqual(set(listed), set(jobs))
                for job in listed:
                    self.assertEqual(daemon.wait_ended(job)["state"], "completed")
                    # Of an image that stood on a damaged page of the log that is told, and it is rendered again.
                    if daemon.request("GET", f"/v1/jobs/{job}/image?format=exr&aov=all").status == 409:
                        self.assertEqual(daemon.wait_ended(job)["state"], "completed")
                    self.assertEqual(self.image(daemon, job), images[job])
                aside = os.listdir(os.path.join(whole, "set-aside"))
                self.assertEqual(any(name.startswith("data-journal.db") for name in aside), damage != gone)
                if jobs[0] not in listed:
                    self.assertIn(f"images-{jobs[0]}.film", aside)
                later = daemon.submit(noisy_job(100, 16, 1))
                daemon.wait_ended(later)
                daemon.stop()
                self.assertEqual(self.scrub()[0], 0)

    def test_a_submission_that_is_repeated_is_the_same_job(self):
        daemon = self.start()
        key = {"Idempotency-Key": '"one"'}
        first = daemon.request("POST", "/v1/jobs", SMALL_JOB, key)
        self.assertEqual(first.status, 201)
        job = first.json()["id"]
        for _ in range(2):
            again = daemon.request("POST", "/v1/jobs", SMALL_JOB, key)
            self.assertEqual((again.status, again.json()["id"]), (200, job))
            self.assertEqual(again.headers["Location"], first.headers["Location"])
            reused = daemon.request("POST", "/v1/jobs", noisy_job(), key)
            self.assertEqual((reused.status, reused.json()["code"]), (422, "idempotency_key_reused"))
            daemon = self.restarted(daemon)
        other = daemon.request("POST", "/v1/jobs", SMALL_JOB, {"Idempotency-Key": "two"})
        self.assertEqual(other.status, 201)
        self.assertNotEqual(other.json()["id"], job)
        self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB, {"Idempotency-Key": '""'}).status, 400)
        refused = daemon.request("POST", "/v1/jobs", {"scene": 1}, {"Idempotency-Key": "three"})
        self.assertEqual(refused.status, 422)
        self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB, {"Idempotency-Key": "three"}).status, 201)
        daemon.wait_ended(job)
        self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{job}").status, 204)
        self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB, key).status, 201)

    def test_killed_at_any_moment(self):
        """A script of work, and a daemon that is killed all through it (TESSERA_KILLS times, seed TESSERA_SEED)."""
        seed, kills = int(os.environ.get("TESSERA_SEED", "1")), int(os.environ.get("TESSERA_KILLS", "12"))
        random = Random(seed)
        daemon = self.start("--threads", "2")
        accepted = {}  # What was asked for, by id.
        removed = set()
        wrong = []

        def work(stop):
            """Posts and deletes until it is told to stop, or the daemon has gone."""
            with contextlib.suppress(OSError, http.client.HTTPException):
                while not stop.is_set():
                    document = noisy_job(random.randrange(4), random.choice((16, 48, 96)), random.choice((1, 16, 64)))
                    reply = daemon.request("POST", "/v1/jobs", document)
                    if reply.status != 201:
                        wrong.append(reply.body)
                        return
                    job = reply.json()["id"]
                    accepted[job] = document
                    if random.random() < 0.2:
                        doomed = random.choice(sorted(accepted))
                        removed.add(doomed)  # Whether it is still there isn't known, if the daemon dies first.
                        if daemon.request("DELETE", f"/v1/jobs/{doomed}").status == 409:
                            removed.discard(doomed)

        for _ in range(kills):
            stop = threading.Event()
            client = threading.Thread(target=work, args=(stop,))
            client.start()
            time.sleep(random.uniform(0.01, 0.5))
            daemon.process.kill()
            stop.set()
            client.join()
            self.assertEqual(wrong, [])
            daemon = self.restarted(daemon, "--threads", "2")
            for job in sorted(set(accepted) - removed):
                self.assertEqual(daemon.request("GET", f"/v1/jobs/{job}").status, 200, f"{job} is lost (seed {seed})")
        images = {}
        with Daemon() as undisturbed:
            for job, document in accepted.items():
                if job in removed:
                    continue
                self.assertEqual(daemon.wait_ended(job)["state"], "completed")
                key = str(document)
                if key not in images:
                    images[key] = self.image(undisturbed, self.rendered(undisturbed, document))
                self.assertEqual(self.image(daemon, job), images[key], f"{job}: {document} (seed {seed})")

    @staticmethod
    def rendered(daemon, document):
        job = daemon.submit(document)
        daemon.wait_ended(job)
        return job


if __name__ == "__main__":
    unittest.main()
