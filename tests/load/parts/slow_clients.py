"""Clients that send or read as slowly as they can (slowhttptest), and somebody with a valid request meanwhile.

That one comes anew each time, as a stranger does, and again over a connection that it keeps. Both ask for a status,
and post a job.
"""

import http.client
import json
import subprocess
import threading
import time

from daemon import Daemon
from documents import SMALL_JOB

from tools.outcome import expect, need

# More than the connections that the daemon takes (--max-connections), at once.
CONNECTIONS = 3000

ATTACKS = {
    "headers": ("slow headers (-H)", ["-H", "-i", "1", "-x", "24"]),
    "body": ("slow bodies (-B)", ["-B", "-i", "1", "-s", "65536", "-x", "24", "-f", "application/json"]),
    "read": ("slow reading (-X)", ["-X", "-k", "8", "-n", "1", "-z", "8", "-w", "16", "-y", "64"]),
    "range": ("many ranges (-R)", ["-R", "-a", "1", "-b", "3000", "-t", "HEAD"]),
}


class Visitor(threading.Thread):
    """Sends valid requests, one after the other, until it is told to stop."""

    def __init__(self, daemon, keeps):
        super().__init__()
        self._daemon, self._keeps = daemon, keeps
        self._connection = daemon.connect(timeout=30) if keeps else None
        self._ended = threading.Event()
        self.seconds, self.wrong = [], []

    def run(self):
        requests = [("GET", f"/v1/jobs/{self._daemon.submit(SMALL_JOB)}", None, 200)] if self._keeps else []
        requests += [("GET", "/v1/version", None, 200), ("POST", "/v1/jobs", json.dumps(SMALL_JOB), 201)]
        turn = 0
        while not self._ended.wait(0.05):
            method, path, body, expected = requests[turn % len(requests)]
            turn += 1
            begin = time.monotonic()
            connection = self._connection or self._daemon.connect(timeout=30)
            try:
                connection.request(method, path, body, {"Content-Type": "application/json"} if body else {})
                response = connection.getresponse()
                response.read()
                if response.status != expected:
                    self.wrong.append(f"{method} {path}: {response.status}")
            except (OSError, http.client.HTTPException) as error:
                self.wrong.append(f"{method} {path}: {error!r}")
                if self._keeps:
                    return
            finally:
                if not self._keeps:
                    connection.close()
            self.seconds.append(time.monotonic() - begin)

    def stop(self):
        self._ended.set()
        self.join()
        if self._connection:
            self._connection.close()


def measure(outcome):
    (slowhttptest,) = need("slowhttptest")
    connections, seconds = outcome.choose((150, 2), (CONNECTIONS, 20))
    for name, (what, flags) in ATTACKS.items():
        with Daemon() as daemon:
            target = daemon.submit(SMALL_JOB)
            daemon.wait_ended(target)
            path = "/v1/jobs" if name == "body" else f"/v1/jobs/{target}/image?format=exr"
            command = [slowhttptest, "-c", str(connections), "-r", str(connections), "-l", str(seconds), *flags,
                       "-u", daemon.url + path]  # fmt: skip
            visitors = [Visitor(daemon, keeps) for keeps in (False, True)]
            for visitor in visitors:
                visitor.start()
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            for visitor in visitors:
                visitor.stop()
            expect(done.returncode == 0, f"slowhttptest: {done.stdout[-2000:]}{done.stderr}")
            expect(daemon.process.poll() is None, f"{what} ended the daemon")
            tell(outcome, name, f"{what}, {connections} connections", *visitors)


def tell(outcome, name, what, stranger, known):
    for visitor in (stranger, known):
        expect(visitor.seconds, "a visitor had no turn")
        expect(not visitor.wrong, f"{what}: {len(visitor.wrong)} valid requests failed, {visitor.wrong[:1]}")
    if outcome.is_short:
        outcome.row(what, f"{len(stranger.seconds) + len(known.seconds)} valid requests answered")
        return
    counts = f"{len(stranger.seconds)} and {len(known.seconds)} requests"
    remark = f"over a kept connection {max(known.seconds):.3f} s; {counts}"
    outcome.at_most(f"slow_clients/{name}_worst_s", max(stranger.seconds), 1, f"{what}: slowest answer", " s", remark)
