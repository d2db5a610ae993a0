"""What README.md and those beside it show is run as it stands there, so that it can't rot."""

import json
import os
import re
import struct
import subprocess
import tempfile
import unittest

from daemon import SOURCE, Daemon

POSITIONS = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1)
INDICES = bytes([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])


def tetrahedron():
    """A glTF binary of four triangles."""
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(POSITIONS) + len(INDICES)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(POSITIONS)},
            {"buffer": 0, "byteOffset": len(POSITIONS), "byteLength": len(INDICES)},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary = POSITIONS + INDICES
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def text_of(*path):
    with open(os.path.join(SOURCE, *path), encoding="utf-8") as file:
        return file.read()


def blocks(language, *path):
    return re.findall(rf"^```{language}\n(.*?)^```$", text_of(*path), re.DOTALL | re.MULTILINE)


class Readme(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.addClassCleanup(cls.daemon.stop)

    def run_curl(self, folder, model, count):
        """The first of README's blocks that call curl, one after the other as they stand there."""
        with open(os.path.join(folder, "model.glb"), "wb") as file:
            file.write(model)
        lines = [block for block in blocks("sh", "README.md") if "curl" in block][:count]
        return subprocess.run(
            ["bash", "-eu", "-o", "pipefail", "-c", "".join(lines)],
            cwd=folder,
            env={**os.environ, "TESSERA_SERVER": self.daemon.url},
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )

    def test_curl(self):
        with tempfile.TemporaryDirectory() as folder:
            done = self.run_curl(folder, tetrahedron(), 2)
            self.assertEqual(done.returncode, 0, done.stderr)
            for name in ("model.png", "job.png"):
                with open(os.path.join(folder, name), "rb") as file:
                    self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")
            self.assertIn("completed", done.stdout)

    def test_curl_ends_where_something_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertNotEqual(self.run_curl(folder, tetrahedron()[:-8], 1).returncode, 0)
            self.assertFalse(os.path.exists(os.path.join(folder, "model.png")))

    def test_scenes_and_settings(self):
        documents = [json.loads(block) for block in blocks("json", "proto", "README.md")]
        scene, lit = [document for document in documents if "objects" in document]
        settings = [document for document in documents if "objects" not in document]
        self.assertEqual(len(settings), 2)
        self.assertEqual(self.daemon.request("POST", "/v1/scenes", scene).status, 201)
        for some in settings:
            job = self.daemon.submit({"scene": scene, "settings": some, "image": {"width": 16, "height": 16}})
            self.assertEqual(self.daemon.wait_ended(job)["state"], "completed")
        job = self.daemon.submit({"scene": lit, "settings": {"samples": 4}, "image": {"width": 16, "height": 16}})
        self.assertEqual(self.daemon.wait_ended(job)["state"], "completed")
        self.assertGreater(self.daemon.request("GET", f"/v1/jobs/{job}/stats").json()["rays"]["scattered"], 0)

    def test_every_command_of_the_client(self):
        shown = subprocess.run([os.environ["TESSERA"], "--help"], capture_output=True, text=True, check=True).stdout
        commands = re.findall(r"^  (\w+) +\w", shown.split("Subcommands:")[1].split("Exit codes:")[0], re.MULTILINE)
        self.assertIn("render", commands)
        for command in commands:
            self.assertRegex(text_of("client", "README.md"), rf"`{command}[ `]")
        for code, meaning in re.findall(r"^  (\d)  (.+)$", shown, re.MULTILINE):
            self.assertIn(f"| {code} | {meaning} |", text_of("client", "README.md"))

    def test_every_word_of_the_capabilities(self):
        capabilities = self.daemon.request("GET", "/v1/capabilities").json()
        names = [row["kind"] for row in capabilities["accel"]]
        for list_of_names in ("aovs", "screen_bounds", "integrators", "samplers", "filters"):
            names += capabilities[list_of_names]
        for name in names:
            self.assertIn(f"`{name}`", text_of("proto", "README.md"))

    def test_it_is_short(self):
        self.assertLessEqual(len(text_of("README.md").splitlines()), 150)

    def test_links_lead_somewhere(self):
        for folder in ("", "client", "core", "proto", "server", "tests/benchmarks"):
            for target in re.findall(r"\]\(([^)#]+)\)", text_of(folder, "README.md")):
                if "://" not in target:
                    self.assertTrue(os.path.exists(os.path.join(SOURCE, folder, target)), target)


if __name__ == "__main__":
    unittest.main()
