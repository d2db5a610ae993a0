"""How the daemon starts, logs and listens to signals."""

import os
import signal
import subprocess
import tempfile
import time
import unittest

from daemon import Daemon
from documents import SMALL_JOB

POSITIVE = ("--timeout", "--max-connections", "--max-body", "--max-blob", "--max-bodies", "--max-jobs", "--max-ended-jobs",
            "--max-film-memory", "--max-structure-dir", "--max-pixels", "--max-samples", "--max-scene-memory")


def variable(flag):
    return "TESSERA_" + flag[2:].upper().replace("-", "_")


class FlagsTest(unittest.TestCase):
    def refused(self, flags, env=None):
        """What the daemon says to settings that make no sense."""
        clean = {k: v for k, v in os.environ.items() if not k.startswith("TESSERA_")}
        done = subprocess.run([os.environ["TESSERAD"], *flags], env={**clean, **(env or {})}, capture_output=True, text=True,
                              timeout=60, check=False)
        self.assertEqual(done.returncode, 2, (flags, env, done))
        self.assertEqual(done.stdout, "")
        return done.stderr

    def test_what_makes_no_sense_is_refused(self):
        for flag in POSITIVE:
            for value in ("0", "00", "-1", "many", ""):
                with self.subTest(flag, value=value):
                    self.assertIn(flag, self.refused([f"{flag}={value}"]))
        for flags in (["--port", "65536"], ["--threads", "-1"], ["--max-body", "0MiB"], ["--log-level", "loud"], ["--what"],
                      ["--timeout", "3601"], ["--max-blob-age", "30"], ["--max-scene-age", "1w"], ["--max-blob-age=-1d"],
                      ["--max-blob-age="], ["--max-blob-bytes=-1"], ["--scene-cache=-1"], ["--structure-cache=-1MiB"]):
            with self.subTest(flags):
                self.assertIn(flags[0].split("=")[0], self.refused(flags))

    def test_where_the_value_came_from(self):
        for flag in POSITIVE:
            with self.subTest(flag):
                self.assertIn(variable(flag), self.refused([], {variable(flag): "0"}))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "settings")
            for flag in POSITIVE:
                with self.subTest(flag), open(path, "w", encoding="ascii") as file:
                    file.write(f"{flag[2:]} = 0\n")
                    file.flush()
                    said = self.refused(["--config", path])
                    self.assertIn(flag, said)
                    self.assertIn(path, said)
                    self.assertIn(path, self.refused([], {"TESSERA_CONFIG": path}))
            said = self.refused(["--config", path, "--max-jobs", "0"], {"TESSERA_MAX_JOBS": "1"})
            self.assertNotIn("environment", said)

    def test_what_0_may_mean(self):
        with Daemon("--threads", "0", "--scene-cache", "0", "--structure-cache", "0") as daemon:
            self.assertGreater(daemon.request("GET", "/v1/capabilities").json()["threads"], 0)


class SignalsTest(unittest.TestCase):
    def test_sighup_reads_the_level_of_the_log_again(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "settings")

            def write(text):
                with open(path, "w", encoding="ascii") as file:
                    file.write(text)

            def wait_for(words):
                daemon.process.send_signal(signal.SIGHUP)
                deadline = time.monotonic() + 60
                while words not in daemon.log():
                    self.assertLess(time.monotonic(), deadline, daemon.log())
                    time.sleep(0.01)

            write("log-level = info\n")
            with Daemon("--config", path) as daemon:
                daemon.submit(SMALL_JOB)
                daemon.request("GET", "/v1/version")
                self.assertNotIn("GET /v1/version", daemon.log())
                write("log-level = debug\n")
                wait_for("level is debug")
                daemon.request("GET", "/v1/version")
                write("log-level = nothing\n")  # Which isn't taken, and told.
                wait_for("settings stay")
                self.assertGreater(daemon.count_in_log("GET /v1/version"), 0)
                write("max-jobs = 0\n")
                wait_for("--max-jobs")
                self.assertEqual(len(daemon.request("GET", "/v1/jobs").json()["jobs"]), 1)
                self.assertEqual(daemon.stop(), 0)

    def test_sighup_without_a_file(self):
        with Daemon() as daemon:
            for _ in range(10):
                daemon.process.send_signal(signal.SIGHUP)
                self.assertEqual(daemon.request("GET", "/readyz").status, 200)
            self.assertEqual(daemon.stop(), 0)


class UnreadLogTest(unittest.TestCase):
    """A log that nobody reads costs lines of it, and nothing else."""

    def start(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        reader, writer = os.pipe()
        self.addCleanup(os.close, reader)
        command = [os.environ["TESSERAD"], "--port", "0", "--data-dir", folder.name, "--log-level", "debug"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=writer, text=True)
        os.close(writer)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        daemon = Daemon.__new__(Daemon)
        daemon.process = process
        url = process.stdout.readline().strip()
        daemon.host, port = url[len("listening on http://") :].rsplit(":", 1)
        daemon.port = int(port)
        return daemon, reader

    def fill(self, daemon):
        """Asks, with many bytes for each line, until lines are dropped. Every answer comes."""
        connection = daemon.connect()
        for i in range(1000):
            connection.request("GET", f"/v1/jobs/{'a' * 4000}")
            response = connection.getresponse()
            response.read()
            self.assertEqual(response.status, 404)
            if i % 20 == 0 and (dropped := daemon.request("GET", "/livez").json()["log_lines_dropped"]):
                connection.close()
                return dropped
        self.fail("nothing was dropped")

    def test_lines_are_dropped_and_counted(self):
        daemon, reader = self.start()
        self.fill(daemon)
        for _ in range(30):  # Job routes log, too.
            job = daemon.submit(SMALL_JOB)
            daemon_ended = daemon.request("GET", f"/v1/jobs/{job}").status
            self.assertEqual(daemon_ended, 200)
        dropped = daemon.request("GET", "/livez").json()["log_lines_dropped"]
        log = b""
        while b"were dropped here" not in log:
            log += os.read(reader, 65536)
        daemon.process.terminate()
        while piece := os.read(reader, 65536):
            log += piece
        self.assertEqual(daemon.process.wait(timeout=60), 0)
        told = sum(int(line.split()[2]) for line in log.splitlines() if b"were dropped here" in line)
        self.assertGreaterEqual(told, dropped)
        self.assertTrue(log.endswith(b"stopped\n"), log[-300:])  # What is read is whole to the last line.

    def test_nobody_ever_reads(self):
        daemon, _ = self.start()
        self.fill(daemon)
        daemon.process.terminate()
        self.assertEqual(daemon.process.wait(timeout=60), 0)


if __name__ == "__main__":
    unittest.main()
