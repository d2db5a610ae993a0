"""The end of a job is told to whom its webhook names, signed, once at least, and to nobody else."""

import base64
import contextlib
import hashlib
import hmac
import http.server
import json
import os
import queue
import signal
import ssl
import tempfile
import threading
import unittest

from certificates import Authority
from daemon import SOURCE, Daemon
from documents import SMALL_JOB, endless_job
from schema import faults

KEY = bytes(range(32))


class Receiver:
    """Takes webhooks on loopback and puts them into a queue; answers as it is told to, and then with 204."""

    def __init__(self, *answers, context=None):
        self.came = queue.Queue()
        self.answers = list(answers)
        self.may_answer = threading.Event()
        self.may_answer.set()
        receiver = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                receiver.came.put((self.path, dict(self.headers), body))
                receiver.may_answer.wait(60)
                status, headers = receiver.answers.pop(0) if receiver.answers else (204, {})
                with contextlib.suppress(OSError):  # Who asked may have been killed.
                    self.send_response(status)
                    for name, value in headers.items():
                        self.send_header(name, value)
                    self.end_headers()

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        if context:
            self.server.socket = context.wrap_socket(self.server.socket, server_side=True)
        self.scheme = "https" if context else "http"
        self.host = f"127.0.0.1:{self.server.server_port}"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def url(self, path="/hook?for=me"):
        return f"{self.scheme}://{self.host}{path}"

    def next(self, seconds=60):
        return self.came.get(timeout=seconds)

    def stop(self):
        self.may_answer.set()
        self.server.shutdown()
        self.server.server_close()


class WebhookTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tessera-e2e-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.secret = os.path.join(self.folder, "secret")
        self.write_secrets(KEY)
        with open(os.path.join(SOURCE, "proto", "openapi.json"), encoding="utf-8") as file:
            self.document = json.load(file)

    def write_secrets(self, *keys, mode=0o600):
        with open(self.secret, "w", encoding="ascii") as file:
            file.writelines(f"whsec_{base64.b64encode(key).decode()}\n" for key in keys)
        os.chmod(self.secret, mode)

    def receiver(self, *answers, context=None):
        receiver = Receiver(*answers, context=context)
        self.addCleanup(receiver.stop)
        return receiver

    def start(self, *hosts, private=True, data_dir=None, env=None, flags=()):
        allowed = [word for host in hosts for word in ("--webhook-host", host)]
        secret = ["--webhook-secret", self.secret] if hosts else []
        allow_private = ["--webhook-allow-private"] if private else []
        daemon = Daemon(*allowed, *secret, *allow_private, *flags, data_dir=data_dir, env=env)
        self.addCleanup(daemon.stop)
        return daemon

    def signature(self, headers, body, key=KEY):
        """As https://www.standardwebhooks.com says."""
        signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
        return "v1," + base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode()

    def webhook(self, daemon, job, *states):
        """How it stands, once it is in one of the states."""
        return daemon.wait_until(job, lambda status: status["webhook"]["state"] in states)["webhook"]

    def test_an_end_is_told_once_and_signed(self):
        receiver = self.receiver()
        daemon = self.start(receiver.host)
        job = daemon.submit({**SMALL_JOB, "webhook": receiver.url()})
        path, headers, body = receiver.next()
        self.assertEqual(path, "/hook?for=me")
        self.assertEqual(headers["Content-Type"], "application/json")
        self.assertEqual(headers["Host"], receiver.host)
        self.assertEqual(headers["webhook-signature"], self.signature(headers, body))
        message = json.loads(body)
        callback = self.document["paths"]["/v1/jobs"]["post"]["callbacks"]["jobEnded"]["{$request.body#/webhook}"]["post"]
        schema = callback["requestBody"]["content"]["application/json"]["schema"]
        self.assertEqual(faults(self.document, schema, message), [])
        self.assertEqual(message["type"], "job.completed")
        self.assertEqual(message["data"]["links"], {"job": f"/v1/jobs/{job}", "image": f"/v1/jobs/{job}/image"})
        told = self.webhook(daemon, job, "delivered")
        self.assertEqual(told, {"host": receiver.host, "state": "delivered", "attempts": 1, "error": ""})
        status = daemon.status(job)
        del status["webhook"]
        self.assertEqual(message["data"]["job"], status)
        self.assertTrue(receiver.came.empty())
        metrics = daemon.request("GET", "/metrics").body.decode()
        self.assertIn('tessera_webhook_attempts_total{outcome="delivered"} 1\n', metrics)
        self.assertIn("tessera_webhooks_pending 0\n", metrics)
        self.assertNotIn("for=me", daemon.log())
        self.assertNotIn("for=me", json.dumps(daemon.status(job)))

    def test_so_are_failures_and_cancels(self):
        receiver = self.receiver()
        daemon = self.start(receiver.host, flags=["--threads", "1"])
        job = daemon.submit({**endless_job(), "webhook": receiver.url()})
        self.assertEqual(daemon.status(job)["webhook"]["state"], "pending")
        self.assertEqual(daemon.request("POST", f"/v1/jobs/{job}/cancel").status, 202)
        _, _, body = receiver.next()
        self.assertEqual(json.loads(body)["type"], "job.canceled")

    def test_what_fails_is_tried_again_with_the_same_id(self):
        receiver = self.receiver((500, {"Retry-After": "1"}), (503, {"Retry-After": "1"}))
        daemon = self.start(receiver.host)
        job = daemon.submit({**SMALL_JOB, "webhook": receiver.url()})
        came = [receiver.next() for _ in range(3)]
        self.assertEqual(len({headers["webhook-id"] for _, headers, _ in came}), 1)
        self.assertEqual(len({body for _, _, body in came}), 1)
        for _, headers, body in came:
            self.assertEqual(headers["webhook-signature"], self.signature(headers, body))
        self.assertEqual(self.webhook(daemon, job, "delivered")["attempts"], 3)

    def test_who_is_gone_is_told_no_more_and_a_redirection_is_not_followed(self):
        receiver, other = self.receiver((410, {})), self.receiver()
        moved = self.receiver((307, {"Location": other.url(), "Retry-After": "3600"}))
        daemon = self.start(receiver.host, moved.host, other.host)
        job = daemon.submit({**SMALL_JOB, "webhook": receiver.url()})
        told = self.webhook(daemon, job, "failed")
        self.assertEqual((told["attempts"], told["error"]), (1, "it answered 410"))
        job = daemon.submit({**SMALL_JOB, "webhook": moved.url()})
        told = daemon.wait_until(job, lambda status: status["webhook"]["attempts"] == 1)["webhook"]
        self.assertEqual((told["state"], told["error"]), ("pending", "it answered 307"))
        self.assertTrue(other.came.empty())

    def test_a_killed_daemon_is_followed_by_one_that_delivers(self):
        receiver = self.receiver()
        receiver.may_answer.clear()
        data_dir = os.path.join(self.folder, "data")
        daemon = self.start(receiver.host, data_dir=data_dir)
        job = daemon.submit({**SMALL_JOB, "webhook": receiver.url()})
        _, first, _ = receiver.next()
        self.assertEqual(daemon.status(job)["webhook"]["state"], "pending")
        daemon.kill()
        receiver.may_answer.set()
        daemon = self.start(receiver.host, data_dir=data_dir)
        _, second, body = receiver.next()
        self.assertEqual(second["webhook-id"], first["webhook-id"])
        self.assertEqual(json.loads(body)["data"]["job"]["id"], job)
        self.assertEqual(self.webhook(daemon, job, "delivered")["attempts"], 1)
        daemon.stop()  # So that it is in the journal.
        daemon = self.start(receiver.host, data_dir=data_dir)
        self.assertEqual(daemon.status(job)["webhook"], {"host": receiver.host, "state": "delivered", "attempts": 1, "error": ""})
        self.assertTrue(receiver.came.empty())

    def test_what_was_not_delivered_waits_for_its_time_over_a_restart(self):
        receiver = self.receiver((503, {"Retry-After": "3600"}))
        data_dir = os.path.join(self.folder, "data")
        daemon = self.start(receiver.host, data_dir=data_dir)
        job = daemon.submit({**SMALL_JOB, "webhook": receiver.url()})
        daemon.wait_until(job, lambda status: status["webhook"]["attempts"] == 1)
        self.assertEqual(daemon.stop(), 0)
        daemon = self.start(receiver.host, data_dir=data_dir)
        told = daemon.status(job)["webhook"]
        self.assertEqual((told["state"], told["attempts"], told["error"]), ("pending", 1, "it answered 503"))
        # One that ends later is told before.
        later = daemon.submit({**SMALL_JOB, "webhook": receiver.url()})
        self.webhook(daemon, later, "delivered")
        self.assertEqual(daemon.status(job)["webhook"]["attempts"], 1)

    def test_a_receiver_that_does_not_answer_holds_up_neither_jobs_nor_others(self):
        slow, quick = self.receiver(), self.receiver()
        slow.may_answer.clear()
        daemon = self.start(slow.host, quick.host)
        for _ in range(20):
            daemon.wait_ended(daemon.submit({**SMALL_JOB, "webhook": slow.url()}))
        job = daemon.submit({**SMALL_JOB, "webhook": quick.url()})
        self.webhook(daemon, job, "delivered")
        self.assertEqual(daemon.stop(), 0)

    def test_a_job_that_is_deleted_is_told_to_nobody(self):
        receiver = self.receiver((503, {"Retry-After": "1"}), (503, {"Retry-After": "1"}))
        daemon = self.start(receiver.host)
        job, kept = (daemon.submit({**SMALL_JOB, "webhook": receiver.url()}) for _ in range(2))
        for each in (job, kept):
            daemon.wait_until(each, lambda status: status["webhook"]["attempts"] >= 1)
        self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{job}").status, 204)
        self.webhook(daemon, kept, "delivered")
        ids = [json.loads(receiver.next()[2])["data"]["job"]["id"] for _ in range(3)]
        self.assertEqual(sorted(ids), sorted([job, kept, kept]))
        daemon.wait_until(kept, lambda _: b"tessera_webhooks_pending 0\n" in daemon.request("GET", "/metrics").body)
        self.assertTrue(receiver.came.empty())

    def refusal(self, daemon, webhook, path="/v1/jobs"):
        reply = daemon.request("POST", path, {**SMALL_JOB, "webhook": webhook})
        self.assertEqual(reply.status, 422, reply.body)
        (error,) = reply.json()["errors"]
        self.assertEqual(error["pointer"], "/webhook")
        return error["detail"]

    def test_only_hosts_that_are_named_are_told(self):
        daemon = self.start("hooks.example.org", "*.example.net:8443", "127.0.0.1", private=False)
        self.assertIn("--webhook-host", self.refusal(daemon, "https://example.org/"))
        self.assertIn("--webhook-host", self.refusal(daemon, "https://hooks.example.org:444/"))
        self.assertIn("--webhook-host", self.refusal(daemon, "https://example.net:8443/"))
        self.assertIn("https://", self.refusal(daemon, "http://hooks.example.org/"))
        self.assertIn("user", self.refusal(daemon, "https://hooks.example.org@evil.example/"))
        self.assertIn("--webhook-allow-private", self.refusal(daemon, "https://127.0.0.1/"))
        self.assertIn("/v1/jobs", self.refusal(daemon, "https://hooks.example.org/", "/v1/render"))
        with Daemon() as closed:
            self.assertIn("none", self.refusal(closed, "https://hooks.example.org/"))
            self.assertNotIn("webhook", closed.status(closed.submit(SMALL_JOB)))

    def test_a_name_that_leads_to_this_machine_is_refused_when_it_is_looked_up(self):
        receiver = self.receiver()
        name = f"localhost:{receiver.server.server_port}"
        daemon = self.start(name, private=False)
        job = daemon.submit({**SMALL_JOB, "webhook": f"https://{name}/"})
        told = daemon.wait_until(job, lambda status: status["webhook"]["attempts"] == 1)["webhook"]
        self.assertIn("isn't an address of the internet", told["error"])
        self.assertTrue(receiver.came.empty())

    def test_receivers_by_tls_are_trusted_as_the_system_says(self):
        authority, stranger = Authority(self.folder), Authority(self.folder, "stranger")
        names = "DNS:localhost"
        receivers = []
        for issuer in (authority, stranger):
            certificate = issuer.issue(f"of-{os.path.basename(issuer.path)}", names=names)
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(certificate.path, certificate.key)
            receivers.append(self.receiver(context=context))
        trusted, untrusted = (f"localhost:{receiver.server.server_port}" for receiver in receivers)
        by_address = receivers[0].host
        daemon = self.start(trusted, untrusted, by_address, env={"SSL_CERT_FILE": authority.path})
        job = daemon.submit({**SMALL_JOB, "webhook": f"https://{trusted}/"})
        _, headers, body = receivers[0].next()
        self.assertEqual(headers["webhook-signature"], self.signature(headers, body))
        self.webhook(daemon, job, "delivered")
        for other in (untrusted, by_address):
            job = daemon.submit({**SMALL_JOB, "webhook": f"https://{other}/"})
            told = daemon.wait_until(job, lambda status: status["webhook"]["attempts"] == 1)["webhook"]
            self.assertIn("certificate isn't trusted", told["error"])
        self.assertTrue(all(receiver.came.empty() for receiver in receivers))

    def test_secrets_are_changed_by_a_reload(self):
        receiver = self.receiver()
        daemon = self.start(receiver.host)
        other = bytes(reversed(KEY))
        self.write_secrets(other, KEY)
        daemon.process.send_signal(signal.SIGHUP)
        daemon.count_in_log("other settings take a restart")
        daemon.submit({**SMALL_JOB, "webhook": receiver.url()})
        _, headers, body = receiver.next()
        expected = [self.signature(headers, body, key) for key in (other, KEY)]
        self.assertEqual(headers["webhook-signature"].split(" "), expected)
        self.write_secrets(KEY, mode=0o644)
        daemon.process.send_signal(signal.SIGHUP)
        self.assertGreater(daemon.count_in_log("the webhooks' secret stays as it is"), 0)

    def test_without_a_secret_that_is_one_it_does_not_start(self):
        with self.assertRaisesRegex(RuntimeError, "need one another"):
            Daemon("--webhook-host", "hooks.example.org")
        with self.assertRaisesRegex(RuntimeError, "need one another"):
            Daemon("--webhook-secret", self.secret)
        with self.assertRaisesRegex(RuntimeError, "no host for webhooks"):
            Daemon("--webhook-host", "https://hooks.example.org", "--webhook-secret", self.secret)
        self.write_secrets(KEY, mode=0o644)
        with self.assertRaisesRegex(RuntimeError, "every user of this machine"):
            Daemon("--webhook-host", "hooks.example.org", "--webhook-secret", self.secret)
        self.write_secrets(b"too short")
        with self.assertRaisesRegex(RuntimeError, "whsec_"):
            Daemon("--webhook-host", "hooks.example.org", "--webhook-secret", self.secret)


if __name__ == "__main__":
    unittest.main()
