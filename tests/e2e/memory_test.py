"""One budget for memory: what never fits is refused, and what doesn't fit yet waits, without its scene."""

import tempfile
import unittest

from daemon import Daemon
from documents import SMALL_JOB

MIB = 1 << 20
# Of which jobs may work with 16 MiB: an eighth.
LITTLE = ("--memory", "128MiB", "--max-bodies", "64MiB", "--threads", "1")


def mesh_job(name, side, samples=1):
    """Over a grid of 2 side^2 triangles that no other name has."""
    places = [(x / side, y / side) for y in range(side + 1) for x in range(side + 1)]
    rows = range(0, side * (side + 1), side + 1)
    triangles = [
        corners
        for at in (row + x for row in rows for x in range(side))
        for corners in ([at, at + 1, at + side + 1], [at + 1, at + side + 2, at + side + 1])
    ]
    mesh = {"type": "mesh", "positions": [[x, y, x * y * len(name)] for x, y in places], "triangles": triangles}
    scene = {"objects": [mesh], "lights": [{"type": "environment", "radiance": [1, 1, 1]}]}
    return {"scene": scene, "image": {"width": 16, "height": 16}, "settings": {"samples": samples}}


ENDLESS = 2**28
BIG = 240  # Two of these don't fit together.


class MemoryTest(unittest.TestCase):
    def checks(self, daemon):
        return daemon.request("GET", "/readyz").json()["checks"]

    def assert_problem(self, reply, status, code):
        self.assertEqual((reply.status, reply.json()["code"]), (status, code), reply.body[:500])

    def test_what_it_may_take_is_divided(self):
        with Daemon("--memory", "512MiB") as daemon:
            memory = self.checks(daemon)["memory"]
            self.assertEqual(memory["limit_bytes"], 512 * MIB // 100 * 30)
            self.assertLess(memory["limit_bytes"] + memory["work_limit_bytes"], 512 * MIB)
            self.assertGreater(memory["work_limit_bytes"], 512 * MIB // 8)
            self.assertIn(f"tessera_memory_limit_bytes {512 * MIB}\n", daemon.request("GET", "/metrics").body.decode())
        with Daemon("--memory", "512MiB", "--max-film-memory", "1GiB") as daemon:
            memory = self.checks(daemon)["memory"]
            self.assertEqual(memory["limit_bytes"], 1024 * MIB, "what is given stands")
            self.assertGreaterEqual(memory["work_limit_bytes"], 512 * MIB // 8)

    def test_what_never_fits_is_refused(self):
        with Daemon(*LITTLE) as daemon:
            for path in ("/v1/jobs", "/v1/render"):
                reply = daemon.request("POST", path, mesh_job("a", 300))
                self.assert_problem(reply, 413, "job_too_large")
                self.assertEqual([error["pointer"] for error in reply.json()["errors"]], ["/scene"])
                reply = daemon.request("POST", path, {**SMALL_JOB, "image": {"width": 4000, "height": 2000}})
                self.assert_problem(reply, 413, "job_too_large")
                self.assertEqual([error["pointer"] for error in reply.json()["errors"]], ["/image"])
            self.assertEqual(daemon.request("GET", "/v1/jobs").json()["jobs"], [])

    def test_what_does_not_fit_yet_waits(self):
        with tempfile.TemporaryDirectory(prefix="tessera-e2e-") as folder:
            with Daemon(*LITTLE, data_dir=folder) as daemon:
                first = daemon.submit(mesh_job("a", BIG, ENDLESS))
                daemon.wait_until(first, lambda status: status["state"] == "rendering")
                second = daemon.submit(mesh_job("bb", BIG))
                self.assert_problem(daemon.request("POST", "/v1/render", mesh_job("ccc", BIG)), 503, "out_of_memory_budget")
                small = daemon.submit(SMALL_JOB)
                self.assertEqual(daemon.wait_ended(small)["state"], "completed", "there is room for that")
                self.assertEqual(daemon.status(second)["state"], "queued")
                self.assertEqual(self.checks(daemon)["queue"]["waiting_for_memory"], 1)
                daemon.kill()
            with Daemon(*LITTLE, data_dir=folder) as daemon:
                daemon.wait_until(first, lambda status: status["state"] == "rendering")
                self.assertEqual(daemon.status(second)["state"], "queued")
                self.assertEqual(daemon.request("POST", f"/v1/jobs/{first}/cancel").status, 202)
                self.assertEqual(daemon.wait_ended(second)["state"], "completed")
                self.assertEqual(self.checks(daemon)["queue"]["waiting_for_memory"], 0)

    def test_a_job_that_waits_can_be_canceled(self):
        with Daemon(*LITTLE) as daemon:
            first = daemon.submit(mesh_job("a", BIG, ENDLESS))
            second, third = daemon.submit(mesh_job("bb", BIG)), daemon.submit(mesh_job("ccc", BIG))
            self.assertEqual(daemon.request("POST", f"/v1/jobs/{second}/cancel").status, 202)
            self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{second}").status, 204)
            self.assertEqual(daemon.request("POST", f"/v1/jobs/{first}/cancel").status, 202)
            self.assertEqual(daemon.wait_ended(third)["state"], "completed")

    def test_jobs_of_one_scene_need_it_once(self):
        with Daemon(*LITTLE) as daemon:
            job = mesh_job("a", BIG, ENDLESS)
            jobs = [daemon.submit({**job, "settings": {**job["settings"], "seed": seed}}) for seed in range(3)]
            for each in jobs:
                daemon.wait_until(each, lambda status: status["state"] == "rendering")


if __name__ == "__main__":
    unittest.main()
