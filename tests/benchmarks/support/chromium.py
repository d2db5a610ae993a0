"""model-viewer in a headless Chromium: a page that loads a model and sends back its picture, as web shops make
thumbnails. Chromium is told what to do through its debugging pipe, and is kept running."""

import fcntl
import http.server
import json
import os
import pathlib
import queue
import shutil
import subprocess
import tempfile
import threading
import urllib.parse

MODEL_VIEWER = "@google/model-viewer@4.4.0"

# GL in software, as on a server without a graphics card. Pages are never taken for hidden ones, which draw nothing.
FLAGS = [
    "--headless=new", "--remote-debugging-pipe", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--force-device-scale-factor=1", "--hide-scrollbars", "--mute-audio", "--no-first-run", "--disable-extensions",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--disable-background-timer-throttling", "--disable-renderer-backgrounding",
    "--disable-backgrounding-occluded-windows",
]

# A model that is lit, shadowed and toned as the daemon's default look is, seen from the same side, at full resolution.
PAGE = """<!doctype html>
<style>body { margin: 0; background: white } model-viewer { width: SIDEpx; height: SIDEpx }</style>
<script type="module">
  const fail = (why) => fetch("/failed?" + location.search.slice(1), {method: "POST", body: why});
  addEventListener("error", (event) => fail(event.message));
  const {ModelViewerElement} = await import("/model-viewer.min.js");
  ModelViewerElement.minimumRenderScale = 1;
  const query = new URLSearchParams(location.search);
  const viewer = new ModelViewerElement();
  viewer.addEventListener("error", (event) => fail(String(event.detail?.sourceError ?? event.detail?.type)));
  viewer.addEventListener("load", async () => {
    const frame = () => new Promise(requestAnimationFrame);
    await frame();
    await frame();
    const blob = await viewer.toBlob({mimeType: "image/png"});
    await fetch("/picture?" + query, {method: "POST", body: blob});
  });
  for (const [name, value] of Object.entries({
    "loading": "eager", "reveal": "auto", "interaction-prompt": "none", "shadow-intensity": "1",
    "environment-image": "neutral", "tone-mapping": "neutral", "field-of-view": "30deg",
    "camera-orbit": query.get("azimuth") + "deg 70deg auto", "src": "/model.glb?" + query.get("model")}))
    viewer.setAttribute(name, value);
  document.body.append(viewer);
</script>
"""


def install_model_viewer(folder):
    """The script of model-viewer, installed by npm into `folder`; or nothing, and why."""
    script = pathlib.Path(folder, "node_modules/@google/model-viewer/dist/model-viewer.min.js")
    if script.exists():
        return script, ""
    if not shutil.which("npm"):
        return None, "npm is missing (deploy/install-deps --bench brings it)"
    os.makedirs(folder, exist_ok=True)
    command = ["npm", "install", "--ignore-scripts", "--no-audit", "--no-fund", "--prefix", folder, MODEL_VIEWER]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == 0 and script.exists():
        return script, ""
    return None, f"npm can't install {MODEL_VIEWER}: {' '.join(done.stderr.split())[-200:]}"


class _Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_GET(self):
        path = urllib.parse.urlsplit(self.path).path
        media_type, body = self.server.files.get(path, ("text/plain", None))
        self.send_response(404 if body is None else 200)
        body = body or b""
        self.send_header("Content-Type", media_type)
        self.send_header("Content-Length", str(len(body)))
        # Of the model each query is a file of its own, which may be kept like the script.
        self.send_header("Cache-Control", "max-age=3600")
        self.end_headers()
        self.wfile.write(body)

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.answers.put((urllib.parse.urlsplit(self.path).path, body))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_):
        pass


class Chromium:
    """One browser and the server of its pages. Use it in a `with`."""

    def __init__(self, script, side):
        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), _Handler)
        self._server.answers = queue.Queue()
        self._server.files = {
            "/": ("text/html", PAGE.replace("SIDE", str(side)).encode()),
            "/model-viewer.min.js": ("text/javascript", pathlib.Path(script).read_bytes()),
        }
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        self._folder = tempfile.mkdtemp(prefix="tessera-bench-chromium-")
        flags = [*FLAGS, f"--window-size={side},{side}", f"--user-data-dir={self._folder}"]
        if os.geteuid() == 0:
            flags.append("--no-sandbox")
        commands, self._to = os.pipe()
        self._from, events = os.pipe()
        # Chromium reads from descriptor 3 and writes to 4, which may be in use here.
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in (commands, events)]
        launcher = f'exec chromium "$@" 3<&{ends[0]} 4>&{ends[1]} {ends[0]}<&- {ends[1]}>&-'
        self.process = subprocess.Popen(
            ["bash", "-c", launcher, "chromium", *flags, "about:blank"],
            pass_fds=ends, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        for end in (commands, events, *ends):
            os.close(end)
        self._buffer = b""
        self._calls = 0
        self.version = self._call("Browser.getVersion")["product"]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self._call("Browser.close")
            self.process.wait(timeout=10)
        except (OSError, RuntimeError, subprocess.TimeoutExpired):
            self.process.kill()
            self.process.wait()
        os.close(self._to)
        os.close(self._from)
        self._server.shutdown()
        self._server.server_close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def picture(self, glb, name, azimuth):
        """The PNG of a model in a page of its own. Of models with one name the browser may keep what it has read."""
        self._server.files["/model.glb"] = ("model/gltf-binary", glb)
        address = f"http://127.0.0.1:{self._server.server_address[1]}/?model={name}&azimuth={azimuth}"
        page = self._call("Target.createTarget", url=address)["targetId"]
        try:
            path, body = self._server.answers.get(timeout=300)
        except queue.Empty:
            raise RuntimeError("Chromium has sent no picture for five minutes") from None
        finally:
            self._call("Target.closeTarget", targetId=page)
        if path != "/picture":
            raise RuntimeError(f"model-viewer failed: {body.decode(errors='replace')}")
        return body

    def _call(self, method, **parameters):
        self._calls += 1
        command = json.dumps({"id": self._calls, "method": method, "params": parameters}).encode() + b"\0"
        os.write(self._to, command)
        while True:
            message = self._message()
            if message.get("id") == self._calls:
                if "error" in message:
                    raise RuntimeError(f"Chromium refuses {method}: {message['error']}")
                return message["result"]

    def _message(self):
        while b"\0" not in self._buffer:
            read = os.read(self._from, 1 << 16)
            if not read:
                raise RuntimeError("Chromium has ended")
            self._buffer += read
        text, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(text)
