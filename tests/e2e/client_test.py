"""The real client against the real daemon."""

import hashlib
import http.server
import json
import os
import pty
import re
import resource
import select
import signal
import struct
import subprocess
import tempfile
import threading
import unittest

from daemon import ENDED, Daemon
from documents import keep_busy
from render_test import CORNERS, GLTF, MTL, NFF, PLY, WITH_MTL, form

OK, JOB_FAILED, USAGE, REFUSED, UNREACHABLE, LOCAL_FILE = range(6)
INTERRUPTED, READER_HAS_GONE = 130, 141
PNG = b"\x89PNG\r\n\x1a\n"
HIDDEN_CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f]")

SPHERE = {
    "lights": [{"type": "ambient", "radiance": [1, 1, 1]}],
    "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
}
# Takes far longer than any test waits, and stops between tiles.
ENDLESS = {"scene": SPHERE, "image": {"width": 2000, "height": 2000}, "settings": {"samples": 4000, "tile_size": 16}}

STL = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"
RED_TRIANGLE = "mtllib colours.mtl\nusemtl red\nv -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n"
COLOURS = "newmtl red\nKd 1 0 0\n"


def self_contained(gltf, buffer):
    """A glTF document with its one buffer, as GLB."""
    text = json.dumps({**gltf, "buffers": [{"byteLength": len(buffer)}]}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


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

    def tessera(self, *arguments, code=OK, stdin="", server=None, **more):
        """Runs the tool with nothing that is a terminal, in the test's folder; checks its exit code."""
        outputs = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **more}
        done = subprocess.run(
            [os.environ["TESSERA"], *arguments],
            cwd=self.folder,
            input=stdin,
            env=self.environment(server),
            timeout=120,
            check=False,
            **outputs,
        )
        self.assertEqual(done.returncode, code, f"{arguments}\nstdout: {done.stdout}\nstderr: {done.stderr}")
        return done

    def submit(self, document, *arguments):
        return self.tessera("submit", self.write("submitted.json", document), *arguments).stdout.strip()

    def jobs(self):
        return {job["id"]: job for job in self.daemon.request("GET", "/v1/jobs?limit=1000").json()["jobs"]}

    def blobs(self):
        return os.listdir(os.path.join(self.daemon.data_dir, "blobs"))

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

    def test_looks_of_an_image(self):
        self.write("scene.json", SPHERE)
        job = self.submit(SPHERE, "--size", "8x8", "--samples", "2", "--integrator", "whitted", "--sampler", "grid")
        self.tessera("watch", job)
        looks = (["--exposure", "-2"], ["--exposure", "1.5", "--tone-map", "aces"], ["--tone-map", "khronos_pbr_neutral"], [])
        for i, look in enumerate(looks):
            self.tessera("fetch", job, "-o", f"{i}.png", *look)
        self.assertEqual(len({self.read(f"{i}.png") for i in range(len(looks))}), len(looks))
        self.tessera("fetch", job, "-o", "half.exr", "--precision", "half")
        self.tessera("fetch", job, "-o", "float.exr")
        self.assertLess(len(self.read("half.exr")), len(self.read("float.exr")))
        self.tessera("render", "scene.json", "-o", "a.jpg", "--size", "8x8", "--exposure", "1", "--tone-map", "none")
        before = self.tessera("list").stdout  # Noticed before anything is rendered.
        for options in (["--exposure", "bright"], ["--exposure", "1", "-o", "a.exr"], ["--tone-map", "filmic"],
                        ["--tone-map", "aces", "-o", "a.hdr"], ["--precision", "half"], ["--exposure", "65"],
                        ["--until-error", "nan"], ["--until-error", "0"], ["--until-seconds", "inf"]):
            self.tessera("render", "scene.json", *options, code=USAGE)
        self.assertEqual(self.tessera("list").stdout, before)

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
        (job,) = re.findall(r"tessera delete (\S+)'", done.stderr)
        self.tessera("fetch", job, "--aov", "normal", "-o", "normal.exr")
        self.tessera("delete", job)

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
            keep_busy(daemon)
            waiting = daemon.submit({**ENDLESS, "priority": "low"})
            daemon.request("POST", f"/v1/jobs/{waiting}/cancel")
            done = self.tessera("plan", waiting, server=daemon.url)
            self.assertEqual(done.stdout, "not planned yet\n")

    def test_list_chooses(self):
        with Daemon("--threads", "1") as daemon:
            names = [f"n{i}" for i in range(4)]
            ids = [daemon.submit({"scene": SPHERE, "name": name, "image": {"width": 4, "height": 4}}) for name in names]
            for job in ids:
                daemon.wait_ended(job)
            endless = daemon.submit(ENDLESS)

            def listed(*arguments):
                text = self.tessera("list", *arguments, server=daemon.url).stdout
                rows = json.loads(self.tessera("list", "--json", *arguments, server=daemon.url).stdout)
                self.assertEqual([line.split()[0] for line in text.splitlines()[1:]], [row["id"] for row in rows])
                return [row["id"] for row in rows]

            self.assertEqual(listed(), [*ids, endless])
            self.assertEqual(listed("--limit", "2"), [ids[-1], endless])
            self.assertEqual(listed("--state", "completed"), ids)
            self.assertEqual(listed("--state", "completed", "--limit", "1"), ids[-1:])
            self.assertEqual(listed("--state", "failed,canceled"), [])
            self.tessera("list", "--state", "done", code=USAGE, server=daemon.url)
            for limit in ("0", "-3", "x"):
                self.tessera("list", "--limit", limit, code=USAGE, server=daemon.url)

    def test_jobs_by_the_beginning_of_their_ids(self):
        with Daemon("--threads", "1") as daemon:
            self.tessera("watch", "@latest", code=REFUSED, server=daemon.url)
            ids = [daemon.submit({"scene": SPHERE, "image": {"width": 4, "height": 4}}) for _ in range(2)]
            common = os.path.commonprefix(ids)
            for job in ids:
                unique = job[: len(common) + 1]
                self.tessera("watch", unique, server=daemon.url)
                self.tessera("fetch", unique, "-o", "a.png", server=daemon.url)
            refused = self.tessera("cancel", common, code=USAGE, server=daemon.url)
            for job in ids:
                self.assertIn(f"  {job}: completed", refused.stderr)
            error = json.loads(self.tessera("delete", common, "--json", code=USAGE, server=daemon.url).stderr)["error"]
            self.assertEqual([place["pointer"] for place in error["errors"]], ids)
            latest = json.loads(self.tessera("watch", "@latest", "--json", server=daemon.url).stdout)
            self.assertEqual(latest["id"], ids[1])
            self.tessera("delete", "@latest", server=daemon.url)
            self.tessera("stats", ids[1], code=REFUSED, server=daemon.url)
            self.tessera("stats", "", code=REFUSED, server=daemon.url)

    def test_render_leaves_nothing_behind(self):
        scene = self.write("scene.json", SPHERE)
        before = self.jobs()
        answer = json.loads(self.tessera("render", scene, "--size", "8x8", "--json").stdout)
        self.assertFalse(answer["kept"])
        self.tessera("render", scene, "--size", "8x8", "--aov", "depth", "-o", "a.exr")
        self.assertEqual(self.jobs(), before)
        answer = json.loads(self.tessera("render", scene, "--size", "8x8", "--json", "--keep").stdout)
        self.assertTrue(answer["kept"])
        self.assertEqual(self.jobs().keys() - before.keys(), {answer["id"]})
        self.tessera("fetch", answer["id"], "-o", "b.png")

    def test_render_keeps_what_it_counted(self):
        done = self.tessera("render", self.write("scene.json", SPHERE), "--size", "8x8", "--count-tests")
        (job,) = re.findall(r"tessera delete (\S+)'", done.stderr)
        self.assertRegex(self.tessera("stats", job).stdout, r"(?m)^tests\n")

    def test_render_keeps_a_job_whose_image_it_cant_save(self):
        scene = self.write("scene.json", SPHERE)
        done = self.tessera("render", scene, "--size", "8x8", "-o", "/dev/full", "--format", "png", code=LOCAL_FILE)
        self.assertIn("/dev/full: No space left", done.stderr)
        (job,) = re.findall(r"note: job (\S+) is kept; 'tessera fetch", done.stderr)
        self.tessera("fetch", job, "-o", "a.png")
        self.assertTrue(self.read("a.png").startswith(PNG))

    def test_an_image_on_stdout(self):
        scene = self.write("scene.json", SPHERE)
        done = self.tessera("render", scene, "--size", "8x8", "-o", "-", stdin=b"", text=False)
        self.assertTrue(done.stdout.startswith(PNG))
        self.assertTrue(done.stdout.endswith(b"IEND\xaeB`\x82"))
        self.assertRegex(done.stderr, rb"(?m)^-: 8x8 in ")
        done = self.tessera("render", scene, "--size", "8x8", "-o", "-", "--format", "hdr", "--json", stdin=b"", text=False)
        self.assertTrue(done.stdout.startswith(b"#?RADIANCE"))
        self.assertEqual(json.loads(done.stderr.splitlines()[-1])["state"], "completed")
        job = self.submit(SPHERE, "--size", "8x8")
        self.tessera("watch", job)
        fetched = self.tessera("fetch", job, "-o", "-", stdin=b"", text=False)
        self.assertTrue(fetched.stdout.startswith(PNG))
        self.assertEqual(fetched.stderr, b"")
        self.assertNotIn("-", os.listdir(self.folder))

    def test_no_image_on_a_terminal(self):
        ours, theirs = pty.openpty()
        before = self.jobs()
        done = self.tessera("render", self.write("scene.json", SPHERE), "-o", "-", code=USAGE, stdout=theirs)
        self.assertIn("terminal", done.stderr)
        self.assertEqual(self.jobs(), before)
        os.close(ours)
        os.close(theirs)

    def interrupt(self, *arguments, is_ready):
        """Runs the tool and interrupts it as soon as `is_ready(process)`; what it said on stderr."""
        process = subprocess.Popen(
            [os.environ["TESSERA"], *arguments],
            cwd=self.folder,
            env=self.environment(None),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        with process:
            while not is_ready(process):
                pass
            process.send_signal(signal.SIGINT)
            stdout, stderr = process.communicate(timeout=120)
        self.assertEqual((process.returncode, stdout), (INTERRUPTED, ""), stderr)
        return stderr

    def test_interrupted_it_says_how_to_end_the_job(self):
        scene = self.write("job.json", ENDLESS)
        said = []
        stderr = self.interrupt("render", scene, is_ready=lambda p: said.append(p.stderr.readline()) or len(said) == 2)
        job = said[0].split()[-1]
        self.addCleanup(self.daemon.request, "POST", f"/v1/jobs/{job}/cancel")
        message = f"job {job} goes on; 'tessera cancel {job}' ends it"
        self.assertTrue(stderr.endswith(message + "\n"), stderr)
        self.assertNotIn(self.daemon.status(job)["state"], ENDED)

        stderr = self.interrupt("watch", job, is_ready=lambda p: p.stderr.readline())
        self.assertTrue(stderr.endswith(message + "\n"), stderr)

        def catches_sigint(process):
            with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
                caught = int(re.search(r"SigCgt:\s*(\w+)", status.read())[1], 16)
            return caught >> (signal.SIGINT - 1) & 1

        error = json.loads(self.interrupt("watch", job, "--json", is_ready=catches_sigint))["error"]
        self.assertEqual((error["kind"], error["message"], error["job"]), ("interrupted", message, job))

    def test_cancel_then_watch_then_delete(self):
        job = self.submit_endless()
        self.daemon.wait_until(job, lambda status: status["samples_done"] > 0)
        early = self.tessera("fetch", job, "-o", "part.png", code=REFUSED)
        self.assertIn("--partial fetches the image so far", early.stderr)
        self.assertNotIn("?partial", early.stderr)
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

    def test_obj_brings_libraries_however_they_are_named(self):
        for statement in (
            "mtllib my mat.mtl", 'mtllib "my mat.mtl"', "mtllib sub\\plain.mtl", "MtlLib\tTOP.mtl # red",
            "mtllib \\\n  top.mtl", "mtllib C:\\Users\\bob\\top.mtl", "mtllib /home/bob/top.mtl", "mtllib ./top.mtl",
            "mtllib ../top.mtl", "mtllib none/top.mtl", "mtllib top.mtl\r", "mtllib top.mtl top.mtl\nmtllib top.mtl",
        ):
            with self.subTest(statement=statement):
                for name in ("my mat.mtl", "sub/plain.mtl", "top.mtl"):
                    self.write(name, COLOURS)
                self.write("a.obj", "\ufeff" + statement + RED_TRIANGLE[RED_TRIANGLE.index("\n") :])
                answer = json.loads(self.tessera("render", "a.obj", "--size", "8x8", "--json").stdout)
                self.assertEqual(answer["warnings"], 0)

    def test_nothing_from_outside_the_documents_folder_is_sent(self):
        secret = self.write("secret.mtl", COLOURS)
        outside = self.write("outside.ply", "ply\nformat ascii 1.0\nend_header\n")
        self.write("in/a.obj", RED_TRIANGLE.replace("colours.mtl", "../secret.mtl") + f"mtllib {secret}\n")
        before = set(self.blobs())
        done = self.tessera("submit", "in/a.obj", "--size", "8x8")
        self.assertRegex(done.stderr, r"(?m)^note: the material library .*secret\.mtl lies outside.*--allow-outside")
        self.assertEqual(len(set(self.blobs()) - before), 1, "more than the OBJ was sent")
        done = self.tessera("submit", "in/a.obj", "--size", "8x8", "--allow-outside")
        self.assertNotIn("outside", done.stderr)

        os.symlink(outside, os.path.join(self.folder, "in/link.ply"))
        for path in (outside, "../outside.ply", "link.ply"):
            self.write("in/scene.json", {"objects": [{"type": "file", "path": path}]})
            before = self.blobs()
            done = self.tessera("submit", "in/scene.json", code=LOCAL_FILE)
            self.assertIn(f"/scene/objects/0/path: {path} lies outside", done.stderr)
            self.assertIn("--allow-outside", done.stderr)
            self.assertEqual(self.blobs(), before)

    def test_files_of_other_kinds_are_called_what_they_are(self):
        self.write("scene.dae", "<?xml version='1.0'?><COLLADA></COLLADA>")
        self.write("cube.off", "OFF\n8 6 0\n")
        for name, kind in (("scene.dae", "a COLLADA file"), ("cube.off", "an OFF file")):
            done = self.tessera("render", name, code=LOCAL_FILE)
            self.assertEqual(done.stderr, f"tessera: {name} is {kind}; known are JSON documents, glTF, OBJ, PLY, STL and NFF\n")
        done = self.tessera("render", "-", code=LOCAL_FILE, stdin="solid cube\nfacet normal 0 0 1\n")
        self.assertIn("tessera: standard input is an STL file; ", done.stderr)
        self.write("triangle.txt", RED_TRIANGLE)
        self.tessera("render", "triangle.txt", "--size", "8x8")

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
        self.assertIn("note: there are 3 warnings, which the server doesn't tell: ", done.stderr)

    def test_a_file_is_the_same_picture_through_every_door(self):
        glb = self_contained(GLTF, CORNERS)
        files = {"a.gltf": json.dumps(GLTF).encode(), "buffers/corners 1.bin": CORNERS, "a.glb": glb, "a.nff": NFF,
                 "a.obj": WITH_MTL, "a.mtl": MTL, "a.ply": PLY, "a.stl": STL}
        for name, content in files.items():
            os.makedirs(os.path.dirname(os.path.join(self.folder, name)), exist_ok=True)
            with open(os.path.join(self.folder, name), "wb") as file:
                file.write(content)
        names = {"a.gltf": ["buffers/corners 1.bin"], "a.obj": ["a.mtl"]}
        with Daemon("--threads", "2", "--asset-root", self.folder) as daemon:
            pictures = {}
            for name in ("a.gltf", "a.glb", "a.obj", "a.ply", "a.stl", "a.nff"):
                with self.subTest(name=name):
                    body, headers = form([(n, files[n]) for n in (name, *names.get(name, []))])
                    called = daemon.request("POST", "/v1/render?width=24&height=16", body, headers)
                    self.assertEqual(called.status, 200, called.body[:500])
                    pictures[name] = called.body
                    self.tessera("render", name, "--size", "24x16", "-o", "out.png", server=daemon.url)
                    self.assertEqual(self.read("out.png"), called.body)
                    # A document that says the same of the file, as a blob and below the asset root.
                    for content in files.values():
                        digest = "sha256:" + hashlib.sha256(content).hexdigest()
                        self.assertIn(daemon.request("PUT", "/v1/blobs/" + digest, content).status, (200, 201, 204))
                    blob = {"blob": "sha256:" + hashlib.sha256(files[name]).hexdigest(),
                            "format": {"a.glb": "gltf"}.get(name, name[2:]),
                            "companions": {n: "sha256:" + hashlib.sha256(files[n]).hexdigest() for n in names.get(name, [])}}
                    for file in (blob, {"path": name}):
                        scene = {"objects": [{"type": "file", **file}]}
                        job = {"scene": scene, "image": {"width": 24, "height": 16},
                               "settings": {"until": {"error": 0.02, "samples": 256}}}
                        look = "tone_map=khronos_pbr_neutral"
                        if name != "a.nff":
                            studio = {"type": "environment", "preset": "studio", "only_without_lights": True}
                            scene.update({"lights": [studio], "ground": "shadow"})
                            job["camera"] = {"type": "perspective", "azimuth": 30, "elevation": 20, "fov": 30}
                            job["settings"]["transparent"] = True
                            look += "&background=white"
                        submitted = daemon.submit(job)
                        daemon.wait_ended(submitted)
                        image = daemon.request("GET", f"/v1/jobs/{submitted}/image?{look}")
                        self.assertEqual(image.body, called.body)
            self.assertEqual(pictures["a.gltf"], pictures["a.glb"])

    def test_a_model_is_seen_as_the_options_say(self):
        with open(os.path.join(self.folder, "a.glb"), "wb") as file:
            file.write(self_contained(GLTF, CORNERS))
        with open(os.path.join(self.folder, "a.glb"), "rb") as file:
            body = file.read()
        self.write("scene.json", SPHERE)
        common = "width=12&height=8&samples=4"
        for options, query in (
            ("--camera behind", "camera=behind"),
            ("--camera 0", "camera=0"),
            ("--azimuth -40 --elevation 90 --fov 20", "azimuth=-40&elevation=90&fov=20"),
            ("--environment 1,0.5,0.25 --background environment", "environment=1,0.5,0.25&background=environment"),
            ("--environment studio --background 00ff7f --no-ground", "environment=studio&background=00ff7f&ground=none"),
            ("--up z --tone-map aces --exposure 1", "up=z&tone_map=aces&exposure=1"),
            ("--transparent", "background=transparent"),
        ):
            with self.subTest(options=options):
                called = self.daemon.request("POST", f"/v1/render?{common}&{query}", body)
                self.assertEqual(called.status, 200, called.body)
                self.tessera("render", "a.glb", "--size", "12x8", "--samples", "4", *options.split())
                self.assertEqual(self.read("out.png"), called.body)
        self.tessera("render", "a.glb", "--size", "12x8", "--samples", "4", "-o", "out.jpg")
        called = self.daemon.request("POST", f"/v1/render?{common}&format=jpeg", body)
        self.assertEqual(self.read("out.jpg"), called.body)
        for wrong in (["a.glb", "--azimuth", "400"], ["scene.json", "--azimuth", "4"], ["scene.json", "--up", "z"],
                      ["a.glb", "--background", "black", "-o", "a.exr"],
                      ["a.glb", "--background", "environment", "--transparent"]):
            self.tessera("render", *wrong, code=USAGE)
        self.tessera("render", "a.glb", "--environment", "gone.hdr", code=LOCAL_FILE)
        refused = self.tessera("render", "a.glb", "--camera", "none", code=REFUSED)
        self.assertIn('0 ("behind")', refused.stderr)

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
            self.assertIn("-3 isn't a whole number", refused.stderr)
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


    def test_arguments_that_are_too_many_stand_in_their_order(self):
        for arguments in (["list", "b", "a"], ["fetch", "id", "-o", "x.png", "b", "a"]):
            self.assertIn("too much was given: b a;", self.tessera(*arguments, code=USAGE).stderr)

    def test_errors_as_json(self):
        scene = self.write("s.json", SPHERE)
        broken = self.write("broken.json", {"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": -1}]})
        for arguments, code, kind in (
            (["render"], USAGE, "usage"),
            (["paint"], USAGE, "usage"),
            (["render", scene, "--size", "12"], USAGE, "usage"),
            (["submit", broken], REFUSED, "refused"),
            (["plan", "none"], REFUSED, "refused"),
            (["list", "--server", "http://127.0.0.1:1"], UNREACHABLE, "unreachable"),
            (["render", "gone.json"], LOCAL_FILE, "local_file"),
        ):
            done = self.tessera(*arguments, "--json", code=code)
            self.assertEqual(done.stdout, "", arguments)
            error = json.loads(done.stderr)["error"]
            self.assertEqual(error["kind"], kind, arguments)
            self.assertTrue(error["message"], arguments)
            if arguments == ["submit", broken]:
                self.assertEqual(error["code"], "invalid_document")
                self.assertEqual(error["errors"][0]["pointer"], "/scene/objects/0/radius")
            else:
                self.assertEqual(error["errors"], [], arguments)
        job = self.submit_endless()
        self.tessera("cancel", job)
        error = json.loads(self.tessera("watch", job, "--json", code=JOB_FAILED).stderr)["error"]
        self.assertEqual((error["kind"], error["job"]), ("job", job))

    def test_stdout_that_cant_be_written(self):
        job = self.submit(SPHERE, "--size", "8x8")
        self.tessera("watch", job)
        scene = self.write("s.json", SPHERE)
        for arguments in (
            ["list"], ["list", "--json"], ["plan", job], ["stats", job, "--json"], ["capabilities"], ["watch", job, "--json"],
            ["--help"], ["render", "--help"], ["--version"], ["submit", scene], ["render", scene, "--size", "8x8"],
            ["fetch", job, "-o", "-"],
        ):
            with self.subTest(arguments=arguments), open("/dev/full", "w") as full:
                done = self.tessera(*arguments, code=LOCAL_FILE, stdout=full)
                self.assertRegex(done.stderr, "can't write .*stdout: No space left")
        closed = self.tessera("list", code=LOCAL_FILE, stdout=None, preexec_fn=lambda: os.close(1))
        self.assertIn("can't write to stdout", closed.stderr)
        self.tessera("cancel", job, code=REFUSED, stdout=None, preexec_fn=lambda: os.close(1))

    def test_a_reader_that_has_gone_is_no_news(self):
        for arguments in (["list"], ["capabilities", "--json"], ["--help"]):
            reader, writer = os.pipe()
            os.close(reader)
            done = self.tessera(*arguments, code=READER_HAS_GONE, stdout=writer)
            os.close(writer)
            self.assertEqual(done.stderr, "")

    def test_images_that_cant_be_written_leave_nothing(self):
        job = self.submit(SPHERE, "--size", "64x64")
        self.tessera("watch", job)
        self.write("old.png", "old")
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
        for name in ("old.png", "new.png"):
            done = self.tessera("fetch", job, "-o", name, code=LOCAL_FILE, preexec_fn=limit)
            self.assertIn(f"can't write {name}: ", done.stderr)
        self.assertEqual(self.read("old.png"), b"old")
        self.assertNotIn("new.png", os.listdir(self.folder))
        self.assertFalse([name for name in os.listdir(self.folder) if ".part" in name])

    def test_names_of_others_cant_act_on_a_terminal(self):
        name = "a\x1b]0;x\x07b\x7fc\u009b31md\u202ee\u2028f"
        job = self.daemon.submit({"scene": SPHERE, "name": name, "image": {"width": 4, "height": 4}})
        (line,) = [line for line in self.tessera("list").stdout.splitlines() if line.startswith(job)]
        self.assertTrue(line.endswith("a?]0;x?b?c?31md?e?f"), line)
        text = self.tessera("list", "--json").stdout
        self.assertTrue(text.isascii())
        self.assertNotRegex(text, HIDDEN_CONTROL)
        (row,) = [row for row in json.loads(text) if row["id"] == job]
        self.assertEqual(row["name"], name)
        self.write("s.json", {"objects": [{"type": "file", "path": "x\x1b[2J.ply"}], "a\x1b[2J": 1})
        for arguments in (["submit", "s.json"], ["plan", "x\x1b[2J"], ["render", "x\x1b[2J.json"], ["x\x1b[2J"]):
            done = subprocess.run([os.environ["TESSERA"], *arguments], cwd=self.folder, env=self.environment(None),
                                  capture_output=True, text=True, timeout=120, check=False)
            self.assertNotEqual(done.returncode, OK)
            self.assertNotRegex(done.stderr, HIDDEN_CONTROL)

    def test_messages_speak_of_options(self):
        job = self.submit(SPHERE, "--size", "8x8")
        self.tessera("watch", job)
        self.write("by_hash.json", {"scene": "sha256:" + "0" * 64})
        self.write("by_blob.json", {"objects": [{"type": "file", "format": "ply", "blob": "sha256:" + "0" * 64}]})
        self.write("by_path.json", {"objects": [{"type": "file", "path": "gone.ply"}]})
        for arguments in (
            ["fetch", job, "-o", "a.png", "--aov", "depth"], ["fetch", job, "-o", "a.png", "--aov", "none"],
            ["fetch", job, "-o", "a.png", "--aov", "all"],
            ["plan", "none"], ["stats", "none"], ["cancel", job], ["watch", "none"], ["delete", "none"],
            ["submit", "by_hash.json"], ["submit", "by_blob.json"], ["submit", "by_path.json"],
        ):
            told = self.tessera(*arguments, code=REFUSED).stderr
            self.assertNotRegex(told, r"/v1/|\?[a-z]+=|\b(GET|PUT|POST|DELETE|HTTP)\b|image/|/settings/aovs|by blob", arguments)
        before = self.tessera("list").stdout  # A wrong format is noticed before anything is rendered.
        self.tessera("render", "by_hash.json", "-o", "a", "--format", "bmp", code=USAGE)
        self.assertEqual(self.tessera("list").stdout, before)


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
