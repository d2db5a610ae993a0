"""The daemon over HTTP: Drake's door beside Blender, thumbnails beside Chromium, known scenes, a file of 100 MB.

tests/bench serve [--quick] [--parts A,B]
A part is "drake", "thumbnails", "views", "known" or "large". --quick takes fewer turns and a smaller file. Blender, and
Chromium with model-viewer, are measured where they are installed (deploy/install-deps --bench; npm brings model-viewer).
The pictures that were measured lie in build/release/bench/serve.
"""

import argparse
import http.client
import os
import pathlib
import shutil
import statistics
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "e2e"))

from daemon import SHARED_DATA, Daemon  # noqa: E402
from support import http_load, processes  # noqa: E402
from support.bench_report import Report, print_table, quantile, three_digits, with_spread  # noqa: E402
from support.blender import BlenderServer  # noqa: E402
from support.chromium import Chromium, install_model_viewer  # noqa: E402
from support.drake_forms import form, moved_scene  # noqa: E402
from support.glb_files import packed, terrain  # noqa: E402

PARTS = ["drake", "thumbnails", "views", "known", "large"]
BOXES = pathlib.Path(SHARED_DATA, "drake", "two_rgba_boxes.gltf")
HELMET = pathlib.Path(SHARED_DATA, "gltf", "FlightHelmet", "FlightHelmet.gltf")

DRAKE_SAMPLES = 16  # Of colour, which is also what the door takes by itself.
THUMBNAIL_SIDE = 512
THUMBNAIL_SAMPLES = 64
MEGABYTE = 1e6


class Turns:
    """How often things are measured."""

    def __init__(self, is_quick):
        self.drake, self.drake_ours = (2, 5) if is_quick else (9, 20)
        self.cold, self.thumbnails = (1, 2) if is_quick else (3, 7)
        self.views = 50 if is_quick else 1000
        self.known = 2000 if is_quick else 20000
        self.large, self.large_bytes = (1, 20e6) if is_quick else (3, 100e6)


def is_there(what, path):
    if path.exists():
        return True
    print(f"{what}: skipped, for there is no {path} (check the shared data out, or set TESSERA_SHARED_DATA)")
    return False


def has_program(program):
    if shutil.which(program):
        return True
    print(f"{program.capitalize()} is missing (deploy/install-deps --bench brings it): Tessera is measured alone.")
    return False


class Client:
    """A connection that is kept; the answer to each POST, and how long it took."""

    def __init__(self, port):
        self._connection = http.client.HTTPConnection("127.0.0.1", port, timeout=600)

    def post(self, path, body, headers):
        begin = time.perf_counter()
        self._connection.request("POST", path, body, headers)
        response = self._connection.getresponse()
        answer = response.read()
        seconds = time.perf_counter() - begin
        if response.status != 200:
            raise RuntimeError(f"POST {path} is answered with {response.status}: {answer[:500].decode(errors='replace')}")
        return answer, response.headers, seconds


def latencies(seconds):
    return [three_digits(1e3 * quantile(seconds, share)) for share in (0.5, 0.99)]


def numbers(seconds):
    return {"median": statistics.median(seconds), "p99": quantile(seconds, 0.99), "n": len(seconds)}


def measure_drake(report, turns):
    """Every request is of a scene that has moved: both read it anew."""
    if not is_there("drake", BOXES):
        return
    blender = BlenderServer(DRAKE_SAMPLES) if has_program("blender") else None
    figures = report.figures["drake"] = {}
    rows = [["640 x 480, every scene a new one", "p50 ms", "p99 ms", "Blender ms", "Blender / ours"]]
    steps = iter(range(1, 1 << 30))
    with Daemon("--drake") as daemon:
        ours, theirs = Client(daemon.port), Client(blender.port) if blender else None

        def post(client, kind, step):
            headers, body = form(moved_scene(BOXES, step), kind)
            return client.post("/render", body, headers)

        for kind, bound in (("color", 20), ("depth", 50), ("label", 50)):
            our_seconds, their_seconds, ratios = [], [], []
            for turn in range(turns.drake + 1):
                some = []
                for step in [next(steps) for _ in range(turns.drake_ours)]:
                    image, headers, seconds = post(ours, kind, step)
                    some.append(seconds)
                suffix = "tiff" if headers["Content-Type"].startswith("image/tiff") else "png"
                save(report, f"drake-{kind}.{suffix}", image)
                if theirs:
                    image, _, seconds = post(theirs, kind, step)
                    save(report, f"drake-{kind}-blender.png", image)
                if turn == 0:
                    continue  # The first one of a kind reads and compiles what the others find.
                our_seconds += some
                if theirs:
                    their_seconds.append(seconds)
                    ratios.append(seconds / statistics.median(some))
            figures[kind] = {"seconds": numbers(our_seconds)}
            rows.append([kind, *latencies(our_seconds)])
            report.plot(f"drake {kind}", statistics.median(our_seconds), "Tessera")
            if theirs:
                figures[kind] |= {"blender_seconds": numbers(their_seconds), "blender_over_ours": ratios}
                rows[-1] += [with_spread([1e3 * s for s in their_seconds]), with_spread(ratios)]
                report.plot(f"drake {kind}", statistics.median(their_seconds), "Blender")
                report.at_least(f"serve/drake/{kind}_over_blender", statistics.median(ratios), bound)
    if blender:
        blender.__exit__()
    print_table(rows)


def save(report, name, image):
    folder = report.folder / report.name
    folder.mkdir(exist_ok=True)
    (folder / name).write_bytes(image)


def timing(headers):
    """Server-Timing in seconds by name."""
    entries = [entry.split(";dur=") for entry in headers["Server-Timing"].split(", ")]
    return {name: 1e-3 * float(milliseconds) for name, milliseconds in entries}


def thumbnail_path(azimuth):
    side = THUMBNAIL_SIDE
    return f"/v1/render?width={side}&height={side}&samples={THUMBNAIL_SAMPLES}&azimuth={azimuth}"


GLB = {"Content-Type": "model/gltf-binary"}


def measure_thumbnails(report, turns):
    """FlightHelmet: the first picture of a fresh server, one of a model that is new to it, and a new view of one that
    isn't."""
    if not is_there("thumbnails", HELMET):
        return
    script = None
    if has_program("chromium"):
        script, why = install_model_viewer(report.folder / "npm")
        if script is None:
            print(f"{why}: Tessera is measured alone.")
    cases = {"cold": "first of a fresh server", "new": "a new model", "view": "a new view of a known model"}
    ours, theirs = {case: [] for case in cases}, {case: [] for case in cases}
    names = iter(f"model {i}" for i in range(1 << 30))

    def timed(picture, *arguments):
        begin = time.perf_counter()
        image = picture(*arguments)
        return image, time.perf_counter() - begin

    for _ in range(turns.cold):
        model = packed(HELMET, next(names))
        with Daemon() as daemon:
            image, headers, seconds = Client(daemon.port).post(thumbnail_path(30), model, GLB)
            ours["cold"].append(seconds)
            steps = timing(headers)
        save(report, "helmet.png", image)
        if script:
            with Chromium(script, THUMBNAIL_SIDE) as browser:
                image, seconds = timed(browser.picture, model, "cold", 30)
                theirs["cold"].append(seconds)
                version = browser.version
            save(report, "helmet-chromium.png", image)
    with Daemon() as daemon:
        client = Client(daemon.port)
        browser = Chromium(script, THUMBNAIL_SIDE) if script else None
        known = packed(HELMET, "known")
        client.post(thumbnail_path(0), known, GLB)
        if browser:
            browser.picture(known, "known", 0)
        for turn in range(turns.thumbnails):
            name, azimuth = next(names), 5 * (turn + 1)
            model = packed(HELMET, name)
            ours["new"].append(client.post(thumbnail_path(30), model, GLB)[2])
            if browser:
                theirs["new"].append(timed(browser.picture, model, name.replace(" ", "-"), 30)[1])
            ours["view"].append(client.post(thumbnail_path(azimuth), known, GLB)[2])
            if browser:
                theirs["view"].append(timed(browser.picture, known, "known", azimuth)[1])
        if browser:
            browser.__exit__()
    # Looking takes time, so memory is looked at by itself: of servers that make pictures of three new models.
    models = [packed(HELMET, next(names)) for _ in range(1 if turns.cold == 1 else 3)]
    with Daemon() as daemon:
        for model in models:
            Client(daemon.port).post(thumbnail_path(30), model, GLB)
        our_bytes = processes.peak_bytes(daemon.process.pid)
    if script:
        with Chromium(script, THUMBNAIL_SIDE) as browser, processes.PeakOfFamily(browser.process.pid) as peak:
            for i, model in enumerate(models):
                browser.picture(model, f"memory-{i}", 30)
        their_bytes = peak.bytes

    figures = report.figures["thumbnails"] = {
        "samples": THUMBNAIL_SAMPLES,
        "server_timing_cold": steps,
        "seconds": {case: numbers(seconds) for case, seconds in ours.items()},
        "peak_bytes": our_bytes,
    }
    steps_text = ", ".join(f"{name} {1e3 * seconds:.0f}" for name, seconds in steps.items())
    print(f"\nFlightHelmet, {THUMBNAIL_SIDE} x {THUMBNAIL_SIDE}, {THUMBNAIL_SAMPLES} samples. Cold, in ms: {steps_text}.")
    rows = [["", "ours ms", "Chromium ms", "Chromium / ours"]]
    for case, what in cases.items():
        rows.append([what, with_spread([1e3 * s for s in ours[case]])])
        report.plot(f"helmet, {what}", statistics.median(ours[case]), "Tessera")
        if script:
            ratios = [t / o for t, o in zip(theirs[case], ours[case])]
            rows[-1] += [with_spread([1e3 * s for s in theirs[case]]), with_spread(ratios)]
            report.plot(f"helmet, {what}", statistics.median(theirs[case]), "Chromium")
            report.at_least(f"serve/thumbnails/{case}_over_chromium", statistics.median(ratios), 5)
    rows.append(["peak MB", f"{our_bytes / MEGABYTE:.0f}"])
    if script:
        figures |= {
            "chromium": version,
            "chromium_seconds": {case: numbers(seconds) for case, seconds in theirs.items()},
            "chromium_peak_bytes": their_bytes,
        }
        rows[-1] += [f"{their_bytes / MEGABYTE:.0f}", three_digits(their_bytes / our_bytes)]
        report.at_most("serve/thumbnails/memory_of_chromium", our_bytes / their_bytes, 0.25)
    print_table(rows)


def measure_views(report, turns):
    """Labels of Drake's boxes from one camera after the other, none of which was asked for before."""
    if not is_there("views", BOXES):
        return
    scene = moved_scene(BOXES, 0)
    kinds = {
        "known_scene": ("the same file, another principal point",
                        lambda i: form(scene, "label", center_x=300 + 1e-2 * i)),
        "moved_scene": ("another file each time", lambda i: form(moved_scene(BOXES, i + 1), "label")),
    }  # fmt: skip
    rows = [["label 640 x 480 of a new camera", "1/s a core", "1/s", "p50 ms", "p99 ms"]]
    figures = report.figures["views"] = {}
    with Daemon("--drake") as daemon:
        for kind, (what, make) in kinds.items():
            requests = [http_load.encode("/render", body, headers) for headers, body in map(make, range(turns.views))]
            http_load.run(daemon.host, daemon.port, requests[:5], 1)
            before = processes.processor_seconds(daemon.process.pid)
            seconds, took = http_load.run(daemon.host, daemon.port, requests[5:], 2)
            spent = processes.processor_seconds(daemon.process.pid) - before
            rate = len(seconds) / max(spent, 1e-2)
            figures[kind] = {"seconds": numbers(seconds), "rate": len(seconds) / took, "rate_per_core": rate}
            rows.append([what, three_digits(rate), three_digits(len(seconds) / took), *latencies(seconds)])
            report.plot(f"label, {what}", statistics.median(seconds), "Tessera")
            report.at_least(f"serve/views/{kind}_per_core", rate, 100)
    print_table(rows)


def measure_known(report, turns):
    """Requests that were answered before, over connections that are kept."""
    rows = [["asked again", "1/s", "p50 ms", "p99 ms", "body kB", "answer kB"]]
    figures = report.figures["known"] = {}
    with Daemon("--drake") as daemon:
        client = Client(daemon.port)

        def measure(kind, what, path, body, headers, share=1, bound=None):
            answer, its_headers, _ = client.post(path, body, headers)
            request = http_load.encode(path, body, headers)
            if "ETag" in its_headers and kind.endswith("validated"):
                request = http_load.encode(path, body, headers | {"If-None-Match": its_headers["ETag"]})
                answer = b""
            requests = [request] * max(int(turns.known * share), 20)
            seconds, took = http_load.run(daemon.host, daemon.port, requests, 4)
            rate = len(seconds) / took
            figures[kind] = {"seconds": numbers(seconds), "rate": rate}
            sizes = [three_digits(1e-3 * len(body)), three_digits(1e-3 * len(answer))]
            rows.append([what, three_digits(rate), *latencies(seconds), *sizes])
            report.plot(f"known, {what}", statistics.median(seconds), "Tessera")
            if bound:
                report.at_least(f"serve/known/{kind}_per_second", rate, bound)

        box = pathlib.Path(SHARED_DATA, "gltf", "Box", "Box.gltf")
        if is_there("known", box):
            model = packed(box)
            path = "/v1/render?width=512&height=512&samples=16"
            measure("render", "POST /v1/render of a box", path, model, GLB, bound=2000)
            measure("render_validated", "the same, If-None-Match", path, model, GLB)
        if is_there("known", BOXES):
            headers, body = form(moved_scene(BOXES, 0), "label")
            measure("drake", "POST /render, label of boxes", "/render", body, headers, bound=2000)
        if is_there("known", HELMET):
            model = packed(HELMET)
            measure("helmet", "POST /v1/render of FlightHelmet", thumbnail_path(30), model, GLB, share=0.02)
    print_table(rows)


def measure_large(report, turns):
    """A fresh daemon with one thread reads one large file and traces a few pixels of it."""
    model = terrain(int(turns.large_bytes))
    path = "/v1/render?width=64&height=64&samples=1"
    steps, walls, spent, peaks = [], [], [], []
    for _ in range(turns.large):
        with Daemon("--threads", "1") as daemon:
            daemon.request("GET", "/readyz")
            idle = processes.resident_bytes(daemon.process.pid)
            image, headers, seconds = Client(daemon.port).post(path, model, GLB)
            steps.append(timing(headers))
            walls.append(seconds)
            spent.append(processes.processor_seconds(daemon.process.pid))
            peaks.append((processes.peak_bytes(daemon.process.pid) - idle) / len(model))
    save(report, "large.png", image)
    median = {name: statistics.median(step[name] for step in steps) for name in steps[0]}
    upload = statistics.median(walls) - sum(median.values())
    begins = median["parse"] + median["queue"] + median["build"]
    rate = len(model) / MEGABYTE / median["parse"]
    rows = [[f"a GLB of {len(model) / MEGABYTE:.0f} MB", "ms", "MB/s"]]
    rows += [
        [what, f"{1e3 * seconds:.0f}", f"{len(model) / MEGABYTE / max(seconds, 1e-4):.0f}"]
        for what, seconds in (("upload, hash, answer", upload), ("parse", median["parse"]),
                              ("build", median["build"]), ("parsed and built: tracing starts", begins))
    ]  # fmt: skip
    rows.append(["all of it, in processor seconds", f"{1e3 * statistics.median(spent):.0f}"])
    rows.append(["peak memory over the file's size", three_digits(statistics.median(peaks))])
    print_table(rows)
    report.figures["large"] = {
        "bytes": len(model), "server_timing": median, "upload_seconds": upload, "tracing_starts_seconds": begins,
        "processor_seconds": spent, "peak_over_file": peaks,
    }  # fmt: skip
    report.plot("100 MB: parse", median["parse"], "Tessera")
    report.plot("100 MB: parse and build", begins, "Tessera")
    report.at_least("serve/large/parse_megabytes_per_second", rate, 400)
    report.at_most("serve/large/peak_over_file", statistics.median(peaks), 2.5)


MEASURES = {
    "drake": measure_drake,
    "thumbnails": measure_thumbnails,
    "views": measure_views,
    "known": measure_known,
    "large": measure_large,
}


def main():
    parser = argparse.ArgumentParser(prog="tests/bench serve", description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", help="where JSON and plots go; tests/bench gives it")
    parser.add_argument("--quick", action="store_true", help="fewer turns, a smaller file")
    parser.add_argument("--parts", type=lambda text: text.split(","), default=PARTS, help=", ".join(PARTS))
    options = parser.parse_args()
    unknown = set(options.parts) - MEASURES.keys()
    if unknown:
        parser.error(f"there is no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    report = Report("serve", options.folder)
    for part in options.parts:
        MEASURES[part](report, Turns(options.quick))
    report.finish()


if __name__ == "__main__":
    main()
