"""The machine under the daemon fails: the disk is full, read-only, or gone; file descriptors run out; the clock is set
back; the journal is locked by others, or damaged, and so are files of structures that are rendered from. What was accepted is there afterwards, and what can't be done is refused as it should be.

The disk is a small one in memory (tmpfs), which takes the right to mount.
"""

import contextlib
import glob
import json
import os
import resource
import shutil
import socket
import sqlite3
import subprocess
import tempfile
import time

from daemon import Daemon
from documents import SMALL_JOB
from structure_dir_test import SCENE as MESHES

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


def journal_locked(outcome):
    """By another program, for longer than the daemon waits for it, while jobs end and come; then by a second daemon."""
    with tempfile.TemporaryDirectory(prefix="tessera-locked-") as folder:
        data_dir = os.path.join(folder, "data")
        with Daemon(data_dir=data_dir) as daemon:
            done = daemon.submit(noisy(0))
            daemon.wait_ended(done)
            images = {done: image(daemon, done)}
            with contextlib.closing(sqlite3.connect(os.path.join(data_dir, "journal.db"))) as other:
                begun = daemon.submit(noisy(1, 128, 256))
                other.execute("BEGIN IMMEDIATE")
                images[begun] = None
                reply = daemon.request("POST", "/v1/jobs", noisy(2))
                expect(reply.status == 503 and reply.json()["code"] == "storage_unavailable", f"locked: {reply.body!r}")
                expect("Retry-After" in reply.headers, "it isn't said when to come again")
                expect_unready(daemon, "a journal that is locked")
                expect(image(daemon, done) == images[done], "an image isn't what it was")
                daemon.wait_until(begun, lambda status: status["samples_done"] == status["samples_total"])
                expect(daemon.status(begun)["state"] == "rendering", "a job is said to be done that isn't written down")
                other.rollback()
            later = daemon.submit(noisy(3))
            for job in (begun, later):
                expect(daemon.wait_ended(job)["state"] == "completed", f"{job} didn't complete when nobody held the lock")
                images[job] = image(daemon, job)
            second = subprocess.run([os.environ["TESSERAD"], "--port", "0", "--data-dir", data_dir],
                                    capture_output=True, text=True, timeout=60, check=False)  # fmt: skip
            expect(second.returncode == 1 and "in use by another" in second.stderr, f"a second daemon: {second.stderr}")
            expect(image(daemon, done) == images[done], "a second daemon has changed something")
            daemon.kill()
        expect_as_before(data_dir, images, [])
    outcome.row("fault: journal locked", f"{len(images)} jobs kept, refused with 503, a second daemon with words", "none lost")


def journal_damaged(outcome):
    """Pages of it are overwritten under the daemon: it stays alive. The next one doesn't start before it is told to go on
    with what can be read."""
    with tempfile.TemporaryDirectory(prefix="tessera-damaged-") as folder:
        data_dir = os.path.join(folder, "data")
        journal = os.path.join(data_dir, "journal.db")
        with Daemon(data_dir=data_dir) as daemon:
            images = {}
            for seed in range(20):
                job = daemon.submit(noisy(seed))
                daemon.wait_ended(job)
                images[job] = image(daemon, job)
            daemon.kill()
        with Daemon(data_dir=data_dir) as daemon, contextlib.closing(sqlite3.connect(journal)) as other:
            other.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
            with open(journal, "r+b") as file:
                for page in range(4, os.path.getsize(journal) // 4096, 5):
                    file.seek(page * 4096)
                    file.write(os.urandom(4096))
            statuses = {}
            for seed in range(20, 40):
                status = daemon.request("POST", "/v1/jobs", noisy(seed)).status
                statuses[status] = statuses.get(status, 0) + 1
            expect(set(statuses) <= {201, 503}, f"with a damaged journal jobs were answered with {statuses}")
            expect(daemon.request("GET", "/livez").status == 200, "it isn't alive")
            daemon.kill()
        command = [os.environ["TESSERAD"], "--port", "0", "--data-dir", data_dir]
        refused = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        expect(refused.returncode == 1 and "--scrub" in refused.stderr, f"it starts with a damaged journal: {refused}")
        scrubbed = subprocess.run([*command[:1], "--scrub", *command[3:]], capture_output=True, text=True, timeout=120,
                                  check=False)  # fmt: skip
        expect(scrubbed.returncode == 1, f"a damaged journal isn't found: {scrubbed}")
        with Daemon(data_dir=data_dir) as daemon:
            kept = {job["id"] for job in daemon.request("GET", "/v1/jobs?limit=1000").json()["jobs"]}
            for job in kept:
                expect(daemon.wait_ended(job)["state"] == "completed", f"{job} doesn't complete")
                if job in images:
                    expect(image(daemon, job) == images[job], f"{job} has another image than before")
        known = len(kept & set(images))
        expect(known > 0, "nothing of a journal is kept of which most pages are whole")
    outcome.row("fault: every fifth page of the journal damaged", f"{known} of {len(images)} jobs kept, told of", "no harm")


def structure_damaged(outcome):
    """Files of hierarchies are overwritten and cut off while a job renders from them, and when the next reads them."""
    with tempfile.TemporaryDirectory(prefix="tessera-structures-") as folder:
        job = {"scene": MESHES, "image": {"width": 240, "height": 160},
               "settings": {"samples": 64, "accel": {"kind": "wide"}}}  # fmt: skip
        flags = ["--structure-dir", folder, "--structure-cache", "0"]
        with Daemon(*flags) as daemon:
            first = daemon.submit(job)
            daemon.wait_ended(first)
            before = image(daemon, first)
        with Daemon(*flags) as daemon:
            begun = daemon.submit(job)
            daemon.wait_until(begun, lambda status: status["samples_done"] > 0)
            files = glob.glob(os.path.join(folder, "*.wide"))
            for path in files:
                with open(path, "r+b") as file:
                    file.seek(300)
                    file.write(os.urandom(50000))
                os.truncate(path, os.path.getsize(path) // 2)
            rendering = daemon.status(begun)["state"] == "rendering"
            expect(daemon.wait_ended(begun)["state"] == "completed", "a job fails whose structure's file is damaged")
            expect(image(daemon, begun) == before, "a damaged structure's file changes an image")
            again = daemon.submit(job)
            expect(daemon.wait_ended(again)["state"] == "completed", "a damaged structure isn't built again")
            expect(image(daemon, again) == before, "an image is another after a structure was damaged")
            expect(daemon.count_in_log("set aside as", len(files)) == len(files), "damaged structures aren't set aside")
    at = "while it is rendered from" if rendering else "between jobs"
    outcome.row(f"fault: structure file damaged {at}", f"{len(files)} set aside and built again", "same image")


def measure(outcome):
    for fault in (disk_full, read_only, folder_deleted, descriptors, clock_set_back, journal_locked, journal_damaged,
                  structure_damaged):  # fmt: skip
        try:
            fault(outcome)
        except Skipped as reason:
            outcome.row(f"fault: {fault.__name__.replace('_', ' ')}", "SKIPPED", remark=str(reason))
