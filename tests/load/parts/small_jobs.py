"""Many small jobs from many clients at once: each is posted, waited for and its image fetched.

None may be lost or come twice, and each image is the one that its job asks for: the jobs are of a few kinds, and all
images of a kind have the same bytes.
"""

import collections
import json
import statistics
import time

from daemon import Daemon
from documents import SPHERE

from support.bench_report import quantile
from tools.clients import Pause, ask, drive
from tools.disk import sync_seconds
from tools.outcome import expect, spread

CLIENTS = 32
KINDS = 16
SIDE = 64


def job(kind):
    camera = {"type": "perspective", "from": [0, 0.25 * kind, 5], "at": [0, 0, 0], "up": [0, 1, 0], "fov": 40}
    return {"scene": dict(SPHERE, camera=camera), "image": {"width": SIDE, "height": SIDE}}


class Run:
    """What all clients together have seen."""

    def __init__(self, count):
        self.waiting = iter(range(count))
        self.ids = []
        self.seconds = []  # From sending the job to having its image.
        self.accepted_after = []
        self.images = collections.defaultdict(set)
        self.polls = 0
        self.expected = 0.01  # Seconds until an image is there, as seen so far: who asks then asks seldom in vain.

    def client(self, documents):
        for i in self.waiting:
            kind = i % KINDS
            begin = time.perf_counter()
            answer = yield documents[kind]
            expect(answer.status == 201, f"a job was answered with {answer.status} {answer.body!r}")
            self.accepted_after.append(time.perf_counter() - begin)
            made = answer.json()["id"]
            self.ids.append(made)
            pause = max(self.expected - (time.perf_counter() - begin), 0.001)
            while True:
                yield Pause(pause)
                answer = yield ask("GET", f"/v1/jobs/{made}/image")
                self.polls += 1
                if answer.status == 200:
                    break
                expect(answer.status == 409, f"an image was answered with {answer.status} {answer.body!r}")
                pause = 0.004
            took = time.perf_counter() - begin
            self.seconds.append(took)
            self.expected = 0.95 * self.expected + 0.05 * 0.8 * took
            self.images[kind].add(answer.body)


def listed(daemon):
    """The states of all jobs that the daemon knows, by id, as the pages of its list have them."""
    states, after = [], ""
    while True:
        page = daemon.request("GET", f"/v1/jobs?limit=1000{after}").json()
        states += [(one["id"], one["state"]) for one in page["jobs"]]
        if "next" not in page:
            return states
        after = f"&after={page['next']}"


def measure(outcome):
    count, rounds = outcome.choose((200, 1), (10_000, 3))
    rates, p50s, p99s, accepted, shares, polls = [], [], [], [], [], []
    documents = [ask("POST", "/v1/jobs", json.dumps(job(kind)).encode()) for kind in range(KINDS)]
    for _ in range(rounds):
        with Daemon("--max-ended-jobs", str(2 * count)) as daemon:
            syncs = sync_seconds(daemon.folder)
            run = Run(count)
            begin, spent = time.perf_counter(), time.process_time()
            drive(daemon.port, [run.client(documents) for _ in range(CLIENTS)])
            took = time.perf_counter() - begin
            shares.append((time.process_time() - spent) / took)
            check(daemon, run, count)
        rates.append(count / took)
        p50s.append(quantile(run.seconds, 0.5))
        p99s.append(quantile(run.seconds, 0.99))
        accepted.append(quantile(run.accepted_after, 0.99))
        polls.append(run.polls / count)
    of = f"{count} jobs of {SIDE} x {SIDE}, {CLIENTS} clients"
    if outcome.is_short:
        outcome.row(of, "none lost, none twice", remark="every image as it should be")
        return
    outcome.row("a write of 4 KiB and fdatasync on this disk", spread(syncs, 1e3, " ms"))
    outcome.row(of, "none lost, none twice", "none")
    outcome.at_least("small_jobs/per_second", statistics.median(rates), 500, "jobs a second", remark=spread(rates))
    outcome.row("from submit to image, p50", spread(p50s, 1e3, " ms"))
    outcome.row("from submit to image, p99", spread(p99s, 1e3, " ms"))
    outcome.row("from submit to 201, p99", spread(accepted, 1e3, " ms"))
    outcome.row("of a core, the clients took", spread(shares, 100, " %"),
                remark=f"{spread(polls)} requests for an image")


def check(daemon, run, count):
    """None lost, none twice, and one image for each kind."""
    states = listed(daemon)
    expect(len(run.ids) == count == len(set(run.ids)), f"{len(set(run.ids))} ids for {count} jobs")
    expect(len(states) == count, f"{len(states)} jobs are listed, {count} were posted")
    expect({name for name, _ in states} == set(run.ids), "other jobs are listed than were posted")
    others = [state for _, state in states if state != "completed"]
    expect(not others, f"jobs whose image was fetched are {collections.Counter(others)}")
    for kind, images in run.images.items():
        expect(len(images) == 1, f"{len(images)} images of kind {kind}")
    expect(len({next(iter(images)) for images in run.images.values()}) == min(KINDS, count), "kinds look the same")
