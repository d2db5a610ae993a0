"""Small things beside large ones: thumbnails while a large image renders, and small posts behind hostile documents and
huge encodings."""

import json
import statistics
import threading
import time

from daemon import Daemon
from documents import SMALL_JOB, grid_of_spheres

from support.bench_report import quantile
from tools.clients import Pause, ask, drive
from tools.outcome import expect, spread
from tools.scenes import FILLED, heavy_job

THUMBNAILS = 100
POSTS = 400


def thumbnail(seed):
    settings = {"samples": 4, "seed": seed}
    return json.dumps({"scene": FILLED, "image": {"width": 64, "height": 64}, "settings": settings}).encode()


def thumbnails(daemon, count):
    """Seconds from submit to image of each, one after the other."""
    seconds = []

    def client():
        for seed in range(count):
            begin = time.perf_counter()
            made = (yield ask("POST", "/v1/jobs", thumbnail(seed))).json()["id"]
            while True:
                answer = yield ask("GET", f"/v1/jobs/{made}/image")
                if answer.status == 200:
                    break
                expect(answer.status == 409, f"an image was answered with {answer.status} {answer.body!r}")
                yield Pause(0.001)
            seconds.append(time.perf_counter() - begin)

    drive(daemon.port, [client()])
    return seconds


def measure_thumbnails(outcome):
    count, side = outcome.choose((10, 512), (THUMBNAILS, 4096))
    with Daemon() as daemon:
        alone = thumbnails(daemon, count)
        large = daemon.submit(heavy_job(side))
        daemon.wait_until(large, lambda status: status["samples_done"] > 0)
        beside = thumbnails(daemon, count)
        expect(daemon.status(large)["state"] == "rendering", "the large job has ended before the small ones")
    if outcome.is_short:
        outcome.row(f"{count} thumbnails beside a large job", "all came while it rendered")
        return
    outcome.row(f"a thumbnail on an idle server, one of {count}", spread(alone, 1e3, " ms"))
    outcome.row(f"beside a job of {side} x {side}", spread(beside, 1e3, " ms"),
                remark=f"p99 {1e3 * quantile(beside, 0.99):.1f} ms")
    ratio = statistics.median(beside) / statistics.median(alone)
    outcome.at_most("beside/thumbnail_over_idle", ratio, 2, "a thumbnail beside a large job / on an idle server")


class Crowd:
    """Clients that keep the daemon's lanes busy while a `with` lasts."""

    def __init__(self, daemon, requests):
        self._daemon, self._requests = daemon, requests
        self._ended = threading.Event()
        self._threads = [threading.Thread(target=self._work, args=(request,)) for request in requests]
        self.answered = [0] * len(requests)

    def __enter__(self):
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        for thread in self._threads:
            thread.join()

    def _work(self, request):
        index = self._requests.index(request)
        while not self._ended.is_set():
            method, path, body = request(self.answered[index])
            self._daemon.request(method, path, body, {"Content-Type": "application/json"} if body else {}, timeout=600)
            self.answered[index] += 1


def hostile_documents():
    """Makers of requests whose parsing or encoding takes long; each is new to the server every time."""
    spheres = grid_of_spheres(28)["objects"]
    deep = b'{"objects":' + b"[" * 2_000_000
    numbers = json.dumps({"objects": [{"type": "mesh", "positions": [0.1] * 900_000, "triangles": []}]}).encode()

    def many_objects(turn):
        light = {"type": "ambient", "radiance": [1 + turn / 1e6] * 3}
        return "POST", "/v1/scenes", json.dumps({"lights": [light], "objects": spheres}).encode()

    return [many_objects, lambda turn: ("POST", "/v1/scenes", deep), lambda turn: ("POST", "/v1/scenes", numbers)]


def huge_encodings(daemon, side):
    """Makers of requests for encodings of one image, none of which has been asked for before."""
    job = daemon.submit({"scene": FILLED, "image": {"width": side, "height": side}, "settings": {"samples": 1}})
    status = daemon.wait_ended(job, seconds=600)
    expect(status["state"] == "completed", f"the image to encode: {status}")
    image = f"/v1/jobs/{job}/image"
    return [
        lambda turn: ("GET", f"{image}?format=png&exposure={turn / 1000}", None),
        lambda turn: ("GET", f"{image}?format=jpeg&exposure={-turn / 1000 - 0.0005}", None),
        lambda turn: ("GET", f"{image}?format=png&exposure={turn / 1000 + 1}", None),
    ]


def posts(daemon, count):
    """Seconds from sending a small job to its 201."""
    seconds = []

    def client():
        for _ in range(count):
            begin = time.perf_counter()
            answer = yield ask("POST", "/v1/jobs", SMALL_JOB)
            expect(answer.status == 201, f"a small job was answered with {answer.status} {answer.body!r}")
            seconds.append(time.perf_counter() - begin)
            yield Pause(0.01)

    drive(daemon.port, [client()], patience=600)
    return seconds


def measure_posts(outcome):
    count, side = outcome.choose((20, 256), (POSTS, 4096))
    with Daemon() as daemon:
        alone = posts(daemon, count)
        with Crowd(daemon, hostile_documents() * outcome.choose(1, 2)) as crowd:
            behind_parses = posts(daemon, count)
        parsed = sum(crowd.answered)
        with Crowd(daemon, huge_encodings(daemon, side)) as crowd:
            behind_encodings = posts(daemon, count)
        encoded = sum(crowd.answered)
        expect(daemon.process.poll() is None, "the daemon has ended")
    if outcome.is_short:
        outcome.row("small posts behind hostile parses and encodings", f"{2 * count} answered")
        return
    outcome.row("a small post on an idle server", spread(alone, 1e3, " ms"),
                remark=f"p99 {1e3 * quantile(alone, 0.99):.1f} ms")
    outcome.at_most("beside/post_behind_parses_p99_ms", 1e3 * quantile(behind_parses, 0.99), 100,
                    "p99 of a small post behind hostile parses", " ms", f"{parsed} were parsed meanwhile")
    outcome.at_most("beside/post_behind_encodings_p99_ms", 1e3 * quantile(behind_encodings, 0.99), 100,
                    f"p99 of a small post behind encodings of {side} x {side}", " ms",
                    f"{encoded} were encoded meanwhile")


def measure(outcome):
    measure_thumbnails(outcome)
    measure_posts(outcome)
