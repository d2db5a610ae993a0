"""Thousands of connections that are kept and ask for nothing: what each takes, and whether anything else slows down."""

import json
import resource
import socket
import statistics
import time

from daemon import Daemon
from documents import SMALL_JOB

from support import processes
from support.bench_report import three_digits
from tools import threads
from tools.clients import ask, drive
from tools.outcome import Skipped, expect, need, spread
from tools.wrk import poll

CONNECTIONS = 5000
REQUEST = b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n"


def poll_costs(daemon, url, seconds):
    """Polls, and the processor time of I/O threads for each: that tells more than their rate where others are at work."""
    before = threads.processor_seconds(daemon.process.pid)["io"]
    polls = poll(url, seconds)
    return polls, (threads.processor_seconds(daemon.process.pid)["io"] - before) / polls.count


def rate_of_jobs(daemon, count):
    """Jobs a second, one after the other on each of eight connections."""

    def client():
        for _ in range(count // 8):
            answer = yield ask("POST", "/v1/jobs", json.dumps(SMALL_JOB).encode())
            expect(answer.status == 201, f"a job was answered with {answer.status} {answer.body!r}")

    begin = time.perf_counter()
    drive(daemon.port, [client() for _ in range(8)])
    return count / (time.perf_counter() - begin)


def open_idle(daemon, count):
    """Connections that have been answered once and are kept."""
    connections = []
    for _ in range(count):
        connection = socket.create_connection((daemon.host, daemon.port), timeout=60)
        connection.sendall(REQUEST)
        connections.append(connection)
    for connection in connections:
        expect(connection.recv(4096).startswith(b"HTTP/1.1 200 "), "a connection wasn't answered")
    return connections


def measure(outcome):
    need("wrk")
    count, rounds, seconds = outcome.choose((200, 1, 1), (CONNECTIONS, 3, 4))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard < 2 * count + 500:
        raise Skipped(f"the system gives {hard} file descriptors, {2 * count + 500} are needed")
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    each, alone, beside, jobs_alone, jobs_beside, costs_alone, costs_beside = ([] for _ in range(7))

    def measure_polls(rates, costs):
        polls, cost = poll_costs(daemon, url, seconds)
        rates.append(polls)
        costs.append(cost)

    try:
        with Daemon("--max-connections", str(count + 100), "--timeout", "600") as daemon:
            job = daemon.submit(SMALL_JOB)
            daemon.wait_ended(job)
            url = f"{daemon.url}/v1/jobs/{job}"
            poll(url, seconds)  # What the first requests take stays.
            for _ in range(rounds):
                measure_polls(alone, costs_alone)
                jobs_alone.append(rate_of_jobs(daemon, 400))
                before = processes.resident_bytes(daemon.process.pid)
                idle = open_idle(daemon, count)
                each.append((processes.resident_bytes(daemon.process.pid) - before) / count)
                measure_polls(beside, costs_beside)
                jobs_beside.append(rate_of_jobs(daemon, 400))
                for connection in idle:
                    connection.sendall(REQUEST)
                    answered = connection.recv(4096)
                    expect(answered.startswith(b"HTTP/1.1 200 "), "an idle connection isn't answered any more")
                    connection.close()
            expect(all(polls.failed == 0 for polls in alone + beside), "polls failed")
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    if outcome.is_short:
        outcome.row(f"{count} idle connections", "all answered again")
        return
    outcome.row(f"{count} idle connections, bytes each", spread(each), remark="growth of resident memory, first round first: "
                + ", ".join(three_digits(value) for value in each))
    slowed = [100 * (1 - with_idle.per_second / without.per_second) for with_idle, without in zip(beside, alone)]
    outcome.at_most("idle_connections/polls_slowed_percent", statistics.median(slowed), 10, "polls beside them slow down by",
                    " %", spread(slowed))
    outcome.row("I/O threads' time for a poll, alone and beside them", spread(costs_alone, 1e6, " µs"),
                remark=spread(costs_beside, 1e6, " µs"))
    slowed = [100 * (1 - with_idle / without) for with_idle, without in zip(jobs_beside, jobs_alone)]
    outcome.at_most("idle_connections/jobs_slowed_percent", statistics.median(slowed), 10, "jobs beside them slow down by",
                    " %", spread(slowed))
