"""Many things at once: jobs in turn, one build for all, cancel, shutdown."""

import os
import threading
import time
import unittest

from daemon import Daemon
from documents import ENDLESS_PIXEL, SMALL_JOB, SPHERE, endless_job, grid_of_spheres


def all_at_once(count, work):
    """Runs work(0..count−1) in threads that start together; their results in order."""
    start = threading.Barrier(count)
    results = [None] * count

    def run(i):
        start.wait()
        results[i] = work(i)

    threads = [threading.Thread(target=run, args=(i,)) for i in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


class ConcurrencyTest(unittest.TestCase):
    def test_a_small_job_ends_while_a_huge_one_renders(self):
        with Daemon("--threads", "2") as daemon:
            huge = daemon.submit(endless_job())
            daemon.wait_until(huge, lambda status: status["state"] == "rendering")
            small = daemon.submit(SMALL_JOB)
            self.assertEqual(daemon.wait_ended(small)["state"], "completed")
            self.assertEqual(daemon.status(huge)["state"], "rendering")

    def test_two_jobs_at_once_share_the_threads(self):
        with Daemon("--threads", "1") as daemon:
            jobs = [daemon.submit(endless_job()) for _ in range(2)]
            for job in jobs:
                daemon.wait_until(job, lambda status: status["samples_done"] > 0)
            self.assertEqual([daemon.status(job)["state"] for job in jobs], ["rendering"] * 2)

    def test_answers_come_while_every_core_renders(self):
        with Daemon() as daemon:
            for _ in range(os.cpu_count()):
                daemon.submit(endless_job())
            slowest = 0
            for _ in range(50):
                start = time.monotonic()
                self.assertEqual(daemon.request("GET", "/livez").status, 200)
                slowest = max(slowest, time.monotonic() - start)
            print(f"slowest of 50 answers while every core renders: {slowest * 1000:.1f} ms")

    def test_identical_jobs_build_one_structure(self):
        scene = grid_of_spheres(20)
        job = {"scene": scene, "image": {"width": 8, "height": 8}, "settings": {"accel": {"kind": "bvh"}}}
        with Daemon("--threads", "2") as daemon:
            jobs = all_at_once(6, lambda _: daemon.submit(job))
            images = set()
            stats = []
            for job_id in jobs:
                self.assertEqual(daemon.wait_ended(job_id)["state"], "completed")
                images.add(daemon.request("GET", f"/v1/jobs/{job_id}/image?format=exr").body)
                stats.append(daemon.request("GET", f"/v1/jobs/{job_id}/stats").json())
            self.assertEqual(len(images), 1)
            self.assertEqual(sorted(s["structure"]["shared"] for s in stats), [False] + [True] * 5)
            self.assertEqual(len({s["structure"]["build_seconds"] for s in stats}), 1)

    def test_the_same_scene_posted_by_many(self):
        with Daemon() as daemon:
            replies = all_at_once(8, lambda _: daemon.request("POST", "/v1/scenes", SPHERE))
            self.assertEqual(len({reply.json()["scene"] for reply in replies}), 1)
            self.assertTrue({reply.status for reply in replies} <= {200, 201})
            self.assertEqual(len(os.listdir(os.path.join(daemon.data_dir, "scenes"))), 1)

    def check_that_it_lets_others_have_their_turn(self, threads, endless):
        """As many jobs as threads, each of one tile without an end; jobs of others, progress, and cancel."""
        with Daemon("--threads", str(threads)) as daemon:
            jobs = [daemon.submit(endless) for _ in range(threads)]
            for job in jobs:
                daemon.wait_until(job, lambda status: status["state"] == "rendering")
            small = daemon.submit(SMALL_JOB)
            self.assertEqual(daemon.wait_ended(small)["state"], "completed")
            for job in jobs:
                status = daemon.wait_until(job, lambda status: status["samples_done"] > 0)
                self.assertEqual((status["state"], status["tiles_done"], status["tiles_total"]), ("rendering", 0, 1))
                self.assertEqual(daemon.request("POST", f"/v1/jobs/{job}/cancel").json()["state"], "canceled")
            self.assertEqual(daemon.wait_ended(daemon.submit(SMALL_JOB))["state"], "completed")

    def test_pixels_of_billions_of_samples(self):
        self.check_that_it_lets_others_have_their_turn(2, ENDLESS_PIXEL)

    def test_a_tile_as_large_as_the_image(self):
        self.check_that_it_lets_others_have_their_turn(1, endless_job("whole"))

    def test_branches_between_panes_end(self):
        """Two branches at each of 64 surfaces: more rays than any machine traces, if it wasn't for their cut-offs."""
        pane = {"type": "whitted", "diffuse": [0, 0, 0], "reflect": [1, 1, 1], "transmit": [1, 1, 1], "ior": 1}
        sides = ((-1, -1), (1, -1), (1, 1), (-1, 1))
        quads = [[[x, y, 2 * z] for x, y in sides] for z in range(8)]
        scene = {
            "background": [1, 1, 1],
            "materials": {"pane": pane},
            "objects": [{"type": "quad", "corners": quad, "material": "pane"} for quad in quads],
            "camera": {"type": "perspective", "from": [0, 0, 9], "at": [0, 0, 0], "up": [0, 1, 0], "fov": 2},
        }
        job = {"scene": scene, "image": {"width": 8, "height": 8}, "settings": {"max_depth": 64}}
        with Daemon("--threads", "1") as daemon:
            panes = daemon.submit(job)
            self.assertEqual(daemon.wait_ended(panes)["state"], "completed")
            rays = daemon.request("GET", f"/v1/jobs/{panes}/stats").json()["rays"]
            self.assertGreater(rays["reflection"] + rays["refraction"], 64 * 1000)
            self.assertLessEqual(rays["reflection"] + rays["refraction"], 64 * 4096)

    def test_renders_that_are_more_than_the_memory_for_images_holds(self):
        """Room for four images: every job is admitted and completes, and the others are read from the disk."""
        with Daemon("--threads", "2", "--max-film-memory", str(4 * 16 * 16 * 12)) as daemon:
            ids = []
            for _ in range(200):
                ids.append(daemon.submit(SMALL_JOB))
                self.assertEqual(daemon.wait_ended(ids[-1])["state"], "completed")
                self.assertEqual(daemon.request("GET", f"/v1/jobs/{ids[-1]}/image").status, 200)
                self.assertEqual(daemon.request("GET", "/readyz").status, 200)
            jobs = daemon.request("GET", "/v1/jobs?limit=1000").json()["jobs"]
            self.assertEqual([job["id"] for job in jobs], ids)
            self.assertEqual([job["image"] for job in jobs], ["complete"] * 200)
            images = {daemon.request("GET", f"/v1/jobs/{job}/image").body for job in (ids[0], ids[100], ids[-1])}
            self.assertEqual(len(images), 1)

    def test_too_many_jobs(self):
        with Daemon("--threads", "1", "--max-jobs", "3") as daemon:
            replies = all_at_once(8, lambda _: daemon.request("POST", "/v1/jobs", endless_job()))
            self.assertEqual(sorted(reply.status for reply in replies), [201] * 3 + [429] * 5)
            self.assertTrue(all(reply.headers["Retry-After"] for reply in replies if reply.status == 429))
            accepted = next(reply.json()["id"] for reply in replies if reply.status == 201)
            self.assertEqual(daemon.request("POST", f"/v1/jobs/{accepted}/cancel").status, 202)
            self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB).status, 201)


class ProcessTest(unittest.TestCase):
    """The daemon as a program."""

    def test_sigterm_ends_it_cleanly_while_it_renders(self):
        for flags in ((), ("--threads", "1")):
            daemon = Daemon(*flags)
            job = daemon.submit(endless_job("whole"))
            daemon.wait_until(job, lambda status: status["state"] == "rendering")
            idle = daemon.connect()
            idle.connect()
            self.assertEqual(daemon.stop(), 0)
            idle.close()

    def test_settings_from_environment_and_file(self):
        with Daemon(env={"TESSERA_THREADS": "3", "TESSERA_MAX_JOBS": "7"}) as daemon:
            capabilities = daemon.request("GET", "/v1/capabilities").json()
            self.assertEqual((capabilities["threads"], capabilities["limits"]["unfinished_jobs"]), (3, 7))
            config = os.path.join(daemon.folder, "config.toml")
            with open(config, "w", encoding="utf-8") as file:
                file.write('threads = 2\nmax-blob = "5MiB"\n')
            for flags, env, threads in (
                ([], {}, 2),
                ([], {"TESSERA_THREADS": "4"}, 4),
                (["--threads", "1"], {"TESSERA_THREADS": "4"}, 1),
            ):
                with Daemon("--config", config, *flags, env=env) as other:
                    capabilities = other.request("GET", "/v1/capabilities").json()
                    self.assertEqual((capabilities["threads"], capabilities["limits"]["blob_bytes"]), (threads, 5 << 20))

    def test_what_it_cant_start_with(self):
        with Daemon() as daemon:
            config = os.path.join(daemon.folder, "config.toml")
            with open(config, "w", encoding="utf-8") as file:
                file.write("thraeds = 2\n")
            for flags in (["--config", config], ["--thraeds", "2"], ["--port", "65536"], ["--host", "nowhere"],
                          ["--asset-root", "/no/such/folder"]):
                with self.subTest(flags=flags), self.assertRaises(RuntimeError):
                    Daemon(*flags)
            with self.assertRaisesRegex(RuntimeError, "in use by another tesserad"):
                Daemon(data_dir=daemon.data_dir)


if __name__ == "__main__":
    unittest.main()
