"""The worst clients that we can think of, ten ways, and the most memory that the daemon and the processes in which it
reads files have had meanwhile.

Each attack meets a daemon of its own. It is held against the sum of what the flags allow where there is no budget for
all of it together.
"""

import json
import os
import socket
import subprocess
import threading
import time

from daemon import Daemon
from documents import SPHERE

from support import processes
from tools.models import black_png, triangles
from tools.outcome import expect
from tools.scenes import FILLED, heavy_job

MEGABYTE = 1 << 20
CLIENTS = 16
BUDGET = 512 * MEGABYTE
# Of a daemon that has no budget for all of it: for bodies, images, encodings, scenes and structures, 512 MiB in all.
PARTS_OF_IT = ["--max-bodies", "64MiB", "--max-body", "32MiB", "--max-film-memory", "160MiB", "--image-cache", "32MiB",
         "--scene-cache", "96MiB", "--structure-cache", "160MiB"]  # fmt: skip
JSON = {"Content-Type": "application/json"}


class Attack:
    """What the attackers of one kind do; each method is one attacker's turn."""

    def __init__(self, daemon, scale):
        self.daemon, self.scale = daemon, scale
        self.statuses = {}

    def send(self, method, path, body=None, headers=None):
        reply = self.daemon.request(method, path, body, headers, timeout=120)
        self.statuses[reply.status] = self.statuses.get(reply.status, 0) + 1
        return reply

    def many(self, work, count=CLIENTS):
        """work(0..count−1) at once; what the daemon refuses or breaks off is its right."""

        def turn(i):
            try:
                work(i)
            except OSError:
                self.statuses["broken"] = self.statuses.get("broken", 0) + 1

        threads = [threading.Thread(target=turn, args=(i,)) for i in range(count)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()


def connect(daemon):
    return socket.create_connection((daemon.host, daemon.port), timeout=120)


def huge_bodies(attack):
    """JSON documents as large as is allowed, all at once, each of small values."""
    body = b'{"objects":[' + b"0," * int(15 * MEGABYTE * attack.scale) + b"0]}"
    attack.many(lambda i: attack.send("POST", "/v1/scenes", body, JSON))


def huge_films(attack):
    """Jobs of large images with every plane: each nearly all of the memory for them."""
    side = int(1800 * attack.scale**0.5)
    settings = {"samples": 1, "aovs": ["depth", "object_id", "normal", "alpha", "variance"]}
    job = {"scene": FILLED, "image": {"width": side, "height": side}, "settings": settings}
    attack.many(lambda i: attack.send("POST", "/v1/jobs", job))


def objects(seed, count):
    """A scene of many small objects: some tens of bytes of JSON each."""
    spheres = [{"type": "sphere", "center": [seed, i % 100, i // 100], "radius": 0.4} for i in range(count)]
    return {"lights": SPHERE["lights"], "objects": spheres}


def waiting_jobs(attack):
    """Jobs that wait behind a long one, each with a scene of its own."""
    attack.send("POST", "/v1/jobs", heavy_job())
    count = int(20_000 * attack.scale)
    attack.many(lambda i: [attack.send("POST", "/v1/jobs", {
        "scene": objects(i * 1000 + turn, count), "image": {"width": 16, "height": 16}}) for turn in range(6)])  # fmt: skip


def encodings(attack):
    """One large image, in many encodings at once."""
    side = int(3000 * attack.scale**0.5)
    job = attack.daemon.submit({"scene": FILLED, "image": {"width": side, "height": side}, "settings": {"samples": 1}})
    attack.daemon.wait_ended(job, 600)
    kinds = ["format=exr", "format=hdr", *(f"format=png&exposure={i}" for i in range(CLIENTS))]
    attack.many(lambda i: attack.send("GET", f"/v1/jobs/{job}/image?{kinds[i]}"), len(kinds))


def unread_answers(attack):
    """Thousands of pipelined requests for a large document, and nobody reads."""
    request = b"GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n"
    connections = [connect(attack.daemon) for _ in range(int(400 * attack.scale) or 20)]
    for connection in connections:
        connection.setblocking(False)
        try:
            connection.send(request * 2000)
        except BlockingIOError:
            pass
    time.sleep(2)
    for connection in connections:
        connection.close()


def lingering_connections(attack):
    """Headers as large as may be that never end, and bodies of which the last byte is missing."""
    head = b"GET /livez HTTP/1.1\r\nHost: localhost\r\n" + b"".join(b"X-%d: %s\r\n" % (i, b"a" * 230) for i in range(60))
    size = int(200_000 * attack.scale)
    body = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    body += b"Content-Length: %d\r\n\r\n%b" % (size + 1, b" " * size)
    connections = [connect(attack.daemon) for _ in range(int(900 * attack.scale) or 20)]
    for i, connection in enumerate(connections):
        try:
            connection.sendall(body if i % 2 else head)
        except OSError:  # It has been refused meanwhile.
            pass
    time.sleep(2)
    for connection in connections:
        connection.close()


def wide_plans(attack):
    """Images that are all tiles of one pixel."""
    side = int(1200 * attack.scale**0.5)
    job = {"scene": FILLED, "image": {"width": side, "height": side}, "settings": {"samples": 1, "tile_size": 1}}
    attack.many(lambda i: attack.send("POST", "/v1/jobs", job))


def huge_textures(attack):
    """Small files that are large images once they are decoded."""
    sides = [int((8192 if i % 2 else 3000) * attack.scale**0.5) + i for i in range(CLIENTS)]
    attack.many(lambda i: render(attack, triangles([{"mesh": 0}], black_png(sides[i]))))


def deep_instancing(attack):
    """Instances of a mesh by the hundred thousand."""
    count = int(100_000 * attack.scale)
    nodes = [{"mesh": 0, "translation": [i % 500, i // 500, 0]} for i in range(count)]
    attack.many(lambda i: render(attack, triangles(nodes, note=str(i))), 8)


def render(attack, model):
    path = "/v1/render?width=32&height=32&samples=1"
    attack.send("POST", path, model, {"Content-Type": "model/gltf-binary"})


def many_structures(attack):
    """One scene after the other, in every structure."""
    count = int(20_000 * attack.scale)

    def post(i):
        scene = objects(i, count)
        for kind in ("wide", "bvh", "kd", "octree", "grid", "bsp"):
            settings = {"accel": {"kind": kind}, "samples": 1}
            attack.send("POST", "/v1/jobs", {"scene": scene, "image": {"width": 16, "height": 16}, "settings": settings})

    attack.many(post, 8)


ATTACKS = [huge_bodies, huge_films, waiting_jobs, encodings, unread_answers, lingering_connections, wide_plans,
           huge_textures, deep_instancing, many_structures]  # fmt: skip


def flags_of_budget():
    told = subprocess.run([os.environ["TESSERAD"], "--help"], capture_output=True, text=True, check=True).stdout
    return ["--memory", "512MiB"] if "--memory " in told else PARTS_OF_IT


def measure(outcome):
    scale = outcome.choose(1 / 64, 1)
    flags = flags_of_budget()
    worst = 0
    for work in ATTACKS:
        with Daemon(*flags, "--threads", str(os.cpu_count())) as daemon:
            attack = Attack(daemon, scale)
            with processes.PeakOfFamily(daemon.process.pid) as family:
                work(attack)
            expect(daemon.process.poll() is None, f"{work.__name__} ended the daemon:\n{daemon.log()[-2000:]}")
            expect(daemon.request("GET", "/livez").status == 200, f"after {work.__name__} it isn't alive")
            peak = max(family.bytes, processes.peak_bytes(daemon.process.pid))
        worst = max(worst, peak)
        statuses = ", ".join(f"{count} × {status}" for status, count in sorted(attack.statuses.items(), key=str))
        what = work.__name__.replace("_", " ")
        if outcome.is_short:
            outcome.row(what, "it lives", remark=statuses)
        else:
            outcome.row(f"memory, {what}", f"{peak / MEGABYTE:.0f} MiB", f"≤ {1.25 * BUDGET / MEGABYTE:.0f} MiB", statuses)
    if not outcome.is_short:
        outcome.at_most("memory/worst_over_budget", worst / BUDGET, 1.25, "the most memory / what the flags give in all",
                        remark=" ".join(flags))
