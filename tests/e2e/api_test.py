"""The way of a scene over HTTP: in, rendered, watched, fetched."""

import hashlib
import math
import os
import re
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor

from daemon import SOURCE, Daemon
from documents import SMALL_JOB, SPHERE, endless_job, keep_busy
from pictures import decode_png

STARTS = {"png": b"\x89PNG\r\n\x1a\n", "jpeg": b"\xff\xd8\xff", "exr": b"\x76\x2f\x31\x01", "hdr": b"#?RADIANCE", "tiff": b"II*\x00"}
MEDIA_TYPES = {"png": "image/png", "jpeg": "image/jpeg", "exr": "image/x-exr", "hdr": "image/vnd.radiance", "tiff": "image/tiff"}
ALL_AOVS = ["depth", "normal", "primitive_id", "object_id", "cost_volumes", "cost_primitives", "albedo", "position",
            "alpha", "sample_count", "variance", "base_color"]
QUAD = "o quad\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n"


def content_hash(data):
    return "sha256:" + hashlib.sha256(data).hexdigest()


def shape(picture):
    return picture.width, picture.height, picture.depth, picture.channels


class ApiTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.assets = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.assets.cleanup)
        cls.daemon = Daemon("--threads", "2", "--asset-root", cls.assets.name)
        cls.addClassCleanup(cls.daemon.stop)

    def render(self, job):
        job_id = self.daemon.submit(job)
        status = self.daemon.wait_ended(job_id)
        self.assertEqual(status["state"], "completed", status)
        return job_id

    def get(self, path, headers=None, status=200):
        reply = self.daemon.request("GET", path, headers=headers)
        self.assertEqual(reply.status, status, reply.body[:300])
        return reply

    def test_a_scene_by_hash_and_the_same_inline(self):
        posted = self.daemon.request("POST", "/v1/scenes", SPHERE)
        self.assertIn(posted.status, (200, 201))
        self.assertEqual(posted.headers["Location"], "/v1/scenes/" + posted.json()["scene"])
        self.assertEqual(self.get(posted.headers["Location"]).json(), posted.json())
        self.assertEqual((posted.json()["objects"], posted.json()["primitives"]), (1, 1))
        by_hash = self.render({**SMALL_JOB, "scene": posted.json()["scene"]})
        inline = self.render(SMALL_JOB)
        images = [self.get(f"/v1/jobs/{job}/image?format=exr").body for job in (by_hash, inline)]
        self.assertEqual(images[0], images[1])
        self.assertEqual(self.daemon.status(inline)["scene"], posted.json()["scene"])

    def test_a_charset_beside_the_media_type(self):
        headers = {"Content-Type": "Application/JSON; charset=utf-8"}
        reply = self.daemon.request("POST", "/v1/scenes", b'{"objects": []}', headers)
        self.assertIn(reply.status, (200, 201), reply.body)

    def test_files_by_blob_and_by_path(self):
        blob = QUAD.encode()
        stored = self.daemon.request("PUT", f"/v1/blobs/{content_hash(blob)}", blob)
        self.assertEqual((stored.status, stored.json()), (201, {"blob": content_hash(blob), "bytes": len(blob)}))
        with open(os.path.join(self.assets.name, "quad.obj"), "wb") as file:
            file.write(blob)
        answers = []
        for where in ({"blob": content_hash(blob), "format": "obj"}, {"path": "quad.obj"}):
            reply = self.daemon.request("POST", "/v1/scenes", {"objects": [{"type": "file", **where}]})
            self.assertIn(reply.status, (200, 201), reply.body)
            answers.append(reply.json())
        self.assertEqual([answer["primitives"] for answer in answers], [2, 2])

    def test_an_nff_file_sizes_the_image_unless_the_job_does(self):
        with open(os.path.join(self.assets.name, "ball.nff"), "w", encoding="ascii") as file:
            file.write("v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 1\nresolution 24 16\nl 5 5 5\ns 0 0 0 1\n")
        scene = {"objects": [{"type": "file", "path": "ball.nff"}]}
        by_hash = self.daemon.request("POST", "/v1/scenes", scene).json()["scene"]
        for named in (scene, by_hash):
            status = self.daemon.status(self.render({"scene": named}))
            self.assertEqual((status["width"], status["height"]), (24, 16))
            status = self.daemon.status(self.render({"scene": named, "image": {"width": 8, "height": 9}}))
            self.assertEqual((status["width"], status["height"]), (8, 9))
            refused = self.daemon.request("POST", "/v1/jobs", {"scene": named, "settings": {"samples": 4294967295}})
            self.assertEqual(refused.status, 422, refused.body)
            self.assertEqual(refused.json()["errors"][0]["pointer"], "/settings/samples")

    def test_a_large_upload_waits_for_100_continue(self):
        blob = os.urandom(3 << 20)
        with tempfile.NamedTemporaryFile() as file:
            file.write(blob)
            file.flush()
            url = f"{self.daemon.url}/v1/blobs/{content_hash(blob)}"
            curl = ["curl", "-sS", "-o", os.devnull, "-w", "%{http_code}", "-H", "Expect: 100-continue", "-T", file.name]
            for length in ([], ["-H", "Transfer-Encoding: chunked"]):
                done = subprocess.run([*curl, *length, url], capture_output=True, text=True, check=True, timeout=60)
                self.assertEqual(done.stdout, "200" if length else "201")

    def test_formats_by_query_and_by_accept(self):
        job = self.render({**SMALL_JOB, "settings": {"aovs": ALL_AOVS}})
        image = f"/v1/jobs/{job}/image"
        tags = set()
        colored = {name: media_type for name, media_type in MEDIA_TYPES.items() if name != "tiff"}  # For depths alone.
        for name, media_type in colored.items():
            by_query = self.get(f"{image}?format={name}", {"Accept": "text/html"})
            by_accept = self.get(image, {"Accept": f"text/html;q=0.9, {media_type};q=0.5, */*;q=0.1"})
            self.assertEqual((by_query.media_type, by_accept.media_type), (media_type, media_type))
            self.assertTrue(by_query.body.startswith(STARTS[name]), name)
            # The tag isn't the hash of the bytes, so that a 304 needn't make them; equal tags are equal bytes.
            self.assertEqual(by_query.headers["ETag"], by_accept.headers["ETag"])
            self.assertEqual(by_query.body, by_accept.body)
            tags.add(by_query.headers["ETag"])
        self.assertEqual(len(tags), len(colored))
        self.assertEqual(self.get(image).media_type, "image/png")
        self.assertEqual(self.get(image, {"Accept": "image/*, image/png;q=0"}).media_type, "image/jpeg")
        self.get(image, {"Accept": "image/webp"}, status=406)
        self.get(f"{image}?format=webp", status=400)

    def test_aovs(self):
        job = self.render({**SMALL_JOB, "settings": {"aovs": ALL_AOVS}})
        for aov in [*ALL_AOVS, "all"]:
            exr = self.get(f"/v1/jobs/{job}/image?aov={aov}&format=exr").body
            self.assertTrue(exr.startswith(STARTS["exr"]), aov)
        self.assertEqual(self.get(f"/v1/jobs/{job}/image?aov=all").media_type, "image/x-exr")
        self.get(f"/v1/jobs/{job}/image?aov=all&format=png", status=406)
        for aov in ("depth", "normal", "primitive_id", "object_id"):  # Infinite, negative, or to be exact: not in RGBE.
            refused = self.get(f"/v1/jobs/{job}/image?aov={aov}&format=hdr", status=406).json()
            self.assertIn("comes as png (image/png), jpeg (image/jpeg), exr (image/x-exr)", refused["detail"])
            self.get(f"/v1/jobs/{job}/image?aov={aov}", {"Accept": "image/vnd.radiance"}, status=406)
        self.get(f"/v1/jobs/{job}/image?aov=warmth", status=400)
        plain = self.render(SMALL_JOB)
        self.get(f"/v1/jobs/{plain}/image?aov=depth", status=404)

    def test_an_image_that_is_known_isnt_sent_again(self):
        image = f"/v1/jobs/{self.render(SMALL_JOB)}/image"
        tag = self.get(image).headers["ETag"]
        for known in (tag, f'"other", W/{tag}', "*"):
            self.assertEqual(self.get(image, {"If-None-Match": known}, status=304).body, b"")
        self.get(image, {"If-None-Match": '"other"'})
        self.get(f"{image}?format=jpeg", {"If-None-Match": tag})

    def test_a_complete_image_may_be_kept_for_good(self):
        image = f"/v1/jobs/{self.render(SMALL_JOB)}/image"
        reply = self.get(image)
        self.assertEqual(reply.headers["Cache-Control"], "private, max-age=31536000, immutable")
        known = self.get(image, {"If-None-Match": reply.headers["ETag"]}, status=304)
        self.assertEqual(known.headers["Cache-Control"], reply.headers["Cache-Control"])

    def test_parts_of_an_image(self):
        image = f"/v1/jobs/{self.render(SMALL_JOB)}/image"
        first = self.get(image, {"Range": "bytes=0-7"}, status=206)  # Encoded for this.
        self.assertEqual(first.body, b"\x89PNG\r\n\x1a\n")
        whole = self.get(image)
        self.assertEqual(whole.headers["Accept-Ranges"], "bytes")
        size, tag = len(whole.body), whole.headers["ETag"]
        self.assertEqual(first.headers["Content-Range"], f"bytes 0-7/{size}")
        self.assertEqual((first.headers["ETag"], first.headers["Content-Length"]), (tag, "8"))
        pieces = [self.get(image, {"Range": f"bytes={at}-{at + 9}", "If-Range": tag}, status=206).body
                  for at in range(0, size, 10)]
        self.assertEqual(b"".join(pieces), whole.body)
        self.assertEqual(self.get(image, {"Range": "bytes=-12"}, status=206).body, whole.body[-12:])  # IEND

        reply = self.get(image, {"Range": f"bytes={size}-"}, status=416)
        self.assertEqual((reply.headers["Content-Range"], reply.json()["code"]),
                         (f"bytes */{size}", "range_not_satisfiable"))
        for headers in ({"Range": "bytes=0-1,4-5"}, {"Range": "bytes=5-4"}, {"Range": "pixels=0-1"},
                        {"Range": "bytes=0-1", "If-Range": '"other"'}, {"Range": "bytes=0-1", "If-Range": "W/" + tag}):
            self.assertEqual(self.get(image, headers).body, whole.body)
        self.get(image, {"Range": "bytes=0-1", "If-None-Match": tag}, status=304)  # It comes first: RFC 9110, 13.2.2.
        head = self.daemon.request("HEAD", image, headers={"Range": "bytes=0-1"})
        self.assertEqual((head.status, head.headers["Content-Length"], head.headers["Accept-Ranges"]),
                         (200, str(size), "bytes"))

        running = self.daemon.submit(endless_job())
        self.daemon.wait_until(running, lambda status: "eta" in status)
        reply = self.get(f"/v1/jobs/{running}/image?partial=1", {"Range": "bytes=0-1"})  # It is another one each time.
        self.assertNotIn("Accept-Ranges", reply.headers)
        self.daemon.request("POST", f"/v1/jobs/{running}/cancel")

    def test_head_is_get_without_the_body(self):
        image = f"/v1/jobs/{self.render(SMALL_JOB)}/image"
        before = self.daemon.request("HEAD", image)
        full = self.get(image)
        after = self.daemon.request("HEAD", image)
        for head in (before, after):
            self.assertEqual((head.status, head.body), (200, b""))
            for name in ("ETag", "Content-Type", "Vary", "Cache-Control"):
                self.assertEqual(head.headers[name], full.headers[name])
        self.assertIsNone(before.headers["Content-Length"], "it isn't encoded to be measured (RFC 9110, 9.3.2)")
        self.assertEqual(after.headers["Content-Length"], full.headers["Content-Length"])

    def test_an_image_is_encoded_once_and_only_to_be_sent(self):
        with Daemon("--log-level", "debug") as daemon:
            encoded = lambda least=0: daemon.count_in_log(": encoded as ", least)
            job = daemon.submit({**SMALL_JOB, "image": {"width": 800, "height": 800}})
            daemon.wait_ended(job)
            image = f"/v1/jobs/{job}/image"
            tag = daemon.request("HEAD", image).headers["ETag"]
            for known in (tag, f'W/{tag}, "other"', "*"):
                self.assertEqual(daemon.request("GET", image, headers={"If-None-Match": known}).status, 304)
                self.assertEqual(daemon.request("HEAD", image, headers={"If-None-Match": known}).status, 304)
            self.assertEqual(encoded(), 0)
            with ThreadPoolExecutor(30) as pool:
                replies = list(pool.map(lambda _: daemon.request("GET", image), range(30)))
            self.assertEqual({reply.headers["ETag"] for reply in replies}, {tag})
            self.assertEqual(len({reply.body for reply in replies}), 1)
            self.assertEqual(encoded(1), 1)
            daemon.request("GET", f"{image}?format=jpeg&quality=50")
            daemon.request("GET", f"{image}?format=jpeg&quality=51")
            self.assertEqual(encoded(3), 3)

    def test_a_jpeg_as_good_as_asked_for(self):
        image = f"/v1/jobs/{self.render({**SMALL_JOB, 'image': {'width': 64, 'height': 64}})}/image"
        for query, sampling in (("", 0x11), ("&quality=90", 0x11), ("&quality=89", 0x22), ("&subsampling=4:2:2", 0x21),
                                ("&quality=100&subsampling=4:2:0", 0x22), ("&quality=1&subsampling=4:4:4", 0x11)):
            body = self.get(f"{image}?format=jpeg{query}").body
            frame = body.index(b"\xff\xc0")  # Baseline: length, depth, height, width, 3 components of id, sampling, table.
            self.assertEqual(body[frame + 9], 3)
            self.assertEqual(body[frame + 11], sampling, query)
        tags = {self.get(f"{image}?format=jpeg{query}").headers["ETag"] for query in ("", "&quality=80", "&subsampling=4:2:0")}
        self.assertEqual(len(tags), 3)
        for query, pointer in (("quality=0&format=jpeg", "?quality"), ("quality=80", "?quality"),
                               ("quality=80&format=png", "?quality"), ("subsampling=4:4:0&format=jpeg", "?subsampling"),
                               ("subsampling=4:4:4&format=exr", "?subsampling")):
            self.assertEqual(self.get(f"{image}?{query}", status=400).json()["errors"][0]["pointer"], pointer)

    def test_exposure_and_tone_map(self):
        image = f"/v1/jobs/{self.render(SMALL_JOB)}/image"
        plain = self.get(image)
        self.assertEqual(self.get(f"{image}?exposure=0&tone_map=none").headers["ETag"], plain.headers["ETag"])
        seen = {plain.headers["ETag"]: plain.body}
        for query in ("exposure=-1", "exposure=1.5", "tone_map=aces", "tone_map=khronos_pbr_neutral&exposure=-1",
                      "format=jpeg&tone_map=aces"):
            reply = self.get(f"{image}?{query}")
            seen[reply.headers["ETag"]] = reply.body
            self.assertEqual(self.get(f"{image}?{query}").body, reply.body)
        self.assertEqual(len(seen), 6)
        self.assertEqual(len(set(seen.values())), 6)
        single, half = (self.get(f"{image}?format=exr&precision={precision}") for precision in ("float", "half"))
        self.assertEqual(self.get(f"{image}?format=exr").body, single.body)
        self.assertNotEqual(single.headers["ETag"], half.headers["ETag"])
        self.assertLess(len(half.body), len(single.body))
        for query, pointer in (("exposure=65", "?exposure"), ("exposure=dark", "?exposure"), ("tone_map=hable", "?tone_map"),
                               ("exposure=1&format=exr", "?exposure"), ("tone_map=aces&format=hdr", "?tone_map"),
                               ("precision=half", "?precision"), ("precision=quarter&format=exr", "?precision")):
            self.assertEqual(self.get(f"{image}?{query}", status=400).json()["errors"][0]["pointer"], pointer)

    def test_a_transparent_background(self):
        image = f"/v1/jobs/{self.render({**SMALL_JOB, 'settings': {'transparent': True}})}/image"
        picture = decode_png(self.get(image).body)
        self.assertEqual(shape(picture), (16, 16, 8, 4))  # with alpha
        self.assertEqual(picture.at(0, 0), (0, 0, 0, 0), "the sphere doesn't reach the corner")
        self.assertIn(b"A\0", self.get(f"{image}?format=exr").body[:300])
        self.assertTrue(self.get(f"{image}?aov=alpha&format=exr").body)
        for opaque in (f"{image}?format=jpeg", f"{image}?format=hdr"):
            self.get(opaque)
        picture = decode_png(self.get(f"/v1/jobs/{self.render(SMALL_JOB)}/image").body)
        self.assertEqual(shape(picture), (16, 16, 8, 3))

    def test_an_environment_by_path_and_by_hash(self):
        with open(os.path.join(SOURCE, "tests/data/documents/files/sky.hdr"), "rb") as file:
            sky = file.read()
        with open(os.path.join(self.assets.name, "sky.hdr"), "wb") as file:
            file.write(sky)
        self.assertEqual(self.daemon.request("PUT", f"/v1/blobs/{content_hash(sky)}", sky).status, 201)
        ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "chrome"}
        images = []
        for named in ({"path": "sky.hdr"}, {"blob": content_hash(sky)}):
            scene = {"objects": [ball], "materials": {"chrome": {"type": "conductor", "metal": "chromium"}},
                     "lights": [{"type": "environment", **named}]}
            job = self.daemon.submit({"scene": scene, "image": {"width": 16, "height": 16}})
            status = self.daemon.wait_ended(job)
            self.assertEqual(status["state"], "completed", status)
            images.append((status["scene"], self.get(f"/v1/jobs/{job}/image?format=exr").body))
        self.assertEqual(images[0], images[1])

    def test_images_that_are_too_wide_for_a_format(self):
        for width, height, jpeg in ((65500, 1, 200), (65501, 1, 406), (1, 65501, 406)):
            job = self.render({"scene": SPHERE, "image": {"width": width, "height": height},
                               "settings": {"tile_size": "whole", "aovs": ["normal"]}})
            for query in ("", "&aov=normal", "&partial=1"):
                reply = self.get(f"/v1/jobs/{job}/image?format=jpeg{query}", status=jpeg)
                if jpeg == 406:
                    self.assertIn("png (image/png), exr (image/x-exr)", reply.json()["detail"])
            self.assertEqual(self.get(f"/v1/jobs/{job}/image", {"Accept": "image/jpeg;q=1, */*;q=0.1"}).media_type,
                             "image/jpeg" if jpeg == 200 else "image/png")

    def test_a_png_of_more_than_a_million_columns(self):
        """libpng's own limit is a million; a PNG's is 2^31 - 1."""
        for width, height in ((1_000_001, 1), (1, 1_000_001)):
            job = self.render({"scene": SPHERE, "image": {"width": width, "height": height},
                               "settings": {"tile_size": "whole"}})
            picture = decode_png(self.get(f"/v1/jobs/{job}/image").body)
            self.assertEqual(shape(picture), (width, height, 8, 3))

    def test_an_unfinished_image_shows_what_is_there(self):
        job = self.daemon.submit(endless_job())
        status = self.daemon.wait_until(job, lambda status: "eta" in status)
        self.assertGreater(status["eta"], 0)
        self.assertLess(status["tiles_done"], status["tiles_total"])
        self.assertIn("partial=1", self.get(f"/v1/jobs/{job}/image", status=409).json()["detail"])
        reply = self.get(f"/v1/jobs/{job}/image?partial=1")
        self.assertEqual(reply.headers["Cache-Control"], "no-store")
        self.assertEqual(shape(decode_png(reply.body)), (16, 16000, 8, 4))  # with alpha
        canceled = self.daemon.request("POST", f"/v1/jobs/{job}/cancel")
        self.assertEqual((canceled.status, canceled.json()["state"]), (202, "canceled"))
        self.get(f"/v1/jobs/{job}/image?partial=1")
        self.assertIn("partial=1", self.get(f"/v1/jobs/{job}/image", status=409).json()["detail"])

    def test_an_image_that_isnt_begun_is_not_promised(self):
        with Daemon("--threads", "1") as daemon:
            keep_busy(daemon)
            waiting = daemon.submit({**endless_job(), "priority": "low"})
            reply = daemon.request("GET", f"/v1/jobs/{waiting}/image")
            self.assertEqual(reply.status, 409)
            self.assertNotIn("partial=1", reply.json()["detail"])

    def test_plan_and_stats_count_the_same(self):
        far_left = {"scene": {**SPHERE, "camera": {"type": "perspective", "from": [3, 0, 9], "at": [3, 0, 0], "fov": 60}}}
        job = self.render({**far_left, "image": {"width": 64, "height": 64}, "settings": {"tile_size": 8, "samples": 2}})
        plan = self.get(f"/v1/jobs/{job}/plan").json()
        stats = self.get(f"/v1/jobs/{job}/stats").json()
        self.assertEqual(plan["tiles"]["count"], 64)
        self.assertGreater(plan["tiles"]["empty"], 0)
        self.assertEqual(stats["skipped"]["tiles"], plan["tiles"]["empty"])
        self.assertEqual(stats["rays"]["camera"], plan["camera_rays"])
        self.assertEqual(stats["rays"]["camera"] + stats["skipped"]["camera_rays"], 64 * 64 * 2)
        self.assertIs(stats["structure"]["shared"], False)
        self.assertGreater(stats["mrays_per_second"], 0)
        status = self.daemon.status(job)
        self.assertEqual((status["tiles_done"], status["samples_done"]), (64, 64 * 64 * 2))

    def test_rays_of_all_kinds_make_the_total(self):
        for integrator in ["whitted", "direct", "path", "ambient_occlusion", "none"]:
            with self.subTest(integrator):
                scene = {"objects": SPHERE["objects"], "background": [1, 1, 1]}
                settings = {"integrator": integrator, "samples": 4, "count_tests": True}
                job = self.render({"scene": scene, "image": {"width": 16, "height": 16}, "settings": settings})
                stats = self.get(f"/v1/jobs/{job}/stats").json()
                rays = stats["rays"]
                kinds = ["camera", "reflection", "refraction", "shadow", "scattered"]
                self.assertEqual(rays["total"], sum(rays[kind] for kind in kinds))
                self.assertEqual(stats["tests"]["rays"], rays["total"])
                # Under a bright sky, a path goes on from what it meets.
                self.assertEqual(rays["scattered"] > 0, integrator in ["direct", "path"])

    def test_a_scene_is_framed_whatever_the_images_aspect(self):
        cameras = [{}, {"camera": {"type": "orthographic"}}, {"camera": {"type": "perspective", "direction": [1, 0, 1]}}]
        for camera in cameras:
            for width, height in [(100, 400), (400, 100), (100, 100)]:
                with self.subTest(f"{camera}, {width} x {height}"):
                    job = self.render({"scene": SPHERE, "image": {"width": width, "height": height}, **camera})
                    hits = self.get(f"/v1/jobs/{job}/stats").json()["rays"]["camera_hits"]
                    # A sphere's disc that leaves 4% of 100 pixels free on either side.
                    self.assertAlmostEqual(hits / (math.pi * 46**2), 1, delta=0.03)

    def test_where_nothing_projects_nothing_is_built(self):
        camera = {"type": "perspective", "from": [0, 0, 9], "at": [0, 0, 99], "fov": 60}
        job = self.render({**SMALL_JOB, "camera": camera})
        plan = self.get(f"/v1/jobs/{job}/plan").json()
        stats = self.get(f"/v1/jobs/{job}/stats").json()
        self.assertIs(plan["accel"]["is_built"], False)
        self.assertIn("structure", [skip["what"] for skip in plan["skips"]])
        self.assertIsNone(stats["structure"])
        self.assertIsNone(stats["mrays_per_second"])
        self.assertEqual(stats["rays"]["total"], 0)
        self.assertEqual(stats["skipped"]["objects_never_tested"], 1)

    def test_listing_by_pages_and_by_state(self):
        with Daemon("--threads", "1") as daemon:
            ids = [daemon.submit({**SMALL_JOB, "name": str(i)}) for i in range(5)]
            for job in ids:
                daemon.wait_ended(job)
            listed, page = [], "/v1/jobs?limit=2"
            while page:
                reply = daemon.request("GET", page).json()
                listed += [job["id"] for job in reply["jobs"]]
                page = "next" in reply and f"/v1/jobs?limit=2&after={reply['next']}"
            self.assertEqual(listed, ids)
            listed, page = [], "/v1/jobs?limit=2&state=completed"
            while page:
                reply = daemon.request("GET", page)
                listed += [job["id"] for job in reply.json()["jobs"]]
                link = re.fullmatch('<(/[^>]*)>; rel="next"', reply.headers.get("Link", ""))  # RFC 8288
                self.assertEqual(bool(link), "next" in reply.json())
                page = link and link[1]
            self.assertEqual(listed, ids)
            self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{ids[1]}").status, 204)
            after_deleted = daemon.request("GET", f"/v1/jobs?after={ids[1]}").json()
            self.assertEqual([job["id"] for job in after_deleted["jobs"]], ids[2:])
            self.assertEqual(daemon.request("GET", "/v1/jobs?state=failed").json(), {"jobs": []})
            self.assertEqual(len(daemon.request("GET", "/v1/jobs?state=completed").json()["jobs"]), 4)

    def test_scenes_and_blobs_outlive_a_restart(self):
        with tempfile.TemporaryDirectory() as folder:
            blob = QUAD.encode()
            with Daemon(data_dir=folder) as daemon:
                daemon.request("PUT", f"/v1/blobs/{content_hash(blob)}", blob)
                scene = {"objects": [{"type": "file", "blob": content_hash(blob), "format": "obj"}]}
                posted = daemon.request("POST", "/v1/scenes", scene).json()
            with Daemon(data_dir=folder) as daemon:
                self.assertEqual(daemon.request("GET", f"/v1/scenes/{posted['scene']}").json(), posted)
                job = daemon.submit({"scene": posted["scene"], "image": {"width": 8, "height": 8}})
                self.assertEqual(daemon.wait_ended(job)["state"], "completed")


if __name__ == "__main__":
    unittest.main()
