"""The machine under the daemon fails: the disk is full, read-only, or gone; file descriptors run out; the clock is set
back. What was accepted is there afterwards, and what can't be done is refused as it should be.

The disk is a small one in memory (tmpfs), which takes the right to mount.
"""

import contextlib
import glob
import json
import os
import resource
import shutil
import socket
import subprocess
import tempfile
import time

from daemon import Daemon
from documents import SMALL_JOB

from tools.outcome import Skipped, expect
from tools.scenes import FILLED

JSON = {"Content-Type": "application/json"}
MEGABYTE = 1 << 20


def command(*words):
    """Whether it succeeded; skips the fault where it can't be run at all."""
    path = os.environ["PATH"] + ":/usr/sbin:/sbin"
    if not shutil.which(words[0], path=path):
        raise Skipped(f"no {words[0]} here")
    done = subprocess.run(words, capture_output=True, text=True, check=False, env={**os.environ, "PATH": path})
    return done.returncode == 0


class SmallDisk:
    """A file system in memory while a `with` lasts; `path` is its root."""

    def __init__(self, size):
        self._size = size

    def __enter__(self):
        self.path = tempfile.mkdtemp(prefix="tessera-disk-")
        if not command("mount", "-t", "tmpfs", "-o", f"size={self._size}", "tmpfs", self.path):
            os.rmdir(self.path)
            raise Skipped("nothing may be mounted here")
        return self

    def __exit__(self, *_):
        command("umount", "-l", self.path)
        os.rmdir(self.path)


class FailingDisk:
    """An ext4 file system that turns read-only at an error, as disks that fail have it."""

    def __enter__(self):
        self._folder = tempfile.mkdtemp(prefix="tessera-disk-")
        self._file, self.path = os.path.join(self._folder, "disk"), os.path.join(self._folder, "root")
        os.mkdir(self.path)
        with open(self._file, "wb") as file:
            file.truncate(64 * MEGABYTE)
        if not command("mkfs.ext4", "-q", self._file) or not self._mount():
            shutil.rmtree(self._folder)
            raise Skipped("nothing may be mounted here")
        return self

    def __exit__(self, *_):
        command("umount", "-l", self.path)
        shutil.rmtree(self._folder)

    def fail(self):
        device = os.path.basename(os.path.realpath(self._device()))
        with open(f"/sys/fs/ext4/{device}/trigger_fs_error", "w", encoding="ascii") as file:
            file.write("1")

    def repair(self):
        expect(command("umount", self.path), "the disk is still in use")
        command("e2fsck", "-fy", self._file)  # Its status says that there was something to correct.
        expect(self._mount(), "the disk can't be mounted again")

    def _mount(self):
        return command("mount", "-o", "loop,errors=remount-ro", self._file, self.path)

    def _device(self):
        with open("/proc/self/mounts", encoding="utf-8") as mounts:
            return next(line.split()[0] for line in mounts if line.split()[1] == self.path)


def image(daemon, job):
    reply = daemon.request("GET", f"/v1/jobs/{job}/image?format=exr")
    expect(reply.status == 200, f"an image was answered with {reply.status} {reply.body!r}")
    return reply.body


def expect_unready(daemon, why):
    """Now, or when it looks at the disk next."""
    deadline = time.monotonic() + 60
    while daemon.request("GET", "/readyz").status != 503:
        expect(time.monotonic() < deadline, f"/readyz says nothing of {why}")
        time.sleep(0.1)


def noisy(seed, side=64, samples=4):
    settings = {"samples": samples, "seed": seed}
    return {"scene": FILLED, "image": {"width": side, "height": side}, "settings": settings}


def expect_as_before(data_dir, images, flags):
    """Another daemon with the same folder knows the jobs, and has their images."""
    with Daemon(*flags, data_dir=data_dir) as daemon:
        for job, bytes_before in images.items():
            status = daemon.wait_ended(job, 300)
            expect(status["state"] == "completed", f"{job} is {status}")
            if bytes_before is not None:
                expect(image(daemon, job) == bytes_before, f"{job} has another image than before")


def disk_full(outcome):
    """Jobs until the disk refuses, then room again: jobs whose 201 came complete, and all else was 507."""
    flags = ["--min-free-disk", "1MiB"]
    with SmallDisk(8 * MEGABYTE) as disk:
        data_dir = os.path.join(disk.path, "data")
        images, refused = {}, 0
        with Daemon(*flags, data_dir=data_dir) as daemon:
            first = daemon.submit(noisy(0))
            daemon.wait_ended(first)
            images[first] = image(daemon, first)
            ballast = os.path.join(disk.path, "ballast")
            with open(ballast, "wb", buffering=0) as file, contextlib.suppress(OSError):
                while True:
                    file.write(b"x" * 4096)
            for seed in range(1, 40):
                reply = daemon.request("POST", "/v1/jobs", noisy(seed))
                expect(reply.status in (201, 507), f"on a full disk a job was answered with {reply.status} {reply.body!r}")
                if reply.status == 201:
                    images[reply.json()["id"]] = None
                refused += reply.status == 507
            expect(refused > 0, "a full disk refused nothing")
            expect_unready(daemon, "a full disk")
            expect(image(daemon, first) == images[first], "an image isn't what it was")
            os.remove(ballast)
            later = daemon.submit(noisy(100))
            images[later] = None
            for job in images:
                expect(daemon.wait_ended(job, 120)["state"] == "completed", f"{job} didn't complete with room again")
                images[job] = image(daemon, job)
            daemon.kill()
        expect_as_before(data_dir, images, flags)
        outcome.row("fault: disk full", f"{len(images)} jobs kept, {refused} × 507", "none lost")


def read_only(outcome):
    """The disk fails and turns read-only under the daemon; once it is repaired, another one goes on."""
    flags = ["--min-free-disk", "1MiB"]
    with FailingDisk() as disk:
        data_dir = os.path.join(disk.path, "data")
        with Daemon(*flags, data_dir=data_dir) as daemon:
            done = daemon.submit(noisy(0))
            daemon.wait_ended(done)
            before = image(daemon, done)
            begun = daemon.submit(noisy(1, 512, 4096))
            disk.fail()
            reply = daemon.request("POST", "/v1/jobs", noisy(2))
            expect(reply.status in (503, 507), f"on a read-only disk a job was answered with {reply.status}")
            expect_unready(daemon, "a read-only disk")
            expect(image(daemon, done) == before, "an image isn't what it was")
            daemon.kill()
        disk.repair()
        with Daemon(*flags, data_dir=data_dir) as daemon:
            expect(daemon.status(begun)["state"] not in ("failed", "canceled"), "a job that had begun is lost")
            expect(image(daemon, done) == before, "an image isn't what it was")
            expect(daemon.request("POST", "/v1/jobs", noisy(2)).status == 201, "a repaired disk takes no job")
    outcome.row("fault: disk turns read-only", f"refused with {reply.status}, as before once repaired", "none lost")


def folder_deleted(outcome):
    """While jobs render. There is nothing left to find afterwards; the daemon says so and goes on with what it can."""
    with Daemon() as daemon:
        job = daemon.submit(noisy(0))
        daemon.wait_ended(job)
        shutil.rmtree(daemon.data_dir)
        reply = daemon.request("POST", "/v1/jobs", noisy(1))
        expect(reply.status in (503, 507), f"without its folder a job was answered with {reply.status} {reply.body!r}")
        expect_unready(daemon, "a lost folder")
        expect(daemon.request("GET", "/livez").status == 200, "it isn't alive")
        expect(daemon.status(job)["state"] == "completed", "a job in memory has gone with the folder")
        expect(daemon.stop() == 0, "it doesn't stop cleanly")
    outcome.row("fault: folder deleted", f"refused with {reply.status}, alive", "no harm")


def descriptors(outcome):
    """Fewer than it takes connections: those that there are go on, and afterwards all is as before."""
    with Daemon("--max-connections", "1000") as daemon:
        job = daemon.submit(SMALL_JOB)
        daemon.wait_ended(job)
        pid = daemon.process.pid
        before = resource.prlimit(pid, resource.RLIMIT_NOFILE)
        used = len(os.listdir(f"/proc/{pid}/fd"))
        kept = daemon.connect()
        kept.request("GET", "/livez")
        kept.getresponse().read()
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (used + 10, before[1]))
        crowd = [socket.create_connection((daemon.host, daemon.port), timeout=60) for _ in range(50)]
        statuses = {}
        for seed in range(20):
            kept.request("POST", "/v1/jobs", json.dumps({**SMALL_JOB, "settings": {"seed": seed}}), JSON)
            response = kept.getresponse()
            response.read()
            statuses[response.status] = statuses.get(response.status, 0) + 1
        expect(set(statuses) <= {201, 503, 507}, f"without descriptors jobs were answered with {statuses}")
        for connection in crowd:
            connection.close()
        kept.close()
        resource.prlimit(pid, resource.RLIMIT_NOFILE, before)
        daemon.wait_ended(daemon.submit({**SMALL_JOB, "settings": {"seed": 1000}}))
    told = ", ".join(f"{count} × {status}" for status, count in sorted(statuses.items()))
    outcome.row("fault: no file descriptors left", told, "no harm")


def clock_set_back(outcome):
    """A day, between two starts and while it runs (faketime)."""
    libraries = glob.glob("/usr/lib/*/faketime/libfaketimeMT.so.1")
    if not libraries:
        raise Skipped("no libfaketime here (deploy/install-deps --test brings it)")
    with tempfile.TemporaryDirectory(prefix="tessera-clock-") as folder:
        data_dir, clock = os.path.join(folder, "data"), os.path.join(folder, "clock")
        env = {"LD_PRELOAD": libraries[0], "FAKETIME_TIMESTAMP_FILE": clock, "FAKETIME_NO_CACHE": "1",
               "DONT_FAKE_MONOTONIC": "1"}  # fmt: skip

        def set_clock(offset):
            with open(clock, "w", encoding="ascii") as file:
                file.write(offset)

        set_clock("+0")
        with Daemon(data_dir=data_dir, env=env) as daemon:
            jobs = [daemon.submit(noisy(seed)) for seed in range(3)]
            set_clock("-1d")
            jobs += [daemon.submit(noisy(seed)) for seed in range(3, 6)]
            images = {}
            for job in jobs:
                expect(daemon.wait_ended(job)["state"] == "completed", f"{job} didn't complete")
                images[job] = image(daemon, job)
            listed = [one["id"] for one in daemon.request("GET", "/v1/jobs").json()["jobs"]]
            expect(sorted(listed) == sorted(jobs), "jobs are missing from the list")
            daemon.kill()
        expect_as_before(data_dir, images, [])
    outcome.row("fault: clock set back by a day", f"{len(images)} jobs as before", "none lost")


def measure(outcome):
    for fault in (disk_full, read_only, folder_deleted, descriptors, clock_set_back):
        try:
            fault(outcome)
        except Skipped as reason:
            outcome.row(f"fault: {fault.__name__.replace('_', ' ')}", "SKIPPED", remark=str(reason))
