"""nginx with a static file, as the yardstick for answers from memory."""

import pathlib
import socket
import subprocess
import tempfile
import time

from tools.outcome import expect, need

_CONFIGURATION = """
daemon off;
user root;
worker_processes {workers};
pid {folder}/pid;
error_log {folder}/errors;
events {{ worker_connections 4096; }}
http {{
  access_log off;
  sendfile on;
  tcp_nopush on;
  keepalive_requests 1000000000;
  open_file_cache max=10;
  default_type application/json;
  {temporary}
  server {{
    listen 127.0.0.1:{port} reuseport;
    root {folder}/files;
  }}
}}
"""


def _free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Nginx:
    """Serves `body` at `url` with so many workers while a `with` lasts."""

    def __init__(self, body, workers):
        (self._program,) = need("nginx")
        self._body, self._workers = body, workers

    def __enter__(self):
        self._folder = tempfile.TemporaryDirectory(prefix="tessera-nginx-")
        folder = pathlib.Path(self._folder.name)
        (folder / "files").mkdir()
        (folder / "files" / "status").write_bytes(self._body)
        port = _free_port()
        kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
        temporary = " ".join(f"{kind}_temp_path {folder}/{kind};" for kind in kinds)
        configuration = _CONFIGURATION.format(folder=folder, port=port, workers=self._workers, temporary=temporary)
        (folder / "nginx.conf").write_text(configuration)
        self._process = subprocess.Popen([self._program, "-p", folder, "-c", folder / "nginx.conf"])
        self.url = f"http://127.0.0.1:{port}/status"
        deadline = time.monotonic() + 20
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), timeout=20).close()
                return self
            except OSError:
                expect(self._process.poll() is None and time.monotonic() < deadline, "nginx doesn't start")
                time.sleep(0.01)

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait(timeout=60)
        self._folder.cleanup()
