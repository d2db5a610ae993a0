"""What somebody needs who runs the daemon: metrics, logs, readiness, signals."""

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
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


class RequestIdTest(unittest.TestCase):
    def test_answers_carry_it(self):
        with Daemon() as daemon:
            for path, status in (("/livez", 200), ("/nothing", 404), ("/v1/jobs?limit=x", 400)):
                with self.subTest(path):
                    reply = daemon.request("GET", path, headers={"X-Request-Id": "mine-1"})
                    self.assertEqual((reply.status, reply.headers.get_all("X-Request-Id")), (status, ["mine-1"]))
                    if status != 200:
                        self.assertEqual(reply.json()["request_id"], "mine-1")
            made = set()
            for given in ("a b", "x" * 129, 'a"b', "{}", "", "caf\xe9", None):
                reply = daemon.request("GET", "/nothing", headers={} if given is None else {"X-Request-Id": given})
                self.assertNotEqual(reply.headers["X-Request-Id"], given)
                self.assertEqual(reply.headers["X-Request-Id"], reply.json()["request_id"])
                made.add(reply.headers["X-Request-Id"])
            self.assertEqual(len(made), 7)
            reply = daemon.request("GET", "/bad%", headers={"X-Request-Id": "mine-2"})
            self.assertEqual((reply.status, reply.json()["request_id"]), (400, "mine-2"))

    def test_what_is_no_request_has_one(self):
        with Daemon() as daemon, contextlib.closing(daemon.connect()) as connection:
            connection.send(b"BROKEN\r\n\r\n")
            answer = b""
            while piece := connection.sock.recv(4096):
                answer += piece
            head, body = answer.split(b"\r\n\r\n")
            self.assertIn(b"X-Request-Id: " + json.loads(body)["request_id"].encode(), head)


class LogTest(unittest.TestCase):
    def wait_for_line(self, daemon, words):
        """The first line of the log that has all of these words."""
        has_all = lambda line: all(word in line for word in words)
        return next(filter(has_all, until(lambda: daemon.log().splitlines(), lambda lines: any(map(has_all, lines)))))

    def test_access_log(self):
        with Daemon("--access-log", "--log-level", "warn") as daemon:
            daemon.request("GET", "/v1/jobs?limit=1", headers={"X-Request-Id": "one"})
            line = self.wait_for_line(daemon, ["request_id=one"])
            self.assertRegex(line, r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z info access method=GET "
                             r'path="/v1/jobs\?limit=1" status=200 bytes=\d+ seconds=\d+\.\d{6} client=127\.0\.0\.1 '
                             r"request_id=one$")
            daemon.request("HEAD", "/nothing", headers={"X-Request-Id": "two"})
            self.assertIn("method=HEAD path=/nothing status=404", self.wait_for_line(daemon, ["request_id=two"]))
        with Daemon() as daemon:
            daemon.request("GET", "/livez")
            self.assertNotIn("access", daemon.log())

    def test_lines_of_a_request_carry_its_id(self):
        with Daemon("--log-format", "json") as daemon:
            reply = daemon.request("POST", "/v1/jobs", SMALL_JOB, {"X-Request-Id": "maker"})
            line = self.wait_for_line(daemon, [reply.json()["id"], "queued"])
            self.assertEqual(json.loads(line)["request_id"], "maker")

    def test_json_lines(self):
        hostile = b'GET /a"b%0a{"level":"error"} HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n'
        raw = b"GET /\x1b[31m\xff\x85 HTTP/1.1\r\nHost: a\r\nX-Request-Id: raw\r\nConnection: close\r\n\r\n"
        with Daemon("--access-log", "--log-format", "json", "--log-level", "debug") as daemon:
            daemon.wait_ended(daemon.submit(SMALL_JOB))
            for sent in (hostile, raw, b"\x00\x01\r\n\r\n"):
                with contextlib.closing(daemon.connect()) as connection:
                    connection.send(sent)
                    while connection.sock.recv(4096):
                        pass
            daemon.request("GET", "/livez", headers={"X-Request-Id": "last"})
            self.wait_for_line(daemon, ['"request_id":"last"', "access"])
            lines = [json.loads(line) for line in daemon.log().splitlines()]
            for line in lines:
                self.assertLessEqual({"ts", "level", "message"}, line.keys())
            access = [line for line in lines if line["message"] == "access"]
            for line in access:
                self.assertEqual(set(line) - {"ts", "level", "message"},
                                 {"method", "path", "status", "bytes", "seconds", "client", "request_id"})
                self.assertIsInstance(line["status"], int)
                self.assertIsInstance(line["seconds"], float)
            self.assertEqual(sum(line["status"] == 400 for line in access), 3)
            self.assertTrue(any("/?[31m" in line["path"] for line in access), access)

    def test_sighup_turns_the_access_log_on(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "settings")
            with open(path, "w", encoding="ascii") as file:
                file.write("log-format = text\n")
            with Daemon("--config", path) as daemon:
                daemon.request("GET", "/livez")
                with open(path, "w", encoding="ascii") as file:
                    file.write("log-format = json\naccess-log = true\n")
                daemon.process.send_signal(signal.SIGHUP)
                self.wait_for_line(daemon, ["SIGHUP"])
                daemon.request("GET", "/livez", headers={"X-Request-Id": "later"})
                self.assertEqual(json.loads(self.wait_for_line(daemon, ["later"]))["path"], "/livez")
                self.assertEqual(daemon.log().count("/livez"), 1)


if __name__ == "__main__":
    unittest.main()
