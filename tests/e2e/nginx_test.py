"""deploy/nginx.conf, as nginx has it: TLS in front of a daemon."""

import http.client
import json
import os
import shutil
import socket
import ssl
import subprocess
import tempfile
import time
import unittest

from daemon import SOURCE, Daemon, Reply, bearer, make_key
from documents import SMALL_JOB

NAME = "render.example.org"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class NginxTest(unittest.TestCase):
    def setUp(self):
        self.nginx = shutil.which("nginx", path=os.environ["PATH"] + ":/usr/sbin")
        if not self.nginx or not shutil.which("openssl"):
            self.skipTest("no nginx or no openssl here")
        self.folder = tempfile.mkdtemp(prefix="tessera-nginx-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.certificate, self.key = os.path.join(self.folder, "cert.pem"), os.path.join(self.folder, "cert.key")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", f"/CN={NAME}",
                        "-addext", f"subjectAltName=DNS:{NAME}", "-keyout", self.key, "-out", self.certificate],
                       capture_output=True, check=True)

    def configuration(self, replacements):
        """The example with ports and files of this test, in what nginx takes; its path."""
        with open(os.path.join(SOURCE, "deploy", "nginx.conf"), encoding="utf-8") as file:
            site = file.read()
        for old, new in replacements:
            self.assertIn(old, site)
            site = site.replace(old, new)
        lines = ["daemon off;", f"pid {self.folder}/pid;", f"error_log {self.folder}/errors;", "events {}", "http {",
                 f"access_log {self.folder}/access;"]
        lines += [f"{kind}_temp_path {self.folder}/{kind};" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")]
        path = os.path.join(self.folder, "nginx.conf")
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n".join([*lines, site, "}"]))
        return path

    def certificates(self):
        return [("/etc/ssl/render.example.org.pem", self.certificate), ("/etc/ssl/private/render.example.org.key", self.key)]

    def run_test_of(self, path):
        return subprocess.run([self.nginx, "-t", "-p", self.folder, "-c", path], capture_output=True, text=True,
                              check=False)

    def test_nginx_takes_it(self):
        listening = [("listen 443", f"listen {free_port()}"), ("listen [::]:443 ssl;", ""),
                     ("listen 80;", f"listen {free_port()};"), ("listen [::]:80;", "")]
        done = self.run_test_of(self.configuration(self.certificates() + listening))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("[warn]", done.stderr)

    def test_a_daemon_behind_it(self):
        data_dir = os.path.join(self.folder, "data")
        key = make_key(data_dir)
        with Daemon("--host-name", NAME, "--require-keys", data_dir=data_dir) as daemon:
            port, plain = free_port(), free_port()
            path = self.configuration(self.certificates() + [
                ("127.0.0.1:8080", f"127.0.0.1:{daemon.port}"), ("listen 443 ssl", f"listen 127.0.0.1:{port} ssl"),
                ("listen [::]:443 ssl;", ""), ("listen 80;", f"listen 127.0.0.1:{plain};"), ("listen [::]:80;", "")])
            server = subprocess.Popen([self.nginx, "-p", self.folder, "-c", path], stderr=subprocess.PIPE)
            try:
                self.wait_for(port, server)
                self.assertEqual(self.request(port, "GET", "/v1/jobs").status, 401)
                reply = self.request(port, "POST", "/v1/jobs", SMALL_JOB, bearer(key))
                self.assertEqual(reply.status, 201)
                page = {"Origin": f"https://{NAME}:{port}", "Sec-Fetch-Site": "same-origin"}
                self.assertEqual(self.request(port, "POST", "/v1/jobs", SMALL_JOB, {**bearer(key), **page}).status, 201)
                page = {"Origin": "https://evil.example", "Sec-Fetch-Site": "cross-site"}
                self.assertEqual(self.request(port, "POST", "/v1/jobs", SMALL_JOB, {**bearer(key), **page}).status, 403)
                connection = http.client.HTTPConnection("127.0.0.1", plain, timeout=60)
                connection.request("GET", "/v1/jobs", headers={"Host": NAME})
                self.assertEqual(connection.getresponse().headers["Location"], f"https://{NAME}/v1/jobs")
                connection.close()
            finally:
                server.terminate()
                server.wait(timeout=60)
                server.stderr.close()

    def wait_for(self, port, server):
        deadline = time.monotonic() + 60
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), timeout=60).close()
                return
            except OSError:
                self.assertIsNone(server.poll(), server.stderr)
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.01)

    def request(self, port, method, path, body=None, headers=None):
        """One request over TLS, with the certificate's name looked at."""
        context = ssl.create_default_context(cafile=self.certificate)
        with socket.create_connection(("127.0.0.1", port), timeout=60) as plain:
            with context.wrap_socket(plain, server_hostname=NAME) as secure:
                connection = http.client.HTTPConnection(NAME, port, timeout=60)
                connection.sock = secure
                headers = {"Content-Type": "application/json", **(headers or {})}
                connection.request(method, path, json.dumps(body) if body else None, headers)
                return Reply(connection.getresponse())


if __name__ == "__main__":
    unittest.main()
