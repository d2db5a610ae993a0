"""An accelerated soak: all kinds of work for a long time. Memory and file descriptors have to stay flat.

Jobs, scenes, files, renders and images of several formats come, are polled, canceled and deleted, in random order. The
daemon keeps few of each, so that whatever goes on growing is a leak.
"""

import json
import os
import random
import statistics
import time

from daemon import Daemon
from documents import SPHERE

from support import processes
from support.bench_report import three_digits
from tools.clients import Pause, ask, drive
from tools.outcome import expect
from tools.scenes import heavy_job

CLIENTS = 8
# What is kept is small and soon full: growth after that is none that has a reason.
FLAGS = ["--max-ended-jobs", "200", "--image-cache", "4MiB", "--scene-cache", "4MiB", "--structure-cache", "4MiB",
         "--max-film-memory", "16MiB", "--max-scene-bytes", "1MiB", "--max-blob-bytes", "1MiB"]  # fmt: skip


def small_job(chance):
    light = {"type": "ambient", "radiance": [chance.randrange(1, 1000) / 100] * 3}
    scene = {"lights": [light], "objects": SPHERE["objects"]}
    side = chance.choice([8, 16, 32, 64])
    return {"scene": scene, "image": {"width": side, "height": side}, "settings": {"samples": chance.choice([1, 4])}}


class Soak:
    def __init__(self, seconds, seed):
        self._until = time.monotonic() + seconds
        self._chance = random.Random(seed)
        self.jobs = self.requests = 0

    def client(self):
        chance = self._chance
        while time.monotonic() < self._until:
            kind = chance.choices(("job", "render", "scene", "cancel", "wrong"), (60, 20, 8, 6, 6))[0]
            yield from getattr(self, f"_{kind}")(chance)

    def _ask(self, expected, *request):
        self.requests += 1
        answer = yield ask(*request)
        expect(answer.status in expected, f"{request[:2]} was answered with {answer.status} {answer.body[:500]!r}")
        return answer

    def _post(self, document):
        answer = yield from self._ask((201,), "POST", "/v1/jobs", document)
        self.jobs += 1
        return answer.json()["id"]

    def _job(self, chance):
        made = yield from self._post(small_job(chance))
        while True:
            answer = yield from self._ask((200, 409, 410, 404), "GET", f"/v1/jobs/{made}")
            if answer.status != 200 or answer.json()["state"] == "completed":
                break
            yield Pause(0.005)
        image = chance.choice(["", "?format=jpeg", "?format=exr", "?format=png&exposure=1"])
        yield from self._ask((200, 404, 410), "GET", f"/v1/jobs/{made}/image{image}")
        if chance.random() < 0.5:
            yield from self._ask((204, 404), "DELETE", f"/v1/jobs/{made}")

    def _render(self, chance):
        self.jobs += 1
        yield from self._ask((200,), "POST", "/v1/render", small_job(chance))

    def _scene(self, chance):
        answer = yield from self._ask((200, 201), "POST", "/v1/scenes", small_job(chance)["scene"])
        yield from self._ask((200, 404, 410), "GET", f"/v1/scenes/{answer.json()['scene']}")

    def _cancel(self, chance):
        made = yield from self._post(heavy_job(64))
        yield Pause(chance.random() * 0.02)
        yield from self._ask((202, 409), "POST", f"/v1/jobs/{made}/cancel")

    def _wrong(self, chance):
        method, path, document, expected = chance.choice([
            ("POST", "/v1/jobs", b"{", 400),
            ("POST", "/v1/jobs", {"scene": {}}, 422),
            ("GET", "/v1/jobs/none", None, 404),
            ("GET", "/v1/jobs?limit=0", None, 422),
        ])  # fmt: skip
        yield from self._ask((expected, 400, 422), method, path, document)


def slope(points):
    """Of the line that fits best, per unit of the first coordinate."""
    xs, ys = zip(*points)
    x0, y0 = statistics.mean(xs), statistics.mean(ys)
    return sum((x - x0) * (y - y0) for x, y in points) / sum((x - x0) ** 2 for x in xs)


def measure(outcome):
    seconds = outcome.choose(10, 1260)
    with Daemon(*FLAGS, "--max-jobs", "100") as daemon:
        pid = daemon.process.pid
        soak = Soak(seconds, outcome.seed)
        samples = []

        def watch():
            begin = time.monotonic()
            while time.monotonic() - begin < seconds:
                descriptors = len(os.listdir(f"/proc/{pid}/fd"))
                samples.append((soak.jobs, processes.resident_bytes(pid), descriptors, time.monotonic() - begin))
                yield ask("GET", "/livez")  # A connection that asks for nothing is closed before long.
                yield Pause(seconds / 600)

        drive(daemon.port, [*(soak.client() for _ in range(CLIENTS)), watch()])
        expect(daemon.process.poll() is None, "the daemon has ended")
        tell(outcome, soak, seconds, samples)
        usage = json.loads(daemon.request("GET", "/v1/jobs?limit=1000").body)["jobs"]
        expect(len(usage) <= 300, f"{len(usage)} jobs are kept where 200 ended ones may be")


def tell(outcome, soak, seconds, samples):
    warm = samples[len(samples) // 4 :]
    growth = slope([(jobs, memory) for jobs, memory, _, _ in warm])
    descriptors = [count for _, _, count, _ in warm]
    what = f"a soak of {seconds} s: {soak.jobs} jobs, {soak.requests} requests"
    if outcome.is_short:
        outcome.row(what, "all answered as they should be")
        return
    outcome.row(what, "all answered as they should be", "20000 jobs", "more than asked" if soak.jobs >= 20_000 else "FEWER")
    first, last = warm[0][1], warm[-1][1]
    outcome.row("resident memory after a quarter, at the end", f"{first / 1e6:.1f} MB, {last / 1e6:.1f} MB",
                remark=f"{three_digits(growth)} bytes a job")
    grown = 100 * growth * (warm[-1][0] - warm[0][0]) / first
    outcome.at_most("soak/memory_growth_percent", grown, 5, "growth of memory by the line that fits, after a quarter", " %")
    drift = slope([(at, count) for _, _, count, at in warm]) * seconds
    outcome.at_most("soak/descriptor_drift", abs(drift), 3, "drift of file descriptors by the line that fits",
                    remark=f"{min(descriptors)} to {max(descriptors)}")
