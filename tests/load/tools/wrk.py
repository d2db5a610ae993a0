"""wrk(1): as many requests of one kind as a server answers."""

import dataclasses
import json
import pathlib
import resource
import subprocess

from tools.outcome import expect, need

_SCRIPT = pathlib.Path(__file__).with_name("polling.lua")


@dataclasses.dataclass
class Polls:
    """What came of them. Seconds."""

    count: int
    per_second: float
    p50: float
    p99: float
    worst: float
    failed: int  # Answered with an error, or broken off.
    late: int  # By more than 2 s.
    generator_seconds: float  # Processor time that wrk took.


def _children_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def poll(url, seconds, connections=64, threads=2):
    (wrk,) = need("wrk")
    before = _children_seconds()
    command = [wrk, "-t", str(threads), "-c", str(connections), "-d", f"{seconds}s", "-s", str(_SCRIPT), url]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    expect(done.returncode == 0, f"wrk: {done.stdout}{done.stderr}")
    said = json.loads(done.stdout.splitlines()[-1])
    return Polls(
        said["requests"],
        1e6 * said["requests"] / said["microseconds"],
        *(1e-6 * said[name] for name in ("p50", "p99", "max")),
        said["refused"] + said["broken"],
        said["late"],
        _children_seconds() - before,
    )
