"""The real client against the real daemon."""

import http.server
import json
import os
import pty
import re
import select
import signal
import subprocess
import tempfile
import threading
import unittest

from daemon import ENDED, Daemon
from documents import crowd

OK, JOB_FAILED, USAGE, REFUSED, UNREACHABLE, LOCAL_FILE = range(6)
PNG = b"\x89PNG\r\n\x1a\n"
HIDDEN_CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f]")

SPHERE = {
    "lights": [{"type": "ambient", "radiance": [1, 1, 1]}],
    "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
}
# Takes far longer than any test waits, and stops between tiles.
ENDLESS = {"scene": SPHERE, "image": {"width": 2000, "height": 2000}, "settings": {"samples": 4000, "tile_size": 16}}

RED_TRIANGLE = "mtllib colours.mtl\nusemtl red\nv -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n"
COLOURS = "newmtl red\nKd 1 0 0\n"


class ClientTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--threads", "2")
        cls.addClassCleanup(cls.daemon.stop)

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def write(self, name, content):
        path = os.path.join(self.folder, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(content if isinstance(content, str) else json.dumps(content))
        return path

    def read(self, name):
        with open(os.path.join(self.folder, name), "rb") as file:
            return file.read()

    def environment(self, server):
        return {**os.environ, "TESSERA_SERVER": server or self.daemon.url}

    def tessera(self, *arguments, code=OK, stdin="", server=None):
        """Runs the tool with nothing that is a terminal, in the test's folder; checks its exit code."""
        done = subprocess.run(
            [os.environ["TESSERA"], *arguments],
            cwd=self.folder,
            input=stdin,
            env=self.environment(server),
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        self.assertEqual(done.returncode, code, f"{arguments}\nstdout: {done.stdout}\nstderr: {done.stderr}")
        return done

    def submit(self, document, *arguments):
        return self.tessera("submit", self.write("submitted.json", document), *arguments).stdout.strip()

    def submit_endless(self):
        job = self.submit(ENDLESS)
        self.addCleanup(self.daemon.request, "POST", f"/v1/jobs/{job}/cancel")
        return job


class Commands(ClientTest):
    def test_render(self):
        self.write("scene.json", SPHERE)
        done = self.tessera("render", "scene.json", "-o", "a.png", "--size", "64x48", "--spp", "2")
        self.assertTrue(self.read("a.png").startswith(PNG))
        self.assertEqual(self.read("a.png")[16:24], (64).to_bytes(4, "big") + (48).to_bytes(4, "big"))
        self.assertIn("a.png: 64x48", done.stdout)
        self.assertEqual(sorted(os.listdir(self.folder)), ["a.png", "scene.json"])

    def test_render_as_json(self):
        self.write("scene.json", SPHERE)
        done = self.tessera("render", "scene.json", "--size", "8x8", "--json", "--name", "mine")
        answer = json.loads(done.stdout)
        self.assertEqual((answer["state"], answer["name"], answer["image"]), ("completed", "mine", "out.png"))
        self.assertTrue(self.read("out.png").startswith(PNG))

    def test_submit_watch_fetch(self):
        done = self.tessera("submit", self.write("scene.json", SPHERE), "--size", "32x32")
        job = done.stdout.strip()
        self.assertEqual(done.stdout, job + "\n")
        watched = self.tessera("watch", job)
        self.assertEqual(watched.stdout, "")
        self.assertTrue(watched.stderr.endswith("completed\n"), watched.stderr)
        for ending, magic in ((".png", PNG), (".jpg", b"\xff\xd8"), (".exr", b"\x76\x2f\x31\x01"), (".hdr", b"#?")):
            self.tessera("fetch", job, "-o", "image" + ending)
            self.assertTrue(self.read("image" + ending).startswith(magic), ending)
        self.tessera("fetch", job, "-o", "image", "--format", "png")
        self.assertEqual(self.read("image"), self.read("image.png"))

    def test_options_reach_the_job(self):
        options = "--size 40x30 --spp 3 --max-depth 2 --accel brute --screen-bounds off --tile-size 10 --seed 7"
        job = self.submit(SPHERE, *options.split(), "--aov", "depth,normal")
        self.tessera("watch", job)
        plan = json.loads(self.tessera("plan", job, "--json").stdout)
        self.assertEqual(plan["image"], {"width": 40, "height": 30, "samples": 3})
        self.assertEqual(plan["accel"]["kind"], "brute")
        self.assertEqual(plan["tiles"]["count"], 12)
        self.tessera("fetch", job, "-o", "depth.exr", "--aov", "depth")
        self.tessera("fetch", job, "-o", "all.exr", "--aov", "all")
        self.assertIn(b"N.X", self.read("all.exr"))
        self.tessera("fetch", job, "-o", "id.exr", "--aov", "object_id", code=REFUSED)

    def test_structures_and_their_evidence(self):
        accel = "bvh,bound=slabs,leaf_size=2,normals=1:0:0/0:1:0/0.5:0:-1,space=object"
        options = ["--size", "32x32", "--accel", accel, "--screen-bounds", "hierarchical", "--count-tests"]
        job = self.submit(SPHERE, *options, "--aov", "cost_volumes")
        self.tessera("watch", job)
        structure = json.loads(self.tessera("stats", job, "--json").stdout)["structure"]
        self.assertEqual(structure["kind"], "bvh")
        self.assertEqual(
            structure["options"],
            {"bound": "slabs", "space": "object", "leaf_size": 2, "normals": [[1, 0, 0], [0, 1, 0], [0.5, 0, -1]]},
        )
        stats = self.tessera("stats", job).stdout
        self.assertRegex(stats, r"(?m)^tests\n(  .*\n)*  volume_tests +\d+$")
        self.assertRegex(stats, r"(?m)^  per_ray\n    object_tests +[\d.]+\n")
        self.assertIn("normals    [[1.0,0.0,0.0],[0.0,1.0,0.0],[0.5,0.0,-1.0]]", stats)
        self.tessera("fetch", job, "-o", "heat.png", "--aov", "cost_volumes")
        uncounted = self.submit(SPHERE, "--size", "8x8")
        self.tessera("watch", uncounted)
        self.assertRegex(self.tessera("stats", uncounted).stdout, r"(?m)^tests +not counted")

    def test_candidates_are_a_table(self):
        job = self.submit(SPHERE, "--size", "8x8", "--accel", "auto")
        self.tessera("watch", job)
        candidates = json.loads(self.tessera("plan", job, "--json").stdout)["candidates"]
        printed = self.tessera("plan", job).stdout
        self.assertEqual("build s" in printed, bool(candidates))
        rows = re.findall(r"(?m)^  (\S+)(?: +[\d.e+-]+){3}$", printed)
        self.assertEqual([row.split(",")[0] for row in rows], [candidate["kind"] for candidate in candidates])

    def test_capabilities(self):
        listed = self.tessera("capabilities").stdout
        for row in json.loads(self.tessera("capabilities", "--json").stdout)["accel"]:
            self.assertIn(f"\n  {row['kind']}: ", listed)
        self.assertIn("    bound=box|sphere|slabs|hull ", listed)
        self.assertIn("    leaf_size=1..255 ", listed)

    def test_render_says_where_planes_are_that_an_image_has_no_room_for(self):
        self.write("scene.json", SPHERE)
        done = self.tessera("render", "scene.json", "-o", "a.png", "--size", "8x8", "--aov", "normal")
        self.assertRegex(done.stderr, r"(?m)^note: a\.png holds the colour; 'tessera fetch \S+ --aov NAME -o FILE'")

    def test_render_writes_recorded_aovs_into_one_exr(self):
        self.write("scene.json", SPHERE)
        self.tessera("render", "scene.json", "-o", "a.exr", "--size", "8x8", "--aov", "normal", "--aov", "depth")
        for channel in (b"N.X\0", b"Z\0", b"R\0"):
            self.assertIn(channel, self.read("a.exr"))

    def test_list(self):
        job = self.submit(SPHERE, "--size", "8x8", "--name", "listed")
        self.tessera("watch", job)
        (line,) = [line for line in self.tessera("list").stdout.splitlines() if line.startswith(job)]
        self.assertRegex(line, r"completed +100% +8x8 .* listed$")
        (row,) = [row for row in json.loads(self.tessera("--json", "list").stdout) if row["id"] == job]
        self.assertEqual(row["state"], "completed")

    def test_plan_and_stats_for_people(self):
        job = self.submit(SPHERE, "--size", "8x8")
        self.tessera("watch", job)
        self.assertRegex(self.tessera("plan", job).stdout, r"(?m)^accel\n")
        self.assertRegex(self.tessera("stats", job).stdout, r"(?m)^rays\n(  .*\n)*  total +\d+$")

    def test_a_job_that_isnt_planned(self):
        with Daemon("--threads", "1") as daemon:
            crowd(daemon)
            waiting = daemon.submit(ENDLESS)
            daemon.request("POST", f"/v1/jobs/{waiting}/cancel")
            done = self.tessera("plan", waiting, server=daemon.url)
            self.assertEqual(done.stdout, "not planned yet\n")

    def test_cancel_then_watch_then_delete(self):
        job = self.submit_endless()
        self.daemon.wait_until(job, lambda status: status["tiles_done"] > 0)
        self.tessera("fetch", job, "-o", "part.png", code=REFUSED)
        self.tessera("fetch", job, "-o", "part.png", "--partial")
        self.assertTrue(self.read("part.png").startswith(PNG))
        self.tessera("delete", job, code=REFUSED)
        self.tessera("cancel", job)
        watched = self.tessera("watch", job, code=JOB_FAILED)
        self.assertIn(f"job {job} canceled", watched.stderr)
        self.tessera("cancel", job, code=REFUSED)
        self.tessera("delete", job)
        self.tessera("watch", job, code=REFUSED)

    def test_job_canceled_during_render(self):
        process = subprocess.Popen(
            [os.environ["TESSERA"], "render", self.write("job.json", ENDLESS), "-o", os.path.join(self.folder, "a.png")],
            env=self.environment(None),
            stderr=subprocess.PIPE,
            text=True,
        )
        with process:
            job = process.stderr.readline().split()[-1]
            self.tessera("cancel", job)
            self.assertIn("canceled", process.communicate(timeout=120)[1])
        self.assertEqual(process.returncode, JOB_FAILED)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "a.png")))

    def test_two_jobs_at_once(self):
        endless = self.submit_endless()
        self.write("scene.json", SPHERE)
        self.tessera("render", "scene.json", "--size", "16x16")
        self.assertNotIn(self.daemon.status(endless)["state"], ENDED)


class Scenes(ClientTest):
    def test_job_document_from_stdin(self):
        job = {"scene": SPHERE, "image": {"width": 8, "height": 4}, "name": "piped"}
        answer = json.loads(self.tessera("render", "-", "--json", stdin=json.dumps(job)).stdout)
        self.assertEqual((answer["width"], answer["height"], answer["name"]), (8, 4, "piped"))

    def test_obj_brings_its_material_library(self):
        self.write("colours.mtl", COLOURS)
        self.write("triangle.obj", RED_TRIANGLE)
        status = json.loads(self.tessera("render", "triangle.obj", "-o", "red.png", "--size", "32x32", "--json").stdout)
        self.assertEqual(status["warnings"], 0)
        os.remove(os.path.join(self.folder, "colours.mtl"))
        self.tessera("render", "triangle.obj", "-o", "grey.png", "--size", "32x32")
        self.assertNotEqual(self.read("red.png"), self.read("grey.png"))

    def test_warnings_are_told_with_the_files_path(self):
        self.write("meshes/triangle.obj", RED_TRIANGLE + "f 1 1 2\n")
        self.write("meshes/colours.mtl", COLOURS)
        self.write("scene.json", {"objects": [{"type": "file", "path": "meshes/triangle.obj"}]})
        for command in (["render", "-o", "a.png"], ["submit"]):
            done = self.tessera(*command, "scene.json", "--size", "8x8")
            self.assertRegex(done.stderr, r"(?m)^warning: \S*meshes/triangle\.obj\S*: \S")
            self.assertNotIn("sha256:", done.stderr)
        self.assertNotIn("warning", self.tessera("submit", self.write("s.json", SPHERE)).stderr)

    def test_a_job_runs_whose_warnings_cant_be_had(self):
        status = self.daemon.status(self.submit(SPHERE, "--size", "8x8"))

        class ForgetsScenes(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                self.rfile.read(int(self.headers["Content-Length"]))
                answer = json.dumps({**status, "warnings": 3}).encode()
                self.send_response(201)
                self.send_header("Content-Length", str(len(answer)))
                self.end_headers()
                self.wfile.write(answer)

            def do_GET(self):
                self.send_error(404)

            def log_message(self, *_):
                pass

        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), ForgetsScenes) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            url = f"http://127.0.0.1:{server.server_port}"
            done = self.tessera("submit", self.write("s.json", SPHERE), server=url)
            server.shutdown()
        self.assertEqual(done.stdout.strip(), status["id"])
        self.assertIn("warning: there are 3, which the server doesn't tell: ", done.stderr)

    def test_files_are_found_from_the_documents_folder(self):
        self.write("there/meshes/colours.mtl", COLOURS)
        self.write("there/meshes/triangle.obj", RED_TRIANGLE)
        scene = {
            "geometries": {"part": {"type": "file", "path": "meshes/triangle.obj"}},
            "objects": [
                {"type": "file", "path": "meshes/triangle.obj"},
                {"type": "instance", "of": "part", "transform": {"translate": [3, 0, 0]}},
            ],
        }
        self.write("there/scene.json", scene)
        self.tessera("render", "there/scene.json", "--size", "16x16")

    def test_nff_with_its_own_lights_and_camera(self):
        self.write(
            "ball.nff",
            "v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 0.1\nresolution 64 64\n"
            "b 0.1 0.2 0.3\nl 5 5 5\nf 1 0.5 0.2 0.8 0.2 10 0 1\ns 0 0 0 1\n",
        )
        self.tessera("render", "ball.nff", "--size", "16x16")

    def test_a_known_file_is_uploaded_again_without_harm(self):
        self.write("triangle.obj", RED_TRIANGLE)
        self.tessera("render", "triangle.obj", "--size", "8x8")
        self.tessera("render", "triangle.obj", "--size", "8x8")


class Refusals(ClientTest):
    def test_every_fault_of_a_document_is_told(self):
        scene = {"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": -1}, {"type": "blob"}], "fog": 1}
        done = self.tessera("submit", self.write("scene.json", scene), code=REFUSED)
        self.assertEqual(done.stdout, "")
        for pointer in ("/scene/objects/0/radius: ", "/scene/objects/1/type: ", "/scene/fog: "):
            self.assertIn(pointer, done.stderr)

    def test_unknown_structure(self):
        done = self.tessera("submit", self.write("s.json", SPHERE), "--accel", "magic", code=REFUSED)
        self.assertIn("/settings/accel/kind: ", done.stderr)
        done = self.tessera("submit", self.write("s.json", SPHERE), "--accel", "grid,bound=box", code=REFUSED)
        self.assertIn("/settings/accel/bound: ", done.stderr)

    def test_path_that_leads_nowhere_is_told(self):
        scene = {"objects": [{"type": "file", "path": "gone.ply"}]}
        done = self.tessera("submit", self.write("scene.json", scene), code=REFUSED)
        self.assertIn("note: there is no file gone.ply here", done.stderr)
        self.assertIn("/scene/objects/0/path: ", done.stderr)

    def test_broken_file_is_named_by_its_path(self):
        self.write("meshes/broken.ply", "ply\nformat ascii 1.0\nelement vertex many\n")
        scene = {"objects": [{"type": "file", "path": "meshes/broken.ply"}]}
        done = self.tessera("submit", self.write("scene.json", scene), code=REFUSED)
        self.assertRegex(done.stderr, r"(?m)^  \S*meshes/broken\.ply:3: ")
        self.assertNotIn("sha256:", done.stderr)

    def test_unknown_job(self):
        for command in (["watch"], ["plan"], ["stats"], ["cancel"], ["delete"], ["fetch", "-o", "a.png"]):
            self.tessera(*command, "no such/job", code=REFUSED)
        self.assertEqual(os.listdir(self.folder), [])

    def test_usage(self):
        scene = self.write("s.json", SPHERE)
        for arguments in (
            [],
            ["paint"],
            ["render"],
            ["render", scene, "--size", "12"],
            ["render", scene, "--spp", "x"],
            ["render", scene, "--accel", "bvh,bound"],
            ["render", scene, "--accel", "bvh,normals=1:x:0"],
            ["render", scene, "-o", "image.bmp"],
            ["fetch", "id"],
            ["list", "--server", "ftp://x"],
        ):
            self.assertNotEqual(self.tessera(*arguments, code=USAGE).stderr, "", arguments)
        self.assertIn("Exit codes:", self.tessera("--help").stdout)
        for option in ("--spp", "--max-depth", "--seed"):
            refused = self.tessera("render", "scene.json", option, "-3", code=USAGE)
            self.assertIn("-3 is negative", refused.stderr)
        self.assertIn("no command 'paint'", self.tessera("paint", code=USAGE).stderr)
        self.assertRegex(self.tessera("--version").stdout, r"^\d+\.\d+\.\d+\n$")

    def test_no_server(self):
        done = self.tessera("list", code=UNREACHABLE, server="http://127.0.0.1:1")
        self.assertIn("http://127.0.0.1:1", done.stderr)

    def test_server_that_stops_during_a_watch(self):
        with Daemon("--threads", "1") as daemon:
            job = daemon.submit(ENDLESS)
            process = subprocess.Popen(
                [os.environ["TESSERA"], "watch", job], env=self.environment(daemon.url), stderr=subprocess.PIPE
            )
            with process:
                process.stderr.readline()
                daemon.process.send_signal(signal.SIGKILL)
                daemon.process.wait()
                process.communicate(timeout=120)
            self.assertEqual(process.returncode, UNREACHABLE)

    def test_local_files(self):
        scene = self.write("s.json", SPHERE)
        self.tessera("render", "gone.json", code=LOCAL_FILE)
        self.tessera("render", "gone.ply", code=LOCAL_FILE)
        self.tessera("render", self.write("broken.json", "{"), code=LOCAL_FILE)
        jobs_before = len(self.daemon.request("GET", "/v1/jobs").json()["jobs"])
        self.tessera("render", scene, "-o", "no/such/folder/a.png", code=LOCAL_FILE)
        jobs_after = len(self.daemon.request("GET", "/v1/jobs").json()["jobs"])
        self.assertEqual(jobs_before, jobs_after, "a job was submitted whose image can't be written")


class Progress(ClientTest):
    def test_plain_lines_when_not_a_terminal(self):
        self.write("scene.json", SPHERE)
        done = self.tessera("render", "scene.json", "--size", "256x256", "--spp", "4")
        self.assertNotRegex(done.stderr, HIDDEN_CONTROL)
        self.assertNotRegex(done.stdout, HIDDEN_CONTROL)
        self.assertIn("completed\n", done.stderr)

    def test_one_line_drawn_over_on_a_terminal(self):
        self.write("scene.json", SPHERE)
        ours, theirs = pty.openpty()
        process = subprocess.Popen(
            [os.environ["TESSERA"], "render", "scene.json", "--size", "256x256", "--spp", "4"],
            cwd=self.folder,
            env=self.environment(None),
            stdout=subprocess.DEVNULL,
            stderr=theirs,
        )
        os.close(theirs)
        drawn = b""
        while select.select([ours], [], [], 120)[0]:
            try:
                drawn += os.read(ours, 4096)
            except OSError:  # the terminal's other end is closed
                break
        os.close(ours)
        self.assertEqual(process.wait(timeout=120), OK)
        lines = drawn.decode().split("\r\033[K")
        self.assertRegex(lines[-1], r"^completed \[#{30}\] 100%.*\r\n$")


if __name__ == "__main__":
    unittest.main()
