"""What `cmake --install` leaves works by itself, and OpenImageIO is there when it is needed, and only then."""

import hashlib
import os
import subprocess
import tempfile
import unittest

from daemon import Daemon

SPHERE = {
    "lights": [{"type": "ambient", "radiance": [1, 1, 1]}],
    "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
}
SIGNATURES = {"png": b"\x89PNG", "jpeg": b"\xff\xd8\xff", "exr": b"\x76\x2f\x31\x01", "hdr": b"#?RADIANCE"}


class InstallTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.prefix = folder.name
        subprocess.run(
            ["cmake", "--install", os.environ["TESSERA_BUILD"], "--prefix", self.prefix], check=True, capture_output=True
        )

    def start(self):
        """The installed daemon with an ended job."""
        daemon = Daemon(program=os.path.join(self.prefix, "bin", "tesserad"))
        self.addCleanup(daemon.stop)
        job = daemon.submit({"scene": SPHERE, "image": {"width": 8, "height": 8}})
        daemon.wait_ended(job)
        return daemon, lambda image_format: daemon.request("GET", f"/v1/jobs/{job}/image?format={image_format}")

    def test_every_format_and_openimageio_only_for_those_that_need_it(self):
        daemon, fetch = self.start()
        for image_format, signature in SIGNATURES.items():
            reply = fetch(image_format)
            self.assertEqual(reply.status, 200, image_format)
            self.assertTrue(reply.body.startswith(signature), image_format)
            with open(f"/proc/{daemon.process.pid}/maps", encoding="utf-8") as maps:
                self.assertEqual("libOpenImageIO" in maps.read(), image_format in ("exr", "hdr"), image_format)

    def test_the_client_is_installed(self):
        client = os.path.join(self.prefix, "bin", "tessera")
        self.assertIn("render", subprocess.run([client, "--help"], check=True, capture_output=True, text=True).stdout)

    def test_without_its_module_the_log_says_what_is_missing(self):
        os.remove(os.path.join(self.prefix, "lib", "tessera", "tessera_oiio.so"))
        daemon, fetch = self.start()
        self.assertEqual(fetch("png").status, 200)
        self.assertEqual(fetch("exr").status, 500)
        self.assertEqual(fetch("png").status, 200)
        # Nor is it the sender's fault.
        sky = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x81"
        name = "sha256:" + hashlib.sha256(sky).hexdigest()
        self.assertEqual(daemon.request("PUT", f"/v1/blobs/{name}", sky).status, 201)
        scene = {**SPHERE, "lights": [{"type": "environment", "blob": name}]}
        self.assertEqual(daemon.request("POST", "/v1/scenes", scene).status, 500)
        daemon.terminate()
        daemon.process.wait(timeout=60)  # The log has a thread of its own: all is written when the daemon has ended.
        self.assertIn("tessera_oiio.so", daemon.log())


if __name__ == "__main__":
    unittest.main()
