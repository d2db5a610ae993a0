"""What README.md shows is run as it stands there, so that it can't rot."""

import json
import os
import re
import subprocess
import tempfile
import unittest

from daemon import SOURCE, Daemon

TETRAHEDRON = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
0 0 1
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""


def readme():
    with open(os.path.join(SOURCE, "README.md"), encoding="utf-8") as file:
        return file.read()


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", readme(), re.DOTALL | re.MULTILINE)


class Readme(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.addClassCleanup(cls.daemon.stop)

    def test_curl(self):
        lines = next(block for block in blocks("sh") if "curl" in block)
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "mesh.ply"), "w", encoding="ascii") as file:
                file.write(TETRAHEDRON)
            done = subprocess.run(
                ["bash", "-eu", "-o", "pipefail", "-c", lines],
                cwd=folder,
                env={**os.environ, "TESSERA_SERVER": self.daemon.url},
                capture_output=True,
                text=True,
                timeout=120,
                check=False,
            )
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(os.path.join(folder, "mesh.png"), "rb") as file:
                self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")
            self.assertIn("completed", done.stdout)

    def test_curl_ends_where_something_is_refused(self):
        lines = next(block for block in blocks("sh") if "curl" in block)
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "mesh.ply"), "w", encoding="ascii") as file:
                file.write(TETRAHEDRON[:-8])
            environment = {**os.environ, "TESSERA_SERVER": self.daemon.url}
            done = subprocess.run(
                ["bash", "-c", lines], cwd=folder, env=environment, capture_output=True, timeout=120, check=False
            )
            self.assertNotEqual(done.returncode, 0)
            with open(os.path.join(folder, "job.json"), encoding="utf-8") as file:
                self.assertEqual(json.load(file)["status"], 422)

    def test_scenes_and_settings(self):
        documents = [json.loads(block) for block in blocks("json")]
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
            self.assertRegex(readme(), rf"`{command}[ `]")
        for code, meaning in re.findall(r"^  (\d)  (.+)$", shown, re.MULTILINE):
            self.assertIn(f"| {code} | {meaning} |", readme())

    def test_every_word_of_the_capabilities(self):
        capabilities = self.daemon.request("GET", "/v1/capabilities").json()
        names = [row["kind"] for row in capabilities["accel"]]
        for list_of_names in ("aovs", "screen_bounds", "integrators", "samplers", "filters"):
            names += capabilities[list_of_names]
        for name in names:
            self.assertIn(f"`{name}`", readme())

    def test_links_lead_somewhere(self):
        for target in re.findall(r"\]\(([^)#]+)\)", readme()):
            if "://" not in target:
                self.assertTrue(os.path.exists(os.path.join(SOURCE, target)), target)


if __name__ == "__main__":
    unittest.main()
