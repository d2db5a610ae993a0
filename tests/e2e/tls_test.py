"""TLS: the same HTTP, and what comes before and around it."""

import concurrent.futures
import hashlib
import json
import os
import random
import shutil
import signal
import socket
import ssl
import subprocess
import tempfile
import threading
import time
import unittest

from certificates import Authority, openssl
from daemon import Daemon, bearer, make_key
from documents import SMALL_JOB, SPHERE, endless_job
from http_test import CASES, GET, responses

# That a handshake begins with: a record that says it will be 512 bytes.
HELLO = b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03"
CLOSED = (ConnectionResetError, BrokenPipeError, ssl.SSLError, ssl.SSLEOFError)


class Pipe:
    """TLS over a socket, with both ends of both in hand: Python's own sockets can't close one side of TLS, nor of TCP
    below it."""

    def __init__(self, daemon, context, name="localhost", session=None):
        self.socket = socket.create_connection((daemon.host, daemon.port), timeout=60)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.incoming, self.outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        self.tls = context.wrap_bio(self.incoming, self.outgoing, server_hostname=name, session=session)
        self.was_told_of_the_end = None  # Whether close_notify came before the end; None: it hasn't come.
        try:
            self.call(self.tls.do_handshake)
        except BaseException:
            self.socket.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def flush(self):
        if self.outgoing.pending:
            self.socket.sendall(self.outgoing.read())

    def call(self, function, *arguments):
        """Calls what may want more bytes from the other side."""
        while True:
            try:
                result = function(*arguments)
                self.flush()
                return result
            except ssl.SSLWantReadError:
                self.flush()
                if piece := self.socket.recv(65536):
                    self.incoming.write(piece)
                else:
                    self.incoming.write_eof()

    def send(self, data):
        self.call(self.tls.write, data)

    def finish(self):
        """Says that no more comes: close_notify, and the end of TCP's stream."""
        try:
            self.tls.unwrap()
        except ssl.SSLWantReadError:
            pass
        self.flush()
        self.socket.shutdown(socket.SHUT_WR)

    def break_off(self):
        """The end of TCP's stream without a word."""
        self.socket.shutdown(socket.SHUT_WR)

    def read(self):
        """Some bytes; none at the end."""
        try:
            piece = self.call(self.tls.read, 65536)
        except ssl.SSLEOFError:
            self.was_told_of_the_end = False
            return b""
        except ssl.SSLZeroReturnError:
            piece = b""
        if not piece:
            self.was_told_of_the_end = True
        return piece

    def read_all(self):
        answer = b""
        while piece := self.read():
            answer += piece
        return answer


def raw(daemon, sent, half_close=True):
    """What comes for bytes that aren't TLS, until the daemon ends the connection."""
    with socket.create_connection((daemon.host, daemon.port), timeout=60) as connection:
        answer = b""
        try:
            connection.sendall(sent)
            if half_close:
                connection.shutdown(socket.SHUT_WR)
            while piece := connection.recv(65536):
                answer += piece
        except OSError:
            pass
        return answer


def resident_bytes(process):
    with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
        (size,) = (int(line.split()[1]) << 10 for line in status if line.startswith("VmRSS:"))
    return size


@unittest.skipUnless(shutil.which("openssl"), "no openssl here")
class CertifiedTest(unittest.TestCase):
    """Has an authority, and a certificate of its for localhost."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tessera-tls-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.authority = Authority(cls.folder)
        cls.certificate = cls.authority.issue("localhost")


class TlsTest(CertifiedTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.context = cls.authority.context()
        cls.daemon = cls.start("--timeout", "2", "--host-name", "a,b", "--host-name", "a.b.c")
        cls.addClassCleanup(cls.daemon.stop)

    @classmethod
    def start(cls, *flags, certificate=None, **more):
        return Daemon(*(certificate or cls.certificate).flags, *flags, context=cls.authority.context(), **more)

    def tearDown(self):
        self.assertEqual(self.daemon.request("GET", "/livez").status, 200, self.daemon.log())

    def exchange(self, *pieces, end=Pipe.finish):
        with Pipe(self.daemon, self.context) as pipe:
            for piece in pieces:
                pipe.send(piece)
            end(pipe)
            return pipe.read_all(), pipe.was_told_of_the_end

    def test_it_says_where_it_listens(self):
        self.assertRegex(self.daemon.url, r"^https://127\.0\.0\.1:\d+$")

    def test_the_table_of_http(self):
        """Every case as over plain TCP. A client that breaks TCP off without close_notify gets its answers, too."""
        for index, (section, what, sent, *statuses) in enumerate(CASES):
            with self.subTest(f"{section}: {what}"):
                answer, told = self.exchange(sent, end=Pipe.break_off if index % 2 else Pipe.finish)
                self.assertTrue(told)
                found = responses(answer, head_at=(0,) if sent.startswith(b"HEAD") else ())
                allowed = [status if isinstance(status, tuple) else (status,) for status in statuses]
                self.assertEqual(len(found), len(allowed), found)
                for (status, _, body), expected in zip(found, allowed):
                    self.assertIn(status, expected, body)

    def test_versions_and_ciphers(self):
        for version in (ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3):
            context = self.authority.context()
            context.minimum_version = context.maximum_version = version
            with Pipe(self.daemon, context) as pipe:
                cipher, spoken, _ = pipe.tls.cipher()
                self.assertEqual(spoken, version.name.replace("_", "."))
                self.assertRegex(cipher, "GCM|CHACHA20")
                if version == ssl.TLSVersion.TLSv1_2:
                    self.assertRegex(cipher, "^ECDHE-")
        for weak in ({"maximum_version": ssl.TLSVersion.TLSv1_1, "minimum_version": ssl.TLSVersion.TLSv1}, "AES128-SHA"):
            context = self.authority.context()
            context.maximum_version = ssl.TLSVersion.TLSv1_2
            if isinstance(weak, str):
                context.set_ciphers(weak + ":@SECLEVEL=0")
            else:
                with self.assertWarns(DeprecationWarning):
                    for name, value in sorted(weak.items(), reverse=True):
                        setattr(context, name, value)
                context.set_ciphers("ALL:@SECLEVEL=0")
            with self.assertRaises(CLOSED, msg=weak):
                Pipe(self.daemon, context)

    def test_protocols_within(self):
        for offered, chosen in ((["http/1.1"], "http/1.1"), (["h2", "http/1.1"], "http/1.1"), (None, None)):
            context = self.authority.context()
            if offered:
                context.set_alpn_protocols(offered)
            with Pipe(self.daemon, context) as pipe:
                self.assertEqual(pipe.tls.selected_alpn_protocol(), chosen)
        context.set_alpn_protocols(["h2"])
        with self.assertRaisesRegex(ssl.SSLError, "(?i)no.application.protocol"):
            Pipe(self.daemon, context)

    def test_sessions_are_resumed(self):
        for version in (ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3):
            context = self.authority.context()
            context.maximum_version = version
            with Pipe(self.daemon, context) as pipe:
                pipe.send(GET + b"\r\n")
                pipe.read()
                session = pipe.tls.session
            with Pipe(self.daemon, context, session=session) as pipe:
                self.assertTrue(pipe.tls.session_reused)
                pipe.send(GET + b"\r\n")
                self.assertIn(b" 200 OK", pipe.read())

    def test_large_bodies_both_ways(self):
        data = random.Random(0).randbytes(40_000_000)
        name = hashlib.sha256(data).hexdigest()
        reply = self.daemon.request("PUT", f"/v1/blobs/sha256:{name}", data)
        self.assertEqual(reply.status, 201, reply.body)
        scene = json.dumps({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}] * 20_000}).encode()
        reply = self.daemon.request("POST", "/v1/scenes", scene, {"Content-Type": "application/json"})
        self.assertEqual(reply.status, 201, reply.body)
        path = self.large_image(self.daemon)
        image = self.daemon.request("GET", path).body
        self.assertEqual(len(image), int(self.daemon.request("HEAD", path).headers["Content-Length"]))
        again = self.daemon.request("GET", path).body
        self.assertEqual(hashlib.sha256(image).digest(), hashlib.sha256(again).digest())

    def large_image(self, daemon):
        """The path of an image of several megabytes: directions compress badly."""
        job = daemon.submit({"scene": SPHERE, "image": {"width": 1500, "height": 1500}, "settings": {"aovs": ["normal"]}})
        self.assertEqual(daemon.wait_ended(job)["state"], "completed")
        return f"/v1/jobs/{job}/image?format=exr&aov=normal&precision=float"

    def test_a_reader_that_stops_reading_goes_on_where_it_was(self):
        """What was begun is sent again from elsewhere in memory, when there is room: every byte once."""
        path = self.large_image(self.daemon)
        whole = self.daemon.request("GET", path)
        self.assertEqual(whole.status, 200)
        with Pipe(self.daemon, self.context) as pipe:
            pipe.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
            pipe.send(f"GET {path} HTTP/1.1\r\nHost: a\r\n\r\n".encode() * 2 + GET + b"Connection: close\r\n\r\n")
            pieces, read = [], 0
            while piece := pipe.read():
                pieces.append(piece)
                if read // (1 << 20) != (read := read + len(piece)) // (1 << 20):
                    time.sleep(0.01)
        self.assertTrue(pipe.was_told_of_the_end)
        answer = b"".join(pieces)
        for _ in range(2):
            head, _, answer = answer.partition(b"\r\n\r\n")
            self.assertRegex(head, b"^HTTP/1.1 200 ")
            self.assertTrue(answer.startswith(whole.body), (len(answer), len(whole.body)))
            answer = answer[len(whole.body) :]
        self.assertEqual([each[0] for each in responses(answer)], [200])

    def test_keep_alive_and_pipelining(self):
        with Pipe(self.daemon, self.context) as pipe:
            for _ in range(3):
                pipe.send(GET + b"\r\n")
                self.assertEqual([each[0] for each in responses(pipe.read())], [200])
            pipe.send((GET + b"\r\n") * 100)
            pipe.finish()
            self.assertEqual([each[0] for each in responses(pipe.read_all())], [200] * 100)
            self.assertTrue(pipe.was_told_of_the_end)

    def test_a_request_in_records_of_one_byte(self):
        with Pipe(self.daemon, self.context) as pipe:
            for byte in GET + b"\r\n":
                pipe.send(bytes([byte]))
            self.assertEqual([each[0] for each in responses(pipe.read())], [200])

    def test_who_says_no_more_and_waits_is_answered(self):
        """A client that has closed its side of TCP still listens, and hears so; one that has gone lets its job end."""
        job = {**SMALL_JOB, "settings": {"samples": 64}, "image": {"width": 600, "height": 600}}
        body = json.dumps(job).encode()
        head = b"POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n"
        answer, told = self.exchange(head % len(body) + body)
        self.assertTrue(told)
        self.assertEqual([each[0] for each in responses(answer)], [200])
        body = json.dumps(endless_job()).encode()
        with Pipe(self.daemon, self.context) as pipe:
            pipe.send(head % len(body) + body)
            deadline = time.monotonic() + 60
            while not self.unfinished() and time.monotonic() < deadline:
                time.sleep(0.01)
            self.assertEqual(self.unfinished(), 1)
        while self.unfinished() and time.monotonic() < deadline:
            time.sleep(0.01)
        self.assertEqual(self.unfinished(), 0)

    def unfinished(self):
        return self.daemon.request("GET", "/readyz").json()["checks"]["queue"]["unfinished_jobs"]

    def test_plain_http_is_told_what_is_missing(self):
        for sent in (GET + b"\r\n", b"POST /v1/jobs HTTP/1.1\r\nHost: a\r\nContent-Length: 3\r\n\r\n{}\n",
                     b"DELETE /v1/jobs/x HTTP/1.0\r\n\r\n", (GET + b"\r\n") * 3):
            ((status, headers, body),) = responses(raw(self.daemon, sent))
            self.assertEqual((status, headers["Connection"]), (400, "close"), sent)
            self.assertIn("https://", json.loads(body)["detail"])
        self.assertEqual(responses(raw(self.daemon, b"GET /livez"))[0][0], 400)
        self.assertEqual(responses(raw(self.daemon, b"GET /livez", half_close=False))[0][0], 408)
        # Keys that are shown so let nobody in.
        sent = b"GET /v1/jobs HTTP/1.1\r\nHost: a\r\nAuthorization: Bearer x\r\n\r\n"
        self.assertEqual(responses(raw(self.daemon, sent))[0][0], 400)

    def test_what_is_no_tls_is_cut(self):
        rng = random.Random(1)
        for sent in (b"", b"\x16", HELLO, HELLO + rng.randbytes(507), b"\xff" + rng.randbytes(100), b"\x00" * 50_000,
                     b"\x16\x03\x01\xff\xff" + b"\x01" * 65535, b"\x80\x2e\x01\x00\x02" + b"\x00" * 44, b"ssh\r\n",
                     b"\x15\x03\x01\x00\x02\x01\x00", b"\x17\x03\x03\x00\x10" + b"\x00" * 16):
            answer = raw(self.daemon, sent)
            self.assertIn(answer[:1], (b"", b"\x15"), sent[:20])  # Nothing, or an alert.

    def test_every_byte_of_a_handshake_changed(self):
        """The first flight of a real client, damaged: the daemon lives, and answers nothing."""
        incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        with self.assertRaises(ssl.SSLWantReadError):
            self.context.wrap_bio(incoming, outgoing, server_hostname="localhost").do_handshake()
        hello = outgoing.read()
        for at in range(0, len(hello), 5):
            damaged = bytearray(hello)
            damaged[at] ^= 0x55
            self.assertNotIn(b"HTTP/1.1 2", raw(self.daemon, bytes(damaged)))

    def test_new_keys_in_the_middle(self):
        """A record without anything for HTTP in it isn't waited behind (RFC 8446, 4.6.3)."""
        with self.start("--access-log") as daemon:
            command = ["openssl", "s_client", "-connect", f"{daemon.host}:{daemon.port}", "-CAfile", self.authority.path]
            with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.PIPE) as client:
                said = ""
                for count, key in enumerate(("K", "k", "K"), 1):  # With news of keys asked for in return, and without.
                    client.stdin.write(f"{key}\n".encode())
                    client.stdin.flush()
                    while said.count("KEYUPDATE") < count and (piece := os.read(client.stderr.fileno(), 65536)):
                        said += piece.decode()
                    client.stdin.write(GET + b"\r\n")
                    client.stdin.flush()
                    self.assertEqual(daemon.count_in_log("path=/livez", count), count, said)
                client.kill()

    def test_a_broken_record_ends_the_connection(self):
        with Pipe(self.daemon, self.context) as pipe:
            pipe.send(GET + b"\r\n")
            self.assertIn(b" 200 OK", pipe.read())
            pipe.socket.sendall(b"\x17\x03\x03\x00\x20" + b"\x00" * 32)
            with self.assertRaises(CLOSED):
                while pipe.read():
                    pass

    def test_slow_handshakes_are_cut(self):
        """All of handshake and header have the time that a header has."""
        start = time.monotonic()
        silent = [socket.create_connection((self.daemon.host, self.daemon.port), timeout=60) for _ in range(3)]
        silent[1].sendall(HELLO)
        stop = threading.Event()

        def dribble():  # A byte now and then keeps nothing alive.
            while not stop.wait(0.2):
                try:
                    silent[2].sendall(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03"[:1])
                except OSError:
                    return

        thread = threading.Thread(target=dribble)
        thread.start()
        try:
            with Pipe(self.daemon, self.context) as shaken:
                self.assertEqual(shaken.read_all(), b"")
            for connection in silent:
                try:
                    self.assertIn(connection.recv(100)[:1], (b"", b"\x15"))
                except ConnectionResetError:
                    pass
        finally:
            stop.set()
            thread.join()
            for connection in silent:
                connection.close()
        self.assertGreater(time.monotonic() - start, 1.9)

    def test_close_notify_comes_before_the_end(self):
        for sent in (GET + b"Connection: close\r\n\r\n", b"GET /livez\r\n\r\n", GET):
            answer, told = self.exchange(sent, end=lambda pipe: None)
            self.assertEqual(len(responses(answer)), 1)
            self.assertTrue(told, sent)

    def test_many_connections(self):
        """500 at once, none of which keeps much; all are served."""
        count = 500
        with self.start("--max-connections", "600", "--timeout", "60") as daemon:
            daemon.request("GET", "/livez")
            with concurrent.futures.ThreadPoolExecutor(8) as pool:
                before = resident_bytes(daemon.process)
                pipes = list(pool.map(lambda _: Pipe(daemon, self.context), range(count)))
                try:
                    for pipe in pipes:
                        pipe.send(b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    for pipe in pipes:
                        self.assertRegex(pipe.read(), rb"^HTTP/1.1 200 ")
                    grown = resident_bytes(daemon.process) - before
                    if "asan" not in os.environ["TESSERAD"] and "tsan" not in os.environ["TESSERAD"]:
                        self.assertLess(grown / count, 100_000)
                finally:
                    for pipe in pipes:
                        pipe.socket.close()
            self.assertEqual(daemon.request("GET", "/livez").status, 200)

    def test_keys(self):
        data_dir = os.path.join(self.folder, "keys")
        key = make_key(data_dir)
        with self.start("--host", "0.0.0.0", data_dir=data_dir) as daemon:
            daemon.host = "127.0.0.1"
            self.assertEqual(daemon.request("GET", "/v1/jobs").status, 401)
            self.assertEqual(daemon.request("GET", "/v1/jobs", headers=bearer(key)).status, 200)
        refused = subprocess.run([os.environ["TESSERAD"], "--port", "0", "--data-dir", os.path.join(self.folder, "none"),
                                  "--host", "0.0.0.0", *self.certificate.flags], capture_output=True, text=True, check=False)
        self.assertEqual(refused.returncode, 1)  # TLS keeps nobody out.
        self.assertIn("there are no keys", refused.stderr)


class ClientTest(CertifiedTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.daemon = Daemon(*cls.certificate.flags, context=cls.authority.context())
        cls.addClassCleanup(cls.daemon.stop)

    def run_client(self, *arguments, url=None, ca=True, status=0, env=None):
        command = [os.environ["TESSERA"], "--server", url or self.daemon.url]
        command += ["--ca-file", self.authority.path] if ca is True else ["--ca-file", ca] if ca else []
        clean = {k: v for k, v in os.environ.items() if not k.startswith("TESSERA_") and k != "SSL_CERT_FILE"}
        done = subprocess.run([*command, *arguments], capture_output=True, check=False, timeout=120,
                              env={**clean, **(env or {})})
        self.assertEqual(done.returncode, status, done.stderr)
        return done.stdout if status == 0 else done.stderr.decode()

    def test_it_renders(self):
        scene = os.path.join(self.folder, "scene.json")
        with open(scene, "w", encoding="ascii") as file:
            json.dump(SPHERE, file)
        image = self.run_client("render", scene, "-o", "-", "--size", "40x30")
        self.assertTrue(image.startswith(b"\x89PNG"))
        self.assertTrue(self.run_client("list", env={"TESSERA_CA_FILE": self.authority.path}, ca=False) is not None)
        # Whom the system trusts: OpenSSL lets the environment say who that is.
        self.run_client("list", env={"SSL_CERT_FILE": self.authority.path}, ca=False)
        self.run_client("list", url=f"https://localhost:{self.daemon.port}")

    def test_it_uploads_large_files(self):
        path = os.path.join(self.folder, "many.ply")
        with open(path, "w", encoding="ascii") as file:
            file.write("ply\nformat ascii 1.0\nelement vertex 60000\nproperty float x\nproperty float y\nproperty float z\n"
                       "element face 20000\nproperty list uchar int vertex_indices\nend_header\n")
            file.writelines(f"{i % 100 + 0.123456} {i // 100 + 0.654321} {(i * i) % 17}\n" for i in range(60000))
            file.writelines(f"3 {3 * i} {3 * i + 1} {3 * i + 2}\n" for i in range(20000))
        self.assertGreater(os.path.getsize(path), 1 << 20)
        image = self.run_client("render", path, "-o", "-", "--size", "40x30", "--spp", "1")
        self.assertTrue(image.startswith(b"\x89PNG"))

    def test_whom_it_doesnt_trust(self):
        said = self.run_client("list", ca=False, status=4)
        self.assertIn("nobody who is trusted here vouches", said)
        self.assertIn("--ca-file", said)
        stranger = Authority(self.folder, "stranger")
        self.assertIn("nobody who is trusted here vouches", self.run_client("list", ca=stranger.path, status=4))
        for missing in ("/nowhere", self.authority.key):
            self.assertIn(missing, self.run_client("list", ca=missing, status=5))
        for days, names, words in ((30, "DNS:elsewhere.example", "is for another name"),
                                   (30, "DNS:127.0.0.1", "is for another name"),  # A name isn't an address.
                                   (-1, "IP:127.0.0.1", "has expired")):
            certificate = self.authority.issue("other", days=days, names=names)
            with Daemon(*certificate.flags) as daemon:
                self.assertIn(words, self.run_client("list", url=daemon.url, status=4))
        said = self.run_client("--json", "list", ca=False, status=4)
        self.assertEqual(json.loads(said)["error"]["kind"], "unreachable")

    def test_the_wrong_scheme(self):
        self.assertIn("https://", self.run_client("list", url=self.daemon.url.replace("https", "http"), status=3))
        with Daemon() as plain:
            self.assertIn("is it http://", self.run_client("list", url=plain.url.replace("http", "https"), status=4))

    def doctor(self, *arguments, daemon=None, status=0):
        said = subprocess.run([os.environ["TESSERA"], "--server", (daemon or self.daemon).url, "--ca-file",
                               self.authority.path, "--json", "doctor", *arguments], capture_output=True, text=True,
                              check=False, timeout=120)
        self.assertEqual(said.returncode, status, said.stdout + said.stderr)
        return {each["check"]: (each["verdict"], each["detail"]) for each in json.loads(said.stdout)["findings"]}

    def test_doctor(self):
        found = self.doctor(*self.certificate.flags)
        self.assertEqual((found["certificate"][0], found["certificate files"][0]), ("ok", "ok"))
        self.assertNotIn("certificate in force", found)
        self.assertNotIn("certificate key", found)

        soon, gone = self.authority.issue("soon", days=5), self.authority.issue("gone", days=-1)
        with Daemon(*soon.flags) as daemon:
            found = self.doctor(daemon=daemon)
            self.assertEqual(found["certificate"][0], "warn")
            self.assertIn(": 4 days", found["certificate"][1])
            found = self.doctor(*self.certificate.flags, daemon=daemon)  # Renewed, and not read yet.
            self.assertEqual((found["certificate files"][0], found["certificate in force"][0]), ("ok", "warn"))
        with Daemon(*gone.flags) as daemon:
            self.assertIn("expired", self.doctor(daemon=daemon, status=1)["server"][1])
        self.assertEqual(self.doctor(*gone.flags, status=1)["certificate files"][0], "FAIL")
        said = self.doctor("--tls-certificate", self.certificate.path, "--tls-key", soon.key, status=1)
        self.assertIn("isn't that of the certificate", said["certificate files"][1])
        os.chmod(soon.key, 0o644)
        self.assertEqual(self.doctor(*soon.flags)["certificate key"][0], "warn")
        self.run_client("doctor", "--tls-key", soon.key, status=2)


@unittest.skipUnless(shutil.which("openssl"), "no openssl here")
class CertificateTest(unittest.TestCase):
    """Files at the start and on SIGHUP."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="tessera-tls-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.authority = Authority(self.folder)

    def refuse(self, *flags):
        """Why a daemon doesn't start."""
        done = subprocess.run([os.environ["TESSERAD"], "--port", "0", "--data-dir", os.path.join(self.folder, "data"), *flags],
                              capture_output=True, text=True, check=False, timeout=60)
        self.assertNotEqual(done.returncode, 0)
        self.assertNotIn("listening", done.stdout)
        return done.stderr

    def test_what_it_cant_start_with(self):
        good, other = self.authority.issue("good"), self.authority.issue("other")
        empty, locked = os.path.join(self.folder, "empty"), os.path.join(self.folder, "locked")
        with open(empty, "wb"):
            pass
        openssl("pkey", "-in", good.key, "-aes128", "-passout", "pass:secret", "-out", locked)
        self.assertIn("--tls-key", self.refuse("--tls-certificate", good.path))
        self.assertIn("--tls-certificate", self.refuse("--tls-key", good.key))
        for certificate, key, why in ((good.path, other.key, "isn't that of the certificate"),
                                      (empty, good.key, "holds no certificate"), (good.path, empty, "holds no private key"),
                                      (good.key, good.key, "holds no certificate"), (good.path, locked, "is encrypted"),
                                      ("/nowhere", good.key, "No such file"), (good.path, "/nowhere", "No such file")):
            said = self.refuse("--tls-certificate", certificate, "--tls-key", key)
            self.assertIn(why, said)
            self.assertTrue(certificate in said or key in said, said)

    def test_what_is_said_of_them(self):
        for days, words in ((30, "is valid until"), (5, "expires soon"), (-1, "has expired")):
            certificate = self.authority.issue("named", days=days)
            with Daemon(*certificate.flags, context=self.authority.context()) as daemon:
                self.assertEqual(daemon.count_in_log(words), 1, daemon.log())
                self.assertEqual(daemon.count_in_log("threads render"), 1)  # Said after all that is said of them.
                self.assertNotIn("can read the key", daemon.log())
        os.chmod(certificate.key, 0o644)
        with Daemon(*certificate.flags) as daemon:
            words = f"warning every user of this machine can read the key {certificate.key}"
            self.assertEqual(daemon.count_in_log(words), 1, daemon.log())

    def test_a_whole_chain_is_sent(self):
        """Clients know the root alone."""
        between = Authority(self.folder, "between")
        request = os.path.join(self.folder, "between.csr")
        extensions = os.path.join(self.folder, "between.ext")
        with open(extensions, "w", encoding="ascii") as file:
            file.write("basicConstraints=critical,CA:true\n")
        openssl("req", "-new", "-key", between.key, "-subj", "/CN=between", "-out", request)
        openssl("x509", "-req", "-in", request, "-CA", self.authority.path, "-CAkey", self.authority.key, "-days", "3",
                "-extfile", extensions, "-out", between.path)
        leaf = between.issue("leaf")
        with open(between.path, encoding="ascii") as file, open(leaf.path, "a", encoding="ascii") as chain:
            chain.write(file.read())
        with Daemon(*leaf.flags, context=self.authority.context()) as daemon:
            self.assertEqual(daemon.request("GET", "/livez").status, 200)
            self.assertEqual(daemon.count_in_log("expires soon"), 1)  # What vouches for it does.

    def test_reload(self):
        """SIGHUP puts new files in force for new connections; those that make no sense leave the old in force."""
        current, renewed = self.authority.issue("current"), self.authority.issue("renewed")
        stranger = self.authority.issue("stranger")
        with Daemon(*current.flags, context=self.authority.context()) as daemon:
            self.assertEqual(self.name_of(daemon), "current")
            old = daemon.connect()
            old.request("GET", "/livez")
            old.getresponse().read()
            current.replace_by(renewed)
            self.hang_up(daemon, "is valid until", 2)
            self.assertEqual(self.name_of(daemon), "renewed")
            old.request("GET", "/livez")  # What was there before goes on.
            self.assertEqual(old.getresponse().status, 200)
            old.close()

            broken = (lambda: shutil.copy(stranger.key, current.key), lambda: os.truncate(current.path, 0),
                      lambda: os.remove(current.path))
            for count, damage in enumerate(broken, 1):
                damage()
                self.hang_up(daemon, "the certificate stays as it is", count)
                self.assertEqual(self.name_of(daemon), "renewed")
            current.replace_by(stranger)
            self.hang_up(daemon, "is valid until", 3)
            self.assertEqual(self.name_of(daemon), "stranger")

    def test_reload_while_many_connect(self):
        current, other = self.authority.issue("current"), self.authority.issue("other")
        with Daemon(*current.flags, context=self.authority.context()) as daemon:
            stop = threading.Event()

            def ask():
                count = 0
                while not stop.is_set():
                    assert daemon.request("GET", "/livez").status == 200
                    count += 1
                return count

            with concurrent.futures.ThreadPoolExecutor(3) as pool:
                askers = [pool.submit(ask) for _ in range(3)]
                for count in range(2, 22):
                    shutil.copy((current, other)[count % 2].path, current.path + ".swap")
                    self.hang_up(daemon, "is valid until", count)
                stop.set()
                for asker in askers:
                    self.assertGreater(asker.result(), 0)

    def hang_up(self, daemon, words, count):
        daemon.process.send_signal(signal.SIGHUP)
        self.assertEqual(daemon.count_in_log(words, count), count, daemon.log())

    def name_of(self, daemon):
        """The name in the certificate that a new connection is shown."""
        with Pipe(daemon, self.authority.context()) as pipe:
            (name,) = (value for ((key, value),) in pipe.tls.getpeercert()["subject"] if key == "commonName")
            return name


if __name__ == "__main__":
    unittest.main()
