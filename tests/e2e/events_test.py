"""Server-sent events: what those are told who watch jobs, however slow they are, and whatever becomes of the daemon."""

import contextlib
import http.client
import json
import os
import re
import socket
import tempfile
import time
import unittest

from daemon import ENDED, SOURCE, Daemon, Reply, bearer, make_key
from documents import ENDLESS_PIXEL, SMALL_JOB, SPHERE
from schema import faults

# Long enough for several progress events, and for several passes.
SECONDS_LONG = {"scene": SPHERE, "image": {"width": 64, "height": 64}, "settings": {"until": {"seconds": 2, "samples": 10**6}}}


class Event:
    """As the browser's EventSource would dispatch it, with the id that it would send when it connects again."""

    def __init__(self, kind, data, last_id):
        self.kind, self.data, self.id = kind, data, last_id

    @property
    def state(self):
        return self.data.get("state") if self.kind == "state" else None

    def __repr__(self):
        return f"{self.kind} {self.data} {self.id}"


class Watcher:
    """Reads a stream of events. Use it in a `with`."""

    def __init__(self, daemon, path, last_id=None, headers=None, receive_buffer=None):
        self.connection = daemon.connect()
        if receive_buffer:
            self.connection.sock = socket.socket()
            self.connection.sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
            self.connection.sock.settimeout(60)
            self.connection.sock.connect((daemon.host, daemon.port))
        headers = {"Accept": "text/event-stream", **(headers or {})}
        if last_id is not None:
            headers["Last-Event-ID"] = last_id
        self.connection.request("GET", path, headers=headers)
        self.socket = self.connection.sock  # The connection lets go of it, as the answer says that it ends.
        self.response = self.connection.getresponse()
        self.status = self.response.status
        self.last_id = last_id or ""
        self.comments = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.connection.close()
        self.response.close()

    def __iter__(self):
        kind, data, last_id = "message", [], self.last_id
        while line := self.response.readline():
            line = line.decode().rstrip("\n")
            name, _, value = line.partition(": ")
            if not line:
                self.last_id = last_id
                if data:
                    yield Event(kind, json.loads("\n".join(data)), last_id)
                kind, data = "message", []
            elif line.startswith(":"):
                self.comments += 1
            elif name == "id":
                last_id = value
            elif name == "event":
                kind = value
            elif name == "data":
                data.append(value)
            else:
                assert name == "retry" and value.isdigit(), line

    def until(self, reached):
        """The events up to the first for which `reached(event)`."""
        events = []
        for event in self:
            events.append(event)
            if reached(event):
                return events
        raise AssertionError(f"the stream ended before that: {events}")

    def states(self):
        """Of a stream that ends."""
        return [event.state for event in self if event.kind == "state"]


def position(event_id):
    """What ids are ordered by."""
    return [int(part) for part in event_id.split(".")]


def events_of(job):
    return f"/v1/jobs/{job}/events"


class EventsTest(unittest.TestCase):
    def test_a_job_from_beginning_to_end(self):
        with Daemon() as daemon:
            job = daemon.submit({**SECONDS_LONG, "name": "two seconds"})
            with Watcher(daemon, events_of(job)) as watcher:
                self.assertEqual(watcher.response.headers["Content-Type"], "text/event-stream")
                self.assertEqual(watcher.response.headers["Cache-Control"], "no-store")
                self.assertEqual(watcher.response.headers["Transfer-Encoding"], "chunked")
                events = list(watcher)
            states = [event for event in events if event.kind == "state"]
            self.assertEqual([event.state for event in states], ["queued", "preparing", "rendering", "completed"])
            ids = [position(event.id) for event in states]
            self.assertEqual(ids, sorted(ids))
            self.assertEqual(len(ids), len({event.id for event in states}))
            times = [event.data["time"] for event in states]
            self.assertEqual(times, sorted(times))
            self.assertTrue(all(event.data["job"] == job and event.data["name"] == "two seconds" for event in states))

            end = states[-1]
            self.assertIs(events[-1], end)
            self.assertEqual(daemon.request("GET", end.data["image"]).status, 200)
            status = daemon.status(job)
            self.assertEqual({**end.data["status"], "elapsed": 0}, {**status, "elapsed": 0})

            begun = events.index(states[2])
            told = [event for event in events if event.kind == "progress"]
            parts = [event.data["progress"] for event in told]
            self.assertEqual(parts, sorted(parts), "it doesn't go back")
            self.assertLess(parts[-1], 1, "there is no image yet")
            for event in told:
                if "eta_range" in event.data:
                    low, high = event.data["eta_range"]
                    self.assertLess(low, high)
                    self.assertLessEqual(low, event.data["eta"])
                    self.assertLessEqual(event.data["eta"], high)
            self.assertGreaterEqual(len(told), 2)
            self.assertTrue(all(events.index(event) > begun for event in told))
            self.assertEqual({event.id for event in told}, {states[2].id}, "progress has no id of its own")
            self.assertEqual({event.data["id"] for event in told}, {job})
            done = [event.data["samples_done"] for event in told]
            self.assertEqual(done, sorted(done))
            passes = [event for event in events if event.kind == "pass"]
            counts = [event.data["passes"] for event in passes]
            self.assertGreaterEqual(len(counts), 1)
            self.assertEqual(counts, sorted(set(counts)))
            with open(os.path.join(SOURCE, "proto", "openapi.json"), encoding="utf-8") as file:
                document = json.load(file)
            schemas = {"state": "JobEvent", "progress": "Job", "pass": "PassEvent", "tiles": "TilesEvent"}
            for event in events:
                schema = document["components"]["schemas"][schemas[event.kind]]
                self.assertEqual(faults(document, schema, event.data, event.kind), [])

    def test_finished_tiles(self):
        with Daemon("--threads", "1") as daemon:
            side, tile = 1024, 16
            image = {"width": side, "height": side}
            job = daemon.submit({"scene": SPHERE, "image": image, "settings": {"samples": 8, "tile_size": tile}})
            with Watcher(daemon, events_of(job)) as watcher:
                told = [event for event in watcher if event.kind == "tiles"]
            self.assertGreaterEqual(len(told), 1)
            seen = []
            for event in told:
                self.assertLessEqual(len(event.data["tiles"]), 64)
                for x, y, width, height in event.data["tiles"]:
                    self.assertEqual((x % tile, y % tile, width, height), (0, 0, tile, tile))
                    seen.append((x, y))
            self.assertEqual(len(seen), len(set(seen)), "each is told once")
            done = [event.data["tiles_done"] for event in told]
            self.assertEqual(done, sorted(set(done)))
            self.assertLessEqual(done[-1], (side // tile) ** 2)

    def test_who_comes_again_goes_on_from_there(self):
        with Daemon() as daemon:
            job = daemon.submit(SMALL_JOB)
            daemon.wait_ended(job)
            with Watcher(daemon, events_of(job)) as watcher:
                states = [event for event in watcher if event.state]
            names = [event.state for event in states]
            self.assertEqual(names, ["queued", "preparing", "rendering", "completed"])
            for i, event in enumerate(states[:-1]):
                with Watcher(daemon, events_of(job), event.id) as watcher:
                    self.assertEqual(watcher.states(), names[i + 1 :])
            # What the HTML standard has end a client's coming again.
            reply = daemon.request("GET", events_of(job), headers={"Last-Event-ID": states[-1].id})
            self.assertEqual((reply.status, reply.body), (204, b""))
            for nonsense in ("0", "", "x", "1e3", "-1", "99999999999999999999", "1.x", "4000000"):
                with Watcher(daemon, events_of(job), nonsense) as watcher:
                    self.assertEqual(watcher.states(), names, nonsense)

    def test_a_job_that_is_canceled_or_fails(self):
        with Daemon() as daemon:
            job = daemon.submit(ENDLESS_PIXEL)
            with Watcher(daemon, events_of(job)) as watcher:
                watcher.until(lambda event: event.state == "rendering")
                daemon.request("POST", f"/v1/jobs/{job}/cancel")
                states = watcher.states()
            self.assertEqual(states, ["canceled"])
            self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{job}").status, 204)
            self.assertEqual(daemon.request("GET", events_of(job)).status, 404)

    def test_the_ids_outlive_the_daemon(self):
        with tempfile.TemporaryDirectory() as data_dir:
            daemon = Daemon(data_dir=data_dir)
            ended = daemon.submit(SMALL_JOB)
            with Watcher(daemon, events_of(ended)) as watcher:
                before = [(event.id, event.data["state"], event.data["time"]) for event in watcher if event.state]
            endless = daemon.submit(ENDLESS_PIXEL)
            with Watcher(daemon, events_of(endless)) as watcher, Watcher(daemon, "/v1/events", "0") as all_jobs:
                watcher.until(lambda event: event.state == "rendering")
                seen = all_jobs.until(lambda event: event.data.get("job") == endless and event.state == "rendering")
                last = watcher.last_id
                daemon.kill()
            self.assertEqual(len([event for event in seen if event.kind == "state"]), 7)
            with Daemon(data_dir=data_dir) as daemon:
                with Watcher(daemon, events_of(ended)) as watcher:
                    after = [(event.id, event.data["state"], event.data["time"]) for event in watcher if event.state]
                self.assertEqual([event[:2] for event in after], [event[:2] for event in before])
                self.assertEqual(daemon.request("GET", events_of(ended), headers={"Last-Event-ID": before[-1][0]}).status, 204)
                with Watcher(daemon, events_of(endless), last) as watcher:
                    events = watcher.until(lambda event: event.state == "rendering")
                    states = [event for event in events if event.kind == "state"]
                    self.assertEqual([event.state for event in states], ["queued", "preparing", "rendering"])
                    self.assertGreater(position(states[0].id), position(last), "it is queued once more")
                with Watcher(daemon, "/v1/events", all_jobs.last_id) as watcher:
                    events = watcher.until(lambda event: event.state == "rendering")
                    self.assertEqual({event.data["job"] for event in events if event.kind == "state"}, {endless})
                daemon.request("POST", f"/v1/jobs/{endless}/cancel")

    def test_all_jobs(self):
        with Daemon("--threads", "2") as daemon:
            first = daemon.submit(SMALL_JOB)
            daemon.wait_ended(first)
            with Watcher(daemon, "/v1/events") as watcher:
                jobs = [daemon.submit(SMALL_JOB) for _ in range(20)]
                ended = set()

                def all_ended(event):
                    if event.state == "completed":
                        ended.add(event.data["job"])
                    return ended == set(jobs)

                events = watcher.until(all_ended)
                states = [event for event in events if event.kind == "state"]
                ids = [position(event.id) for event in states]
                self.assertEqual(ids, sorted(ids))
                self.assertEqual(len(ids), len(set(map(tuple, ids))))
                for job in jobs:
                    own = [event.state for event in states if event.data["job"] == job]
                    self.assertEqual(own, ["queued", "preparing", "rendering", "completed"])
                self.assertNotIn(first, {event.data["job"] for event in states}, "what was before")
            middle = states[len(states) // 2]
            with Watcher(daemon, "/v1/events", middle.id) as watcher:
                again = watcher.until(lambda event: event.id == states[-1].id)
            self.assertEqual([event.id for event in again], [event.id for event in states[len(states) // 2 + 1 :]])
            # One that connects and loses the connection before anything happens misses nothing, either.
            with Watcher(daemon, "/v1/events") as watcher:
                line = b""
                while not line.startswith(b"id: "):
                    line = watcher.response.readline()
            missed = daemon.submit(SMALL_JOB)
            with Watcher(daemon, "/v1/events", line.decode().split()[1]) as watcher:
                events = watcher.until(lambda event: event.state == "completed")
            self.assertEqual({event.data["job"] for event in events if event.kind == "state"}, {missed})
            self.assertEqual([event.state for event in events if event.kind == "state"][0], "queued")

    def test_jobs_that_are_there_no_more(self):
        with tempfile.TemporaryDirectory() as data_dir:
            with Daemon("--max-ended-jobs", "1", data_dir=data_dir) as daemon:
                with Watcher(daemon, "/v1/events") as watcher:
                    deleted = daemon.submit(SMALL_JOB)
                    daemon.wait_ended(deleted)
                    self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{deleted}").status, 204)
                    told = watcher.until(lambda event: event.kind == "removed")[-1]
                    self.assertEqual(told.data, {"job": deleted, "reason": "deleted"})
                    expired, last = daemon.submit(SMALL_JOB), daemon.submit(SMALL_JOB)
                    daemon.wait_ended(last)
                    events = watcher.until(lambda event: event.kind == "removed")
                    self.assertEqual(events[-1].data, {"job": expired, "reason": "expired"})
                daemon.kill()
            with Daemon(data_dir=data_dir) as daemon, Watcher(daemon, "/v1/events", told.id) as watcher:
                again = watcher.until(lambda event: event.kind == "removed")[-1]
                self.assertEqual((again.id, again.data), (events[-1].id, events[-1].data))

    def test_progress_of_all_jobs_that_render(self):
        with Daemon("--threads", "1") as daemon:
            jobs = {daemon.submit(ENDLESS_PIXEL) for _ in range(3)}
            told = set()

            def all_told(event):
                if event.kind == "progress":
                    told.add(event.data["id"])
                return told == jobs

            with Watcher(daemon, "/v1/events", "0") as watcher:
                watcher.until(all_told)
            for job in jobs:
                daemon.request("POST", f"/v1/jobs/{job}/cancel")

    def test_a_job_that_is_only_waited_for_is_in_no_journal(self):
        with Daemon("--threads", "1") as daemon:
            with Watcher(daemon, "/v1/events") as all_jobs:
                waiting = daemon.connect()
                waiting.request("POST", "/v1/render", json.dumps(ENDLESS_PIXEL), {"Content-Type": "application/json"})
                job = all_jobs.until(lambda event: event.state == "queued")[-1].data["job"]
                with Watcher(daemon, events_of(job)) as watcher:
                    watcher.until(lambda event: event.state == "rendering")
                    waiting.close()
                    self.assertEqual(watcher.states(), ["canceled"])
                    last = watcher.last_id
            self.assertRegex(last, r"^\d+\.\d+$")
            self.assertEqual(daemon.request("GET", events_of(job), headers={"Last-Event-ID": last}).status, 204)

    def test_who_is_slow_holds_nobody_up_and_misses_nothing(self):
        with Daemon("--threads", "1", "--log-level", "error") as daemon:
            with Watcher(daemon, "/v1/events", receive_buffer=4096) as slow:
                jobs = []
                for _ in range(150):  # Far more than what the system holds of what isn't read.
                    jobs.append(daemon.submit(SMALL_JOB))
                for job in jobs:
                    daemon.wait_ended(job)
                ended = []

                def all_ended(event):
                    if event.state == "completed":
                        ended.append(event.data["job"])
                    return len(ended) == len(jobs)

                states = [event for event in slow.until(all_ended) if event.kind == "state"]
            self.assertEqual(set(ended), set(jobs))
            self.assertEqual(len(states), 4 * len(jobs))
            ids = [position(event.id) for event in states]
            self.assertEqual(ids, sorted(ids))

    def test_who_reads_nothing_any_more_is_let_go(self):
        with Daemon("--timeout", "1", "--log-level", "error") as daemon:
            with Watcher(daemon, "/v1/events", receive_buffer=4096) as stuck:
                for _ in range(100):
                    daemon.submit(SMALL_JOB)
                while connections(daemon) > 1:
                    time.sleep(0.01)
                with self.assertRaises((http.client.IncompleteRead, ConnectionError, AssertionError)):
                    stuck.until(lambda event: False)

    def test_many_watchers(self):
        count = 200
        with Daemon("--threads", "1") as daemon, contextlib.ExitStack() as stack:
            job = daemon.submit(ENDLESS_PIXEL)
            daemon.wait_until(job, lambda status: status["state"] == "rendering")
            watchers = [stack.enter_context(Watcher(daemon, events_of(job))) for _ in range(5)]
            for watcher in watchers:
                watcher.until(lambda event: event.kind == "progress")
            before = resident(daemon)
            watchers += [stack.enter_context(Watcher(daemon, events_of(job))) for _ in range(count)]
            for watcher in watchers[5:]:
                watcher.until(lambda event: event.kind == "progress")
            self.assertLess((resident(daemon) - before) / count, 64 << 10)
            self.assertEqual(connections(daemon), count + 6, "each counts as a connection")
            daemon.request("POST", f"/v1/jobs/{job}/cancel")
            for watcher in watchers:
                self.assertEqual(watcher.states(), ["canceled"])
        # The daemon is gone with them here, so that none of them has hung.

    def test_watchers_that_have_gone_are_noticed(self):
        with Daemon() as daemon:
            job = daemon.submit(ENDLESS_PIXEL)
            with contextlib.ExitStack() as stack:
                for path in (events_of(job), "/v1/events"):
                    for _ in range(10):
                        stack.enter_context(Watcher(daemon, path))
                self.assertEqual(connections(daemon), 21)
            while connections(daemon) > 1:
                time.sleep(0.01)
            daemon.request("POST", f"/v1/jobs/{job}/cancel")

    def test_who_has_no_more_to_say_still_listens(self):
        with Daemon() as daemon:
            job = daemon.submit(ENDLESS_PIXEL)
            with Watcher(daemon, events_of(job)) as watcher:
                watcher.socket.shutdown(socket.SHUT_WR)
                watcher.until(lambda event: event.kind == "progress")
                daemon.request("POST", f"/v1/jobs/{job}/cancel")
                self.assertEqual(watcher.states(), ["canceled"])

    def test_old_clients_and_heads(self):
        with Daemon() as daemon:
            job = daemon.submit(SMALL_JOB)
            daemon.wait_ended(job)
            for version, chunked in (("1.0", False), ("1.1", True)):
                for method in ("GET", "HEAD"):
                    answer = raw(daemon, f"{method} {events_of(job)} HTTP/{version}\r\nHost: {daemon.host}\r\n\r\n")
                    head, _, body = answer.partition(b"\r\n\r\n")
                    self.assertTrue(head.startswith(b"HTTP/1.1 200 "), head)
                    self.assertEqual(b"Transfer-Encoding: chunked" in head, chunked)
                    self.assertNotIn(b"Content-Length", head)
                    if method == "HEAD":
                        self.assertEqual(body, b"")
                    else:
                        self.assertEqual(body.endswith(b"\r\n0\r\n\r\n"), chunked)
                        self.assertEqual(body.count(b"event: state\n"), 4)
                        self.assertTrue(chunked or body.startswith(b"retry: "), body)
            answer = raw(daemon, f"HEAD /v1/events HTTP/1.1\r\nHost: {daemon.host}\r\n\r\n")
            self.assertTrue(answer.endswith(b"\r\n\r\n"))

    def test_a_daemon_that_stops_ends_streams(self):
        with Daemon() as daemon:
            job = daemon.submit(ENDLESS_PIXEL)
            with Watcher(daemon, events_of(job)) as watcher, Watcher(daemon, "/v1/events") as all_jobs:
                watcher.until(lambda event: event.kind == "progress")
                daemon.terminate()
                self.assertNotIn("canceled", watcher.states(), "the next daemon goes on with it")
                self.assertNotIn("canceled", all_jobs.states())
            self.assertEqual(daemon.stop(), 0)

    def test_while_it_drains_jobs_are_watched_to_their_end(self):
        with Daemon("--drain-seconds", "60") as daemon:
            job = daemon.submit(SECONDS_LONG)
            with Watcher(daemon, events_of(job)) as watcher:
                watcher.until(lambda event: event.state == "rendering")
                daemon.terminate()
                self.assertEqual(watcher.states(), ["completed"])
            self.assertEqual(daemon.stop(), 0)

    def test_prefer_wait(self):
        with Daemon() as daemon:
            wait = {"Prefer": "wait=60"}
            reply = daemon.request("POST", "/v1/jobs", SMALL_JOB, wait)
            self.assertEqual((reply.status, reply.json()["state"]), (201, "completed"))
            self.assertEqual(reply.headers["Preference-Applied"], "wait=60")
            self.assertEqual(reply.headers["Location"], f"/v1/jobs/{reply.json()['id']}")
            key = {"Idempotency-Key": '"1"', **wait}
            job = daemon.request("POST", "/v1/jobs", SMALL_JOB, key).json()["id"]
            again = daemon.request("POST", "/v1/jobs", SMALL_JOB, key)
            self.assertEqual((again.status, again.json()["id"], again.json()["state"]), (200, job, "completed"))

            endless = daemon.submit(ENDLESS_PIXEL)
            for seconds in (0, 1):
                begun = time.monotonic()
                reply = daemon.request("GET", f"/v1/jobs/{endless}", headers={"Prefer": f"respond-async, wait={seconds}"})
                self.assertEqual((reply.status, reply.headers["Preference-Applied"]), (200, f"wait={seconds}"))
                self.assertNotIn(reply.json()["state"], ENDED)
                self.assertGreaterEqual(time.monotonic() - begun, seconds)
            for nonsense in ("wait=x", "wait=-1", "wait", "wait=99999999", "other=1"):
                reply = daemon.request("GET", f"/v1/jobs/{endless}", headers={"Prefer": nonsense})
                self.assertNotIn("Preference-Applied", reply.headers, nonsense)
            with contextlib.closing(daemon.connect()) as waiting:
                waiting.request("GET", f"/v1/jobs/{endless}", headers=wait)
                daemon.request("POST", f"/v1/jobs/{endless}/cancel")
                self.assertEqual(Reply(waiting.getresponse()).json()["state"], "canceled")
            # Not longer than there is a daemon.
            endless = daemon.submit(ENDLESS_PIXEL)
            with contextlib.closing(daemon.connect()) as waiting:
                waiting.request("GET", f"/v1/jobs/{endless}", headers=wait)
                while requests_active(daemon) < 2:  # The other one is this one.
                    time.sleep(0.005)
                daemon.terminate()
                self.assertEqual(Reply(waiting.getresponse()).status, 200)
            self.assertEqual(daemon.stop(), 0)

    def test_owners(self):
        with tempfile.TemporaryDirectory() as data_dir:
            one = bearer(make_key(data_dir, owner="one"))
            other = bearer(make_key(data_dir, owner="other"))
            admin = bearer(make_key(data_dir, "--scope", "admin", owner="chief"))
            sender = bearer(make_key(data_dir, "--scope", "submit", owner="one"))
            with Daemon(data_dir=data_dir) as daemon:
                self.assertEqual(daemon.request("GET", "/v1/events").status, 401)
                self.assertEqual(daemon.request("GET", "/v1/events", headers=sender).status, 403)

                def submit(key):
                    reply = daemon.request("POST", "/v1/jobs", SMALL_JOB, key)
                    self.assertEqual(reply.status, 201)
                    return reply.json()["id"]

                ones, others = submit(one), submit(other)
                self.assertEqual(daemon.request("GET", events_of(ones), headers=other).status, 404)
                self.assertEqual(daemon.request("GET", events_of(ones)).status, 401)
                for job, key in ((ones, one), (others, other), (ones, admin), (others, admin)):
                    with Watcher(daemon, events_of(job), headers=key) as watcher:
                        self.assertEqual(watcher.states()[-1], "completed")
                last = submit(one)
                for key, seen in ((one, {ones, last}), (other, {others}), (admin, {ones, others, last})):
                    wanted = set(seen)

                    def all_ended(event, wanted=wanted):
                        if event.state == "completed":
                            wanted.discard(event.data["job"])
                        return not wanted

                    with Watcher(daemon, "/v1/events", "0", key) as watcher:
                        events = watcher.until(all_ended)
                    self.assertEqual({event.data["job"] for event in events if event.kind == "state"}, seen)
                for job, key in ((others, other), (ones, one)):
                    self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{job}", headers=key).status, 204)
                with Watcher(daemon, "/v1/events", "0", one) as watcher:
                    removed = watcher.until(lambda event: event.kind == "removed")[-1]
                self.assertEqual(removed.data["job"], ones)


def raw(daemon, text):
    """Sends this, and reads until the daemon has closed."""
    with socket.create_connection((daemon.host, daemon.port), timeout=60) as connection:
        connection.sendall(text.encode())
        answer = b""
        while piece := connection.recv(65536):
            answer += piece
        return answer


def connections(daemon):
    """How many there are, this one included."""
    metrics = daemon.request("GET", "/metrics").body.decode()
    return int(re.search(r"^tessera_http_connections (\d+)$", metrics, re.MULTILINE)[1])


def requests_active(daemon):
    """How many are being answered, this one included."""
    metrics = daemon.request("GET", "/metrics").body.decode()
    return int(re.search(r"^tessera_http_requests_active (\d+)$", metrics, re.MULTILINE)[1])


def resident(daemon):
    """Bytes of memory that the daemon takes."""
    with open(f"/proc/{daemon.process.pid}/status", encoding="ascii") as status:
        return int(re.search(r"VmRSS:\s+(\d+) kB", status.read())[1]) << 10


if __name__ == "__main__":
    unittest.main()
