"""Status polls: how many and how soon, beside nginx with a file of the same size; and what they cost the renders.

nginx has as many workers as the daemon has I/O threads. Both are asked in turn, several times, by wrk on this machine,
which takes its share of the processors.
"""

import os
import statistics
import time

from daemon import Daemon
from documents import SMALL_JOB

from tools import threads
from tools.nginx import Nginx
from tools.outcome import expect, need, spread
from tools.scenes import heavy_job
from tools.wrk import poll


class Renders:
    """Jobs that keep every core busy while a `with` lasts."""

    def __init__(self, daemon):
        self._daemon = daemon

    def __enter__(self):
        self.jobs = [self._daemon.submit(heavy_job()) for _ in range(os.cpu_count())]
        for job in self.jobs:
            self._daemon.wait_until(job, lambda status: status["samples_done"] > 0)
        return self

    def __exit__(self, *_):
        for job in self.jobs:
            self._daemon.request("POST", f"/v1/jobs/{job}/cancel")
            self._daemon.request("DELETE", f"/v1/jobs/{job}")

    def samples(self):
        return sum(self._daemon.status(job)["samples_done"] for job in self.jobs)


class Rates:
    """Samples a second while a `with` lasts, and the processor time of threads."""

    def __init__(self, daemon, renders):
        self._daemon, self._renders = daemon, renders

    def _now(self):
        return time.monotonic(), self._renders.samples(), threads.processor_seconds(self._daemon.process.pid)

    def __enter__(self):
        self._begin = self._now()
        return self

    def __exit__(self, *_):
        (since, before, cpu_before), (until, after, cpu_after) = self._begin, self._now()
        self.seconds = until - since
        self.samples_per_second = (after - before) / self.seconds
        self.io_seconds = cpu_after["io"] - cpu_before["io"]
        self.samples_per_core_second = (after - before) / (cpu_after["others"] - cpu_before["others"])


def measure(outcome):
    need("wrk", "nginx")
    rounds, seconds = outcome.choose((1, 1), (5, 5))
    ours_idle, ours_busy, theirs_idle, theirs_busy, alone, polled = [], [], [], [], [], []
    with Daemon() as daemon:
        done = daemon.submit(SMALL_JOB)
        daemon.wait_ended(done)
        body = daemon.request("GET", f"/v1/jobs/{done}").body
        workers = threads.io_threads(daemon.process.pid)
        expect(workers > 0, "no thread of the daemon is called io")
        with Nginx(body, workers) as nginx:
            for _ in range(rounds):
                theirs_idle.append(poll(nginx.url, seconds))
                ours_idle.append(poll(f"{daemon.url}/v1/jobs/{done}", seconds))
                with Renders(daemon) as renders:
                    with Rates(daemon, renders) as rates:
                        time.sleep(seconds)
                    alone.append(rates)
                    with Rates(daemon, renders) as rates:
                        ours_busy.append(poll(f"{daemon.url}/v1/jobs/{renders.jobs[0]}", seconds))
                    polled.append(rates)
                    theirs_busy.append(poll(nginx.url, seconds))
        expect(daemon.process.poll() is None, "the daemon has ended")
    for polls in ours_idle + ours_busy:
        expect(polls.failed == 0 and polls.count > 0, f"{polls.failed} of {polls.count} polls failed")
    if outcome.is_short:
        counts = sum(polls.count for polls in ours_idle + ours_busy)
        outcome.row("status polls", f"{counts} answered", remark="none refused, broken off or late")
        return
    tell(outcome, len(body), workers, ours_idle, ours_busy, theirs_idle, theirs_busy, alone, polled)


def tell(outcome, size, workers, ours_idle, ours_busy, theirs_idle, theirs_busy, alone, polled):
    def rates(many):
        return [polls.per_second for polls in many]

    def of_nginx(many):
        """Round by round, so that both of a pair had the same neighbours."""
        return [polls.per_second / theirs.per_second for polls, theirs in zip(many, theirs_idle)]

    outcome.row(f"nginx idle, {size} bytes, {workers} workers", spread(rates(theirs_idle), unit=" /s"))
    outcome.row("nginx while every core renders", spread(rates(theirs_busy), unit=" /s"),
                remark=f"p99 {spread([polls.p99 for polls in theirs_busy], 1e3, ' ms')}")
    outcome.row("status polls, idle", spread(rates(ours_idle), unit=" /s"))
    outcome.row("status polls while every core renders", spread(rates(ours_busy), unit=" /s"))
    idle = of_nginx(ours_idle)
    outcome.at_least("polls/idle_over_nginx", statistics.median(idle), 0.8, "polls idle / nginx idle",
                     remark=spread(idle))
    busy = of_nginx(ours_busy)
    outcome.at_least("polls/busy_over_nginx", statistics.median(busy), 0.8, "polls while rendering / nginx idle",
                     remark=spread(busy))
    p99 = [1e3 * polls.p99 for polls in ours_busy]
    outcome.at_most("polls/busy_p99_ms", statistics.median(p99), 10, "p99 while rendering, 64 connections", " ms",
                    spread(p99))

    cores = os.cpu_count()
    lost, taken, efficiency = [], [], []
    for before, with_polls, polls in zip(alone, polled, ours_busy):
        lost.append(1 - with_polls.samples_per_second / before.samples_per_second)
        taken.append((with_polls.io_seconds + polls.generator_seconds) / (cores * with_polls.seconds))
        efficiency.append(with_polls.samples_per_core_second / before.samples_per_core_second)
    outcome.row("of the processors, I/O threads and wrk took", spread(taken, 100, " %"))
    outcome.row("of its samples a second, the render lost", spread(lost, 100, " %"))
    beyond = [100 * (gone - cost) for gone, cost in zip(lost, taken)]
    outcome.at_most("polls/render_lost_beyond_cpu_percent", statistics.median(beyond), 5,
                    "lost beyond what the polls took", " %", spread(beyond))
    outcome.row("samples a second of a render thread's time, with polls / without", spread(efficiency))
