"""kill -9 at random moments of a long script of work: nothing that was answered is lost, and every image is
byte-identical to that of a daemon that nobody disturbed.

Half of the kills come at a random time, also while the daemon starts; the other half at a random call that changes what
lies on disk, just before or after it (tools/fault_points.c), where there is a C compiler. Both come from the seed; as
threads run as they do, the same seed gives the same script, not the same moments.
"""

import collections
import hashlib
import http.client
import os
import random
import shutil
import subprocess
import tempfile
import threading
import time

from daemon import ENDED, Daemon
from documents import SPHERE

from tools.clients import Lost, Pause, ask, drive
from tools.outcome import Broken, expect
from tools.scenes import heavy_job

KILLS = 1000
CLIENTS = 4
KEPT = 60  # Jobs that are looked at after each kill; older ones are deleted.
FLAGS = ["--threads", "2"]

PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
PLY += "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
BLOB = "sha256:" + hashlib.sha256(PLY.encode()).hexdigest()


def kinds():
    """Documents whose images differ, from a moment's to seconds' work: that one is killed in its midst."""
    scene = {"lights": [{"type": "environment", "radiance": [1, 1, 1]}], "objects": SPHERE["objects"]}
    for seed, (side, samples) in enumerate([(16, 1), (32, 4), (48, 16), (64, 16), (96, 64), (160, 64), (256, 64)]):
        settings = {"samples": samples, "seed": seed}
        yield {"scene": scene, "image": {"width": side, "height": side}, "settings": settings}
    of_file = {"lights": SPHERE["lights"], "objects": [{"type": "file", "blob": BLOB, "format": "ply"}]}
    yield {"scene": of_file, "image": {"width": 40, "height": 40}, "settings": {"samples": 16, "seed": 7}}


KINDS = list(kinds())
OF_FILE = len(KINDS) - 1
EXR = "image?format=exr&aov=all"


class Model:
    """What clients have been told, and so must find again."""

    def __init__(self):
        self.kinds = collections.OrderedDict()  # The kind of each job that was accepted; None of one without an end.
        self.completed, self.canceled, self.deleted = set(), set(), set()
        self.may_be_canceled, self.may_be_deleted = set(), set()  # That has been sent, and perhaps not answered.
        self.keys = {}  # Idempotency-Key → (kind, id or None where no answer came).
        self.unanswered = 0  # Submissions without a key, of which nobody knows whether they came to be.
        self.scenes = set()
        self.images = 0
        self._told = collections.defaultdict(list)

    def note(self, made, what):
        """For whoever has to find out how a job was lost."""
        self._told[made].append(f"{time.strftime('%T')} {what}")

    def history(self, made):
        return "; ".join(self._told[made])

    def add(self, made, kind, how):
        self.note(made, f"accepted ({how}, kind {kind})")
        expect(made not in self.deleted, f"{made} was deleted and is accepted again: {self.history(made)}")
        self.kinds.setdefault(made, kind)

    def forget(self, made):
        """It has been deleted."""
        self.note(made, "deleted")
        self.kinds.pop(made, None)
        self.deleted.add(made)
        for jobs in (self.completed, self.canceled, self.may_be_canceled, self.may_be_deleted):
            jobs.discard(made)
        self.keys = {key: value for key, value in self.keys.items() if value[1] != made}


class Script:
    """What clients do until the daemon is killed."""

    def __init__(self, model, expected, chance, blob_is_there):
        self._model, self._expected, self._chance = model, expected, chance
        self._kinds = range(len(KINDS) if blob_is_there else OF_FILE)

    def client(self):
        while True:
            what = self._chance.choices(("job", "keyed", "later", "scene", "cancel", "delete"), (8, 4, 2, 2, 2, 3))[0]
            yield from getattr(self, f"_{what}")()

    def _submit(self, kind):
        self._model.unanswered += 1
        answer = yield ask("POST", "/v1/jobs", heavy_job(64) if kind is None else KINDS[kind])
        self._model.unanswered -= 1
        expect(answer.status == 201, f"a submission was answered with {answer.status} {answer.body!r}")
        made = answer.json()["id"]
        self._model.add(made, kind, "POST /v1/jobs")
        return made

    def _job(self):
        kind = self._chance.choice(self._kinds)
        made = yield from self._submit(kind)
        for _ in range(self._chance.randrange(60)):
            answer = yield ask("GET", f"/v1/jobs/{made}")
            if answer.status != 200:  # Somebody has deleted it.
                return
            state = answer.json()["state"]
            expect(state != "failed", f"{made} has failed: {answer.body!r}")
            if state == "completed":
                self._model.completed.add(made)
                yield from self._fetch(made, kind)
                return
            yield Pause(0.005)

    def _fetch(self, made, kind):
        answer = yield ask("GET", f"/v1/jobs/{made}/{EXR}")
        expect(answer.status in (200, 404), f"the image of {made} was answered with {answer.status} {answer.body!r}")
        if answer.status == 200:
            self._model.images += 1
            expect(answer.body == self._expected[kind], f"{made}, of kind {kind}, has another image than undisturbed")

    def _keyed(self):
        """With a key, and perhaps one whose answer never came."""
        open_keys = [key for key, (_, made) in self._model.keys.items() if made is None]
        if open_keys and self._chance.random() < 0.7:
            key = self._chance.choice(open_keys)
        else:
            key = f"key-{len(self._model.keys)}-{self._chance.randrange(1 << 30)}"
            self._model.keys[key] = (self._chance.choice(self._kinds), None)
        kind, _ = self._model.keys[key]
        answer = yield ask("POST", "/v1/jobs", KINDS[kind], [f"Idempotency-Key: {key}"])
        if answer.status == 409:  # Another client sends it, too.
            return
        expect(answer.status in (200, 201), f"a keyed submission was answered with {answer.status} {answer.body!r}")
        made = answer.json()["id"]
        before = self._model.keys[key][1]
        expect(before in (None, made), f"{key} was {before} and is {made} now")
        self._model.keys[key] = (kind, made)
        self._model.add(made, kind, f"{answer.status} with {key}")

    def _later(self):
        """A render that its client doesn't wait for. What is known already is answered at once."""
        kind = self._chance.choice(self._kinds)
        self._model.unanswered += 1
        answer = yield ask("POST", "/v1/render", KINDS[kind], ["Prefer: respond-async"])
        self._model.unanswered -= 1
        expect(answer.status in (200, 202), f"a render was answered with {answer.status} {answer.body!r}")
        if answer.status == 202:
            self._model.add(answer.json()["id"], kind, "202")

    def _scene(self):
        radiance = [self._chance.randrange(1, 200) / 10] * 3
        scene = {"lights": [{"type": "ambient", "radiance": radiance}], "objects": SPHERE["objects"]}
        answer = yield ask("POST", "/v1/scenes", scene)
        expect(answer.status in (200, 201), f"a scene was answered with {answer.status} {answer.body!r}")
        self._model.scenes.add(answer.json()["scene"])

    def _cancel(self):
        made = yield from self._submit(None)
        yield Pause(self._chance.random() * 0.1)
        self._model.may_be_canceled.add(made)
        answer = yield ask("POST", f"/v1/jobs/{made}/cancel")
        expect(answer.status in (202, 404, 409), f"a cancel was answered with {answer.status} {answer.body!r}")
        if answer.status == 202:
            self._model.canceled.add(made)

    def _delete(self):
        candidates = [made for made in self._model.kinds if made not in self._model.may_be_deleted]
        if not candidates:
            return
        made = self._chance.choice(candidates)
        self._model.may_be_deleted.add(made)
        self._model.note(made, "DELETE is sent")
        answer = yield ask("DELETE", f"/v1/jobs/{made}")
        if answer.status in (204, 404):
            self._model.forget(made)
        else:
            self._model.note(made, f"DELETE was answered with {answer.status}")
            expect(answer.status == 409, f"a DELETE was answered with {answer.status} {answer.body!r}")
            self._model.may_be_deleted.discard(made)


def look(daemon, model, chance, expected):
    """What the daemon says after a kill has to be what clients were told before."""
    states, after = {}, ""
    while True:
        page = daemon.request("GET", f"/v1/jobs?limit=1000{after}").json()
        for job in page["jobs"]:
            expect(job["id"] not in states, f"{job['id']} is listed twice")
            states[job["id"]] = job["state"]
        if "next" not in page:
            break
        after = f"&after={page['next']}"
    for made, kind in list(model.kinds.items()):
        if made not in states:
            expect(made in model.may_be_deleted, f"{made} is lost: {model.history(made)}")
            model.forget(made)
            continue
        state = states[made]
        expect(state != "failed", f"{made} has failed")
        expect(state != "canceled" or made in model.may_be_canceled, f"{made} is canceled, and nobody did that")
        if made in model.completed:
            expect(state == "completed", f"{made} was completed and is {state}")
        if made in model.canceled:
            expect(state == "canceled", f"{made} was canceled and is {state}")
    back = model.deleted & states.keys()
    expect(not back, f"{back} were deleted and are there again")
    strangers = states.keys() - model.kinds.keys()
    repeat_keyed(daemon, model, strangers)
    strangers -= model.kinds.keys()
    expect(len(strangers) <= model.unanswered,
           f"{len(strangers)} jobs nobody was told of, with {model.unanswered} submissions unanswered")
    completed = [made for made in model.completed if made in model.kinds]
    for made in chance.sample(completed, min(3, len(completed))):
        check_image(daemon, model, made, expected)
    for scene in chance.sample(sorted(model.scenes), min(3, len(model.scenes))):
        expect(daemon.request("GET", f"/v1/scenes/{scene}").status == 200, f"{scene} is lost")
    return strangers


def repeat_keyed(daemon, model, strangers):
    """Submissions with a key whose answer never came: the job that came of one, or else a new one."""
    for key, (kind, made) in model.keys.items():
        if made is not None:
            continue
        reply = daemon.request("POST", "/v1/jobs", KINDS[kind], {"Idempotency-Key": key})
        expect(reply.status in (200, 201), f"a keyed submission was answered with {reply.status} {reply.body!r}")
        made = reply.json()["id"]
        expect(reply.status == 201 or made in strangers, f"{key} is said to be {made}, which isn't listed")
        model.keys[key] = (kind, made)
        model.add(made, kind, f"{reply.status} when {key} was repeated")


def check_image(daemon, model, made, expected):
    reply = daemon.request("GET", f"/v1/jobs/{made}/{EXR}")
    expect(reply.status == 200, f"the image of {made} was answered with {reply.status} {reply.body!r}")
    kind = model.kinds[made]
    if reply.body != expected[kind]:
        stats = daemon.request("GET", f"/v1/jobs/{made}/stats").body
        alike = [other for other, image in enumerate(expected) if image == reply.body]
        other_bytes = sum(a != b for a, b in zip(reply.body, expected[kind]))
        raise Broken(f"{made}, of kind {kind}, has another image than undisturbed: {len(reply.body)} bytes for "
                     f"{len(expected[kind])}, {other_bytes} are others; like kinds {alike}; {daemon.status(made)} {stats}")
    model.images += 1


def tidy(daemon, model, strangers):
    """Deletes what nobody was told of, and the oldest of the rest, so that the script can go on for ever."""
    oldest = list(model.kinds)[: max(0, len(model.kinds) - KEPT)]
    for made in [*strangers, *oldest]:
        model.may_be_canceled.add(made)
        model.may_be_deleted.add(made)
        daemon.request("POST", f"/v1/jobs/{made}/cancel")
        reply = daemon.request("DELETE", f"/v1/jobs/{made}")
        if reply.status == 409:  # Its last thread hasn't left it yet.
            daemon.wait_ended(made)
            reply = daemon.request("DELETE", f"/v1/jobs/{made}")
        expect(reply.status in (204, 404), f"a DELETE was answered with {reply.status} {reply.body!r}")
        model.forget(made)
    model.unanswered = 0


def references(folder):
    """The image of each kind, by a daemon that nobody disturbs."""
    with Daemon(data_dir=os.path.join(folder, "undisturbed")) as daemon:
        put_blob(daemon)
        jobs = [daemon.submit(document) for document in KINDS]
        for job in jobs:
            expect(daemon.wait_ended(job)["state"] == "completed", "an undisturbed job didn't complete")
        replies = [daemon.request("GET", f"/v1/jobs/{job}/{EXR}") for job in jobs]
        expect(all(reply.status == 200 for reply in replies), f"undisturbed images: {replies[0].body[:500]!r}")
        expect(len({reply.body for reply in replies}) == len(KINDS), "kinds look the same")
        return [reply.body for reply in replies]


def put_blob(daemon):
    reply = daemon.request("PUT", f"/v1/blobs/{BLOB}", PLY.encode())
    expect(reply.status in (200, 201, 204), f"a blob was answered with {reply.status} {reply.body!r}")


def fault_points(folder):
    """The library to preload; None where it can't be made."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if not compiler:
        return None
    source = os.path.join(os.path.dirname(__file__), "..", "tools", "fault_points.c")
    library = os.path.join(folder, "fault_points.so")
    done = subprocess.run([compiler, "-O1", "-shared", "-fPIC", "-o", library, source], capture_output=True, check=False)
    return library if done.returncode == 0 else None


def worst_lines(log):
    """All that is a warning or worse, and how it ended."""
    lines = log.splitlines()
    return "\n".join([line for line in lines if " info " not in line and " debug " not in line] + lines[-5:])


class Campaign:
    def __init__(self, folder, seed):
        self._data_dir = os.path.join(folder, "data")
        self._expected = references(folder)
        self._library = fault_points(folder)
        self._chance = random.Random(seed)
        self._blob_is_there = False
        self.model = Model()
        self.counts = collections.Counter()
        self.kept_log = ""

    def kill_once(self):
        """A start, a look, some work and its end."""
        chance = random.Random(self._chance.randrange(1 << 62))
        if chance.random() < 0.1:
            return self._kill_at_start(chance)
        at_call = self._library is not None and chance.random() < 0.5
        env = {}
        if at_call:
            env = {"LD_PRELOAD": self._library, "TESSERA_FAULT_POINT": str(int(10 ** chance.uniform(0, 3.5)))}
            env["ASAN_OPTIONS"] = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"
        try:
            daemon = Daemon(*FLAGS, data_dir=self._data_dir, env=env)
        except RuntimeError as failure:
            expect(at_call and "critical" not in str(failure), str(failure))
            self.counts["at a call, in the start"] += 1
            return None
        timer = None
        try:
            strangers = look(daemon, self.model, chance, self._expected)
            tidy(daemon, self.model, strangers)
            if not self._blob_is_there:
                put_blob(daemon)
                self._blob_is_there = True
            timer = threading.Timer(3 if at_call else chance.random() ** 2 * 1.5, daemon.process.kill)
            timer.start()
            script = Script(self.model, self._expected, chance, self._blob_is_there)
            drive(daemon.port, [script.client() for _ in range(CLIENTS)])
        except Broken:
            self.kept_log = worst_lines(daemon.log())
            raise
        except (Lost, OSError, http.client.HTTPException):
            deadline = time.monotonic() + 10
            while daemon.process.poll() is None and time.monotonic() < deadline:
                time.sleep(0.001)
            self.kept_log = worst_lines(daemon.log())
            expect(daemon.process.poll() == -9, f"the daemon ended with {daemon.process.poll()} by itself")
        finally:
            if timer:
                timer.cancel()
                timer.join()
            daemon.kill()
        self.counts["at a call" if at_call else "at a time"] += 1
        return None

    def _kill_at_start(self, chance):
        command = [os.environ["TESSERAD"], "--port", "0", "--data-dir", self._data_dir, *FLAGS]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            time.sleep(chance.random() * 0.15)
            process.kill()
        self.counts["in the start"] += 1

    def end(self):
        """All that is left is worked out, and every image compared."""
        with Daemon(*FLAGS, data_dir=self._data_dir) as daemon:
            look(daemon, self.model, self._chance, self._expected)
            for made, kind in self.model.kinds.items():
                if kind is None:
                    daemon.request("POST", f"/v1/jobs/{made}/cancel")
                    continue
                status = daemon.wait_until(made, lambda status: status["state"] in ENDED, 600)
                expect(status["state"] == "completed", f"{made} of kind {kind} in the end: {status}")
                check_image(daemon, self.model, made, self._expected)


def measure(outcome):
    kills = outcome.kills or outcome.choose(12, KILLS)
    with tempfile.TemporaryDirectory(prefix="tessera-kills-") as folder:
        campaign = Campaign(folder, outcome.seed)
        begin = time.monotonic()
        done = 0
        try:
            for done in range(1, kills + 1):
                campaign.kill_once()
            campaign.end()
        except Broken as failure:
            if keep := os.environ.get("TESSERA_KEEP"):
                shutil.copytree(folder, keep, dirs_exist_ok=True)
            log = campaign.kept_log
            raise Broken(f"{failure} (after {done} kills, --seed {outcome.seed}); the end of its log:\n{log}") from None
    how = ", ".join(f"{count} {what}" for what, count in sorted(campaign.counts.items()))
    outcome.row(f"{kills} kills in {time.monotonic() - begin:.0f} s", "nothing lost", "nothing", f"{how}; seed {outcome.seed}")
    outcome.row("images compared with undisturbed ones", f"{campaign.model.images} identical", "all")
