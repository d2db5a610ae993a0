"""What somebody needs who runs the daemon: metrics, logs, readiness, signals."""

import re
import shutil
import subprocess
import time
import unittest

from daemon import Daemon
from documents import SMALL_JOB

SAMPLE = re.compile(r"^([a-z_]+)(?:\{(.*)\})? (\S+)$")


def until(ask, is_enough, seconds=60):
    """Asks until the answer is enough; the answer."""
    deadline = time.monotonic() + seconds
    while not is_enough(answer := ask()):
        if time.monotonic() > deadline:
            raise AssertionError(f"after {seconds} s still {answer}")
        time.sleep(0.005)
    return answer


class Metrics:
    """A scrape, by name and labels."""

    def __init__(self, daemon):
        reply = daemon.request("GET", "/metrics")
        assert reply.status == 200, reply.body
        assert reply.headers["Content-Type"] == "text/plain; version=0.0.4; charset=utf-8"
        self.text = reply.body.decode()
        self.kinds = dict(line.split()[2:4] for line in self.text.splitlines() if line.startswith("# TYPE "))
        self.samples = {}
        for line in self.text.splitlines():
            if not line.startswith("#"):
                name, labels, value = SAMPLE.match(line).groups()
                self.samples[name, labels or ""] = float(value)

    def __call__(self, name, **labels):
        return self.samples.get((name, ",".join(f'{key}="{value}"' for key, value in labels.items())), 0)


class MetricsTest(unittest.TestCase):
    def test_promtool_finds_nothing_to_mend(self):
        if not shutil.which("promtool"):
            self.skipTest("no promtool: install Debian's prometheus to have the metrics checked")
        with Daemon() as daemon:
            daemon.wait_ended(daemon.submit(SMALL_JOB))
            daemon.request("GET", "/nothing")
            checked = subprocess.run(["promtool", "check", "metrics"], input=Metrics(daemon).text, text=True,
                                     capture_output=True, check=False)
            self.assertEqual((checked.returncode, checked.stdout, checked.stderr), (0, "", ""))

    def test_jobs_are_counted(self):
        with Daemon("--threads", "2") as daemon:
            jobs = [daemon.submit(SMALL_JOB) for _ in range(3)]
            states = [daemon.wait_ended(job)["state"] for job in jobs]
            self.assertEqual(states, ["completed"] * 3)
            daemon.request("DELETE", f"/v1/jobs/{jobs[0]}")
            metrics = Metrics(daemon)
            self.assertEqual(metrics("tessera_jobs", state="completed"), 2)
            self.assertEqual(metrics("tessera_jobs_ended_total", outcome="completed"), 3)
            self.assertEqual(metrics("tessera_jobs_ended_total", outcome="failed"), 0)
            for name in ("tessera_job_queue_seconds", "tessera_job_seconds"):
                self.assertEqual(metrics(name + "_count"), 3)
            self.assertGreater(metrics("tessera_job_seconds_sum"), 0)
            tiles = sum(daemon.request("GET", f"/v1/jobs/{job}/plan").json()["tiles"]["count"] for job in jobs[1:])
            self.assertGreaterEqual(metrics("tessera_tile_seconds_count"), tiles)
            rays = [daemon.request("GET", f"/v1/jobs/{job}/stats").json()["rays"] for job in jobs[1:]]
            for kind in ("camera", "shadow"):  # All three jobs are the same.
                self.assertEqual(metrics("tessera_rays_total", kind=kind), rays[0][kind] * 3)
            self.assertEqual(metrics("tessera_scheduler_threads"), 2)
            self.assertGreater(metrics("tessera_scheduler_core_seconds_total", state="busy"), 0)
            self.assertEqual(metrics("tessera_cache_requests_total", cache="structures", result="miss"), 1)
            self.assertGreater(metrics("tessera_memory_bytes", holder="cache_scenes"), 0)
            self.assertGreater(metrics("tessera_memory_bytes", holder="films_ended"), 0)

    def test_requests_are_counted_by_route(self):
        with Daemon() as daemon:
            job = daemon.submit(SMALL_JOB)
            daemon.wait_ended(job)
            for path in ("/livez", "/livez?what=1", f"/v1/jobs/{job}/plan", "/v1/jobs/none/plan", "/nothing", f"/{job}"):
                daemon.request("GET", path)
            daemon.request("HEAD", "/livez")
            daemon.request("BREW", "/livez")
            of_none = {"route": "none", "method": "any"}

            def count(route, code, method="GET"):
                return metrics("tessera_http_requests_total", route=route, method=method, code=code)

            # A request is counted when it has been answered, which may be a moment after its answer was read.
            metrics = until(lambda: Metrics(daemon), lambda m: m("tessera_http_requests_total", **of_none, code=501) == 1)
            self.assertEqual(count("/livez", 200), 2)
            self.assertEqual(count("/livez", 400), 1)
            self.assertEqual(count("/v1/jobs", 201, "POST"), 1)
            self.assertEqual(count("/v1/jobs/{id}/plan", 200), 1)
            self.assertEqual(count("/v1/jobs/{id}/plan", 404), 1)
            self.assertEqual(count("none", 404, "any"), 2)
            self.assertEqual(metrics("tessera_http_request_seconds_count", **of_none), 3)
            self.assertNotIn(job, metrics.text)
            self.assertGreaterEqual(metrics("tessera_http_connections"), 1)

    def test_units_and_histograms(self):
        with Daemon() as daemon:
            daemon.wait_ended(daemon.submit(SMALL_JOB))
            metrics = Metrics(daemon)
            for name, kind in metrics.kinds.items():
                self.assertRegex(name, r"^(tessera|process)_")
                self.assertEqual(name.endswith("_total"), kind == "counter", name)
            for (name, labels), value in metrics.samples.items():
                if not name.endswith("_bucket"):
                    continue
                series, bound = re.match(r'^(.*?),?le="(.*)"$', labels).groups()
                if bound == "+Inf":
                    self.assertEqual(value, metrics.samples[name.replace("_bucket", "_count"), series])
            # Of this process, as the system has it.
            with open(f"/proc/{daemon.process.pid}/limits", encoding="ascii") as file:
                most = next(line.split()[3] for line in file if line.startswith("Max open files"))
            self.assertEqual(metrics("process_max_fds"), float(most))
            self.assertLess(abs(metrics("process_start_time_seconds") - time.time()), 300)
            self.assertGreater(metrics("process_resident_memory_bytes"), 1 << 20)
            self.assertGreater(metrics("process_open_fds"), 5)
            self.assertGreater(metrics("process_threads"), 5)


if __name__ == "__main__":
    unittest.main()
