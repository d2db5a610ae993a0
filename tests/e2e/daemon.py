"""Starts the real daemon for a test and talks to it with nothing but http.client."""

import contextlib
import http.client
import json
import os
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

SOURCE = os.environ.get("TESSERA_SOURCE", os.path.join(os.path.dirname(__file__), "..", ".."))
SHARED_DATA = os.environ.get("TESSERA_SHARED_DATA", os.path.join(SOURCE, "..", "shared", "data"))
ENDED = ("completed", "failed", "canceled")


def shared_data(*parts):
    """A path in the shared data; skips the test, and says so, where it isn't there."""
    path = os.path.join(SHARED_DATA, *parts)
    if not os.path.exists(path):
        raise unittest.SkipTest(f"no {path}: check the shared data out beside the project, or set TESSERA_SHARED_DATA")
    return path


def make_key(data_dir, *flags, owner="somebody"):
    """A key for the daemon of this data folder, which has to start, or be told, after that."""
    command = [os.environ["TESSERA"], "keys", "add", "--data-dir", data_dir, "--owner", owner, *flags]
    clean = {k: v for k, v in os.environ.items() if not k.startswith("TESSERA_")}
    return subprocess.run(command, capture_output=True, text=True, check=True, env=clean).stdout.strip()


def bearer(key):
    """The header that shows a key."""
    return {"Authorization": f"Bearer {key}"}


class Reply:
    """A response that has been read to its end."""

    def __init__(self, response):
        self.status = response.status
        self.headers = response.headers
        self.body = response.read()

    @property
    def media_type(self):
        return self.headers.get("Content-Type", "").split(";")[0]

    def json(self):
        return json.loads(self.body)


class Daemon:
    """A daemon on a free port, with an empty data folder unless one is given. Use it in a `with`, or call `stop`. One
    that speaks TLS is spoken to with an ssl.SSLContext."""

    context = None

    def __init__(self, *flags, data_dir=None, env=None, program=None, context=None):
        self.context = context
        self.folder = tempfile.mkdtemp(prefix="tessera-e2e-")
        self.data_dir = data_dir or os.path.join(self.folder, "data")
        self._log = open(os.path.join(self.folder, "log"), "w+")
        command = [program or os.environ["TESSERAD"], "--port", "0", "--data-dir", self.data_dir]
        command += ["--drain-seconds", "0", *flags]  # Many tests end while jobs render that would take for ever.
        clean = {k: v for k, v in os.environ.items() if not k.startswith("TESSERA_")}
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=self._log, text=True, env={**clean, **(env or {})}
        )
        line = self.process.stdout.readline().strip()
        prefix = "listening on "
        if not line.startswith(prefix):
            self.process.wait()
            log = self.log()
            self.stop()
            raise RuntimeError(f"{command} said {line!r}; its log:\n{log}")
        self.url = line[len(prefix) :]
        self.host, port = self.url.partition("://")[2].rsplit(":", 1)
        self.port = int(port)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()

    def log(self):
        with open(self._log.name, errors="replace") as log:
            return log.read()

    def count_in_log(self, words, least=1, seconds=20):
        """How often the log has these words: waits until it has them so often, as a thread of its own writes it."""
        deadline = time.monotonic() + seconds
        while (count := self.log().count(words)) < least and time.monotonic() < deadline:
            time.sleep(0.01)
        return count

    def terminate(self):
        self.process.send_signal(signal.SIGTERM)

    def kill(self):
        """Ends the daemon as a crash would."""
        self.process.kill()
        self.process.wait()
        self.stop()

    def stop(self):
        """Ends the daemon with SIGTERM and returns its exit status; harmless when it has ended."""
        if self.process.poll() is None:
            self.terminate()
        try:
            return self.process.wait(timeout=60)
        finally:
            if self.process.poll() is None:
                self.process.kill()
                self.process.wait()
            self.process.stdout.close()
            self._log.close()
            shutil.rmtree(self.folder, ignore_errors=True)

    @contextlib.contextmanager
    def full_disk(self):
        """Meanwhile no write to a file succeeds, as on a disk without room."""
        before = resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, (0, before[1]))
        try:
            yield
        finally:
            resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, before)

    def connect(self, timeout=60):
        """A connection to keep alive over several requests."""
        if self.context:
            return http.client.HTTPSConnection(self.host, self.port, timeout=timeout, context=self.context)
        return http.client.HTTPConnection(self.host, self.port, timeout=timeout)

    def request(self, method, path, body=None, headers=None, timeout=60):
        """One request on a connection of its own. A dict or a list is sent as JSON."""
        headers = dict(headers or {})
        if isinstance(body, (dict, list)):
            body = json.dumps(body)
            headers.setdefault("Content-Type", "application/json")
        connection = self.connect(timeout)
        try:
            connection.request(method, path, body=body, headers=headers)
            return Reply(connection.getresponse())
        finally:
            connection.close()

    def submit(self, job):
        """Posts a job that has to be accepted; its id."""
        reply = self.request("POST", "/v1/jobs", job)
        assert reply.status == 201, (reply.status, reply.body)
        return reply.json()["id"]

    def status(self, job_id):
        reply = self.request("GET", f"/v1/jobs/{job_id}")
        assert reply.status == 200, (reply.status, reply.body)
        return reply.json()

    def wait_until(self, job_id, reached, seconds=120):
        """Asks for the status until `reached(status)`; fails when that takes too long."""
        deadline = time.monotonic() + seconds
        while True:
            status = self.status(job_id)
            if reached(status):
                return status
            if time.monotonic() > deadline:
                raise AssertionError(f"after {seconds} s still {status}; the log:\n{self.log()}")
            time.sleep(0.005)

    def wait_ended(self, job_id, seconds=120):
        return self.wait_until(job_id, lambda status: status["state"] in ENDED, seconds)
