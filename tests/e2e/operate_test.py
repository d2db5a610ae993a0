"""What somebody needs who runs the daemon: metrics, logs, readiness, signals."""

import contextlib
import json
import os
import re
import resource
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest
import unittest.mock

from daemon import SOURCE, Daemon, make_key
from documents import ENDLESS_PIXEL, SMALL_JOB, SPHERE

# The last thing that is said of a SIGHUP, whatever comes of it.
RELOADED = re.compile("SIGHUP: the (log's level is|settings stay as they are)")
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

            # A request is counted when it has been answered, which may be a moment after its answer was read, and by
            # another thread than the last one's.
            livez = {"route": "/livez", "method": "GET", "code": 200}
            metrics = until(lambda: Metrics(daemon),
                            lambda m: m("tessera_http_requests_total", **of_none, code=501) == 1
                            and m("tessera_http_requests_total", **livez) == 2)
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
                connection = daemon.connect()
                for path_of_request in ("/livez", "/v1/version"):  # When the second is answered, the first has been told.
                    connection.request("GET", path_of_request)
                    connection.getresponse().read()
                with open(path, "w", encoding="ascii") as file:
                    file.write("log-format = json\naccess-log = true\n")
                daemon.process.send_signal(signal.SIGHUP)
                until(daemon.log, RELOADED.search)
                daemon.request("GET", "/livez", headers={"X-Request-Id": "later"})
                self.assertEqual(json.loads(self.wait_for_line(daemon, ["later"]))["path"], "/livez")
                self.assertEqual(daemon.log().count("/livez"), 1)


class ReadyTest(unittest.TestCase):
    def not_ready(self, daemon, name):
        """What is wrong with the one thing that isn't ready."""
        reply = daemon.request("GET", "/readyz")
        self.assertEqual((reply.status, reply.headers["Retry-After"]), (503, "1"))
        problem = reply.json()
        self.assertEqual(problem["code"], "not_ready")
        self.assertEqual([key for key, check in problem["checks"].items() if not check["ready"]], [name])
        self.assertEqual(problem["detail"], f"{name}: {problem['checks'][name]['problem']}.")
        self.assertEqual(daemon.request("GET", "/livez").status, 200)
        return problem["checks"][name]["problem"]

    def test_details(self):
        with Daemon("--max-jobs", "7", "--min-free-disk", "1MiB") as daemon:
            checks = daemon.request("GET", "/readyz").json()["checks"]
            self.assertEqual(checks["queue"], {"ready": True, "unfinished_jobs": 0, "limit_jobs": 7, "waiting_for_memory": 0})
            self.assertEqual(checks["disk"]["least_free_bytes"], 1 << 20)
            self.assertEqual(checks["memory"]["unfinished_bytes"], 0)
            stat = os.statvfs(daemon.data_dir)
            # Others write to the same disk.
            self.assertAlmostEqual(checks["disk"]["free_bytes"] / (stat.f_bavail * stat.f_frsize), 1, delta=0.1)

    def test_the_queue_is_full(self):
        with Daemon("--max-jobs", "1") as daemon:
            job = daemon.submit(ENDLESS_PIXEL)
            self.assertIn("1 jobs", self.not_ready(daemon, "queue"))
            daemon.request("POST", f"/v1/jobs/{job}/cancel")
            self.assertEqual(daemon.request("GET", "/readyz").status, 200)

    def test_the_disk_is_full(self):
        with Daemon("--min-free-disk", "900000TiB") as daemon:
            self.assertIn("--min-free-disk", self.not_ready(daemon, "disk"))

    def test_the_data_folder_is_lost(self):
        with Daemon() as daemon:
            away = daemon.data_dir + ".away"
            os.rename(daemon.data_dir, away)
            self.assertIn("the data folder is lost", self.not_ready(daemon, "disk"))
            os.rename(away, daemon.data_dir)
            self.assertEqual(daemon.request("GET", "/readyz").status, 200)
            os.rename(os.path.join(daemon.data_dir, "blobs"), away)
            self.assertIn("blobs/", self.not_ready(daemon, "disk"))
            os.rename(away, os.path.join(daemon.data_dir, "blobs"))
            if os.geteuid() != 0:  # Whom nothing is forbidden.
                os.chmod(daemon.data_dir, 0o500)
                self.assertIn("written", self.not_ready(daemon, "disk"))
                os.chmod(daemon.data_dir, 0o700)
            self.assertEqual(daemon.request("GET", "/readyz").status, 200)


class DrainTest(unittest.TestCase):
    def until_draining(self, daemon):
        daemon.terminate()
        reply = until(lambda: daemon.request("GET", "/readyz"), lambda reply: reply.status == 503)
        self.assertEqual(reply.json()["code"], "shutting_down")

    def test_jobs_go_on_and_none_is_taken(self):
        with Daemon("--drain-seconds", "3600", "--threads", "2") as daemon:
            endless = daemon.submit(ENDLESS_PIXEL)
            job = daemon.submit({"scene": SPHERE, "image": {"width": 200, "height": 200}, "settings": {"samples": 64}})
            self.until_draining(daemon)
            for path in ("/v1/jobs", "/v1/render"):
                refused = daemon.request("POST", path, SMALL_JOB)
                self.assertEqual((refused.status, refused.json()["code"]), (503, "shutting_down"))
                self.assertIn("Retry-After", refused.headers)
            self.assertEqual(daemon.request("GET", "/livez").status, 200)
            self.assertEqual(daemon.wait_ended(job)["state"], "completed")
            self.assertEqual(daemon.request("GET", f"/v1/jobs/{job}/image").status, 200)
            self.assertEqual(daemon.status(endless)["state"], "rendering")
            self.assertIsNone(daemon.process.poll())
            daemon.request("POST", f"/v1/jobs/{endless}/cancel")  # The last one: there is nothing to wait for.
            self.assertEqual(daemon.process.wait(timeout=60), 0)

    def test_a_second_signal_ends_it(self):
        for second in (signal.SIGTERM, signal.SIGINT):
            with self.subTest(second), Daemon("--drain-seconds", "3600") as daemon:
                daemon.submit(ENDLESS_PIXEL)
                self.until_draining(daemon)
                daemon.process.send_signal(second)
                self.assertEqual(daemon.process.wait(timeout=60), 0)
                self.assertIn("1 jobs are ended before they are done", daemon.log())

    def test_its_time_ends(self):
        with Daemon("--drain-seconds", "1") as daemon:
            daemon.submit(ENDLESS_PIXEL)
            daemon.terminate()
            self.assertEqual(daemon.process.wait(timeout=60), 0)
            self.assertIn("1 jobs are ended before they are done", daemon.log())

    def test_nothing_to_wait_for(self):
        with Daemon("--drain-seconds", "3600") as daemon:
            daemon.wait_ended(daemon.submit(SMALL_JOB))
            self.assertEqual(daemon.stop(), 0)


class ReloadTest(unittest.TestCase):
    def test_limits(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "settings")

            def reload(text):
                with open(path, "w", encoding="ascii") as file:
                    file.write(text)
                before = len(RELOADED.findall(daemon.log()))
                daemon.process.send_signal(signal.SIGHUP)
                until(daemon.log, lambda log: len(RELOADED.findall(log)) > before)

            def limits():
                return daemon.request("GET", "/v1/capabilities").json()["limits"]

            with open(path, "w", encoding="ascii") as file:
                file.write("max-jobs = 5\n")
            with Daemon("--config", path, "--max-ended-jobs", "9") as daemon:
                self.assertEqual(limits()["unfinished_jobs"], 5)
                reload("max-jobs = 1\nmax-ended-jobs = 3\nmax-film-memory = 1MiB\nmax-connections = 17\n"
                       "min-free-disk = 900000TiB")
                now = limits()
                self.assertEqual((now["unfinished_jobs"], now["ended_jobs"], now["film_bytes"], now["connections"]),
                                 (1, 9, 1 << 20, 17))  # The command line wins.
                self.assertFalse(daemon.request("GET", "/readyz").json()["checks"]["disk"]["ready"])
                job = daemon.submit(ENDLESS_PIXEL)
                self.assertEqual(daemon.request("POST", "/v1/jobs", SMALL_JOB).status, 429)
                reload("max-jobs = none")
                self.assertEqual(limits()["unfinished_jobs"], 1)
                reload("max-jobs = 2")
                self.assertEqual(daemon.request("GET", "/readyz").status, 200)
                daemon.submit(ENDLESS_PIXEL)
                self.assertEqual(daemon.status(job)["state"], "rendering")


class ServiceManagerTest(unittest.TestCase):
    """systemd's side of sd_notify(3)."""

    def listen(self, address):
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.addCleanup(listening.close)
        listening.settimeout(60)
        listening.bind(address)
        return listening

    def until_told(self, listening, first):
        """The next message that begins so; watchdog's don't matter."""
        while True:
            lines = listening.recv(4096).decode().split("\n")
            if lines[0] == first:
                return lines
            self.assertEqual(lines, ["WATCHDOG=1"])

    def test_states_and_watchdog(self):
        with tempfile.TemporaryDirectory() as folder:
            listening = self.listen(os.path.join(folder, "notify"))
            env = {"NOTIFY_SOCKET": listening.getsockname(), "WATCHDOG_USEC": "2000000"}
            with Daemon("--drain-seconds", "3600", env=env) as daemon:
                self.until_told(listening, "READY=1")
                for _ in range(3):
                    self.assertEqual(listening.recv(4096), b"WATCHDOG=1")
                before = time.monotonic_ns() // 1000
                daemon.process.send_signal(signal.SIGHUP)
                reloading = self.until_told(listening, "RELOADING=1")
                self.assertGreaterEqual(int(reloading[1].removeprefix("MONOTONIC_USEC=")), before)
                self.until_told(listening, "READY=1")
                job = daemon.submit(ENDLESS_PIXEL)
                daemon.terminate()
                self.until_told(listening, "STOPPING=1")
                self.assertEqual(listening.recv(4096), b"WATCHDOG=1")  # Draining isn't hanging.
                daemon.request("POST", f"/v1/jobs/{job}/cancel")
                self.assertEqual(daemon.process.wait(timeout=60), 0)

    def test_abstract_names_and_others_watchdogs(self):
        name = f"tessera-test-{os.getpid()}"
        listening = self.listen("\0" + name)
        env = {"NOTIFY_SOCKET": "@" + name, "WATCHDOG_USEC": "100000", "WATCHDOG_PID": "1"}
        with Daemon(env=env) as daemon:
            self.assertEqual(listening.recv(4096), b"READY=1")
            self.assertEqual(daemon.stop(), 0)
            self.assertEqual(listening.recv(4096), b"STOPPING=1")

    def test_nobody_listens(self):
        for address in ("/nowhere/notify", "@nobody-listens", "/", "", "relative", "/" + "x" * 200):
            with self.subTest(address), Daemon(env={"NOTIFY_SOCKET": address, "WATCHDOG_USEC": "many"}) as daemon:
                self.assertEqual(daemon.request("GET", "/readyz").status, 200)


class DescriptorTest(unittest.TestCase):
    def test_the_soft_limit_is_raised(self):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(200, hard), hard))
        try:
            with Daemon("--max-connections", "150") as daemon:
                self.assertEqual(Metrics(daemon)("process_max_fds"), hard)
                self.assertEqual(Metrics(daemon)("tessera_http_connections_limit"), 150)
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))

    def test_connections_that_there_are_no_descriptors_for(self):
        with tempfile.TemporaryDirectory() as folder:
            limited = os.path.join(folder, "limited")
            with open(limited, "w", encoding="ascii") as file:
                file.write(f'#!/bin/sh\nulimit -n 128\nexec "{os.environ["TESSERAD"]}" "$@"\n')
            os.chmod(limited, 0o755)
            with Daemon("--max-connections", "1000", program=limited) as daemon:
                self.assertEqual(daemon.request("GET", "/v1/capabilities").json()["limits"]["connections"], 64)
                self.assertEqual(daemon.count_in_log("of --max-connections 1000 only 64 are taken"), 1)


class UnitTest(unittest.TestCase):
    """deploy/tesserad.service."""

    path = os.path.join(SOURCE, "deploy", "tesserad.service")

    def settings(self):
        with open(self.path, encoding="utf-8") as file:
            return dict(line.strip().split("=", 1) for line in file if "=" in line and not line.startswith("#"))

    def test_it_outlasts_the_drain(self):
        told = subprocess.run([os.environ["TESSERAD"], "--help"], capture_output=True, text=True, check=True).stdout
        drain = int(re.search(r"--drain-seconds [^\n]*=(\d+) ", told).group(1))
        self.assertGreaterEqual(int(self.settings()["TimeoutStopSec"]), drain + 5)  # Twice two seconds come after it.
        connections = int(re.search(r"--max-connections [^\n]*=(\d+) ", told).group(1))
        self.assertGreaterEqual(int(self.settings()["LimitNOFILE"]), 2 * connections)
        self.assertEqual(self.settings()["Type"], "notify")

    def test_systemd_finds_it_hardened(self):
        if not shutil.which("systemd-analyze"):
            self.skipTest("no systemd-analyze")
        said = subprocess.run(["systemd-analyze", "security", "--offline=true", "--threshold=20", self.path],
                              capture_output=True, text=True, check=False)
        self.assertEqual(said.returncode, 0, said.stdout + said.stderr)
        with open(self.path, encoding="utf-8") as file, tempfile.TemporaryDirectory() as folder:
            unit = os.path.join(folder, "tesserad.service")
            with open(unit, "w", encoding="utf-8") as with_program:
                with_program.write(file.read().replace("/usr/local/bin/tesserad", os.path.abspath(os.environ["TESSERAD"])))
            said = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True, check=False)
            self.assertEqual((said.returncode, said.stderr), (0, ""))


class DoctorTest(unittest.TestCase):
    def ask(self, *arguments, url="", status=0):
        """What the doctor finds, as {check: (verdict, detail, advice)}."""
        said = subprocess.run([os.environ["TESSERA"], "--server", url, "--json", "doctor", *arguments], text=True,
                              capture_output=True, check=False, timeout=120)
        findings = {f["check"]: (f["verdict"], f["detail"], f["advice"]) for f in json.loads(said.stdout)["findings"]}
        self.assertEqual(said.returncode, status, findings)
        for verdict, detail, advice in findings.values():
            self.assertTrue(detail)
            self.assertEqual(advice == "", verdict == "ok", (detail, advice))
        return findings

    def test_a_server_that_wants_a_key(self):
        with tempfile.TemporaryDirectory() as folder:
            key = make_key(folder)
            with Daemon(data_dir=folder) as daemon:
                found = self.ask(url=daemon.url, status=1)
                self.assertEqual(list(found), ["server"])
                self.assertIn("key", found["server"][2])
                with unittest.mock.patch.dict(os.environ, {"TESSERA_KEY": key}):
                    found = self.ask(url=daemon.url)
                self.assertEqual(found["render"][0], "ok", found)

    def test_all_is_well(self):
        with Daemon() as daemon:
            os.chmod(daemon.data_dir, 0o700)
            found = self.ask("--data-dir", daemon.data_dir, url=daemon.url)
            self.assertEqual(list(found), ["server", "version", "clock", "disk", "isolation", "memory", "queue", "descriptors",
                                           "render", "data folder", "disk space", "process", "memory limit"])
            for check in ("server", "version", "clock", "disk", "isolation", "memory", "queue", "render", "data folder",
                          "process"):
                self.assertEqual(found[check][0], "ok", found[check])
            self.assertIn(f"process {daemon.process.pid} ", found["process"][1])
            self.assertEqual(daemon.request("GET", "/v1/jobs").json()["jobs"], [])  # It leaves nothing behind.
            lines = subprocess.run([os.environ["TESSERA"], "--server", daemon.url, "doctor"], text=True, check=True,
                                   capture_output=True).stdout.splitlines()
            self.assertEqual(len(lines), 9)
            for line in lines:
                self.assertRegex(line, r"^(ok|warn|FAIL) +[a-z ]+  ")

    def test_what_is_wrong(self):
        with Daemon("--max-jobs", "1", "--min-free-disk", "900000TiB") as daemon:
            daemon.submit(ENDLESS_PIXEL)
            os.chmod(daemon.data_dir, 0o777)
            found = self.ask("--data-dir", daemon.data_dir, url=daemon.url, status=1)
            self.assertEqual([check for check, (verdict, *_) in found.items() if verdict == "FAIL"],
                             ["disk", "queue", "render"])
            self.assertEqual(found["data folder"][0], "warn")
            shutil.rmtree(os.path.join(daemon.data_dir, "blobs"))
            self.assertEqual(self.ask("--data-dir", daemon.data_dir, url=daemon.url, status=1)["data folder"][0], "FAIL")
            self.assertEqual(self.ask("--data-dir", "/nowhere", url=daemon.url, status=1)["data folder"][0], "FAIL")

    def test_no_server(self):
        with socket.socket() as unused:
            unused.bind(("127.0.0.1", 0))
            found = self.ask(url=f"http://127.0.0.1:{unused.getsockname()[1]}", status=1)
        self.assertEqual([(check, verdict) for check, (verdict, *_) in found.items()], [("server", "FAIL")])

    def test_another_server(self):
        with Daemon() as daemon, tempfile.TemporaryDirectory() as folder:
            found = self.ask("--data-dir", folder, url=daemon.url, status=1)
            self.assertEqual(found["data folder"][0], "FAIL")  # Nothing of a server's is in there.


if __name__ == "__main__":
    unittest.main()
