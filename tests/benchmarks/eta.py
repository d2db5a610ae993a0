"""How long jobs say that they take, beside how long they then take.

tests/bench eta [--quick]
Runs jobs of several kinds, alone and beside others, asks each ten times a second how long it will take, and counts how
often the truth lies in the range that it says. --quick runs fewer.
"""

import argparse
import pathlib
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "e2e"))

from daemon import Daemon  # noqa: E402
from support.bench_report import Report, print_table  # noqa: E402

ASKED = 0.8
PAUSE = 0.1
STUDIO = [{"type": "environment", "preset": "studio"}]
LIGHTS = [{"type": "ambient", "radiance": [0.3, 0.3, 0.3]}, {"type": "point", "position": [5, 5, 9], "intensity": [300, 300, 300]}]


def spheres(count, spread, lights=LIGHTS):
    """A row of them at the bottom of an image whose rest is empty."""
    objects = [{"type": "sphere", "center": [spread * (i % 8 - 3.5), spread * (i // 8 - 4), 0], "radius": 1} for i in range(count)]
    return {"lights": lights, "objects": objects}


def job(scene, side, **settings):
    return {"scene": scene, "image": {"width": side, "height": side}, "settings": settings}


def jobs(is_quick):
    """By kind. They take a few seconds each."""
    even, uneven = spheres(64, 2), spheres(8, 2)
    lit = [spheres(count, 2, STUDIO) for count in (64, 8)]
    kinds = {
        "samples": [job(scene, 300, samples=samples) for scene in (even, uneven) for samples in (300, 1000)],
        "one pass": [job(scene, side, samples=1) for scene in (even, uneven) for side in (2500, 3500)],
        "path": [job(scene, 200, samples=samples, integrator="path") for scene in lit for samples in (100, 300)],
        "error": [job(scene, 200, integrator="path", until={"error": e, "samples": 4000}) for scene in lit for e in (0.02, 0.01)],
        "seconds": [job(scene, 200, integrator="path", until={"seconds": s}) for scene in lit for s in (3, 6)],
        "error or seconds": [job(scene, 200, integrator="path", until={"error": 0.01, "seconds": s}) for scene in lit for s in (3, 6)],
    }
    return {kind: documents[::3] if is_quick else documents for kind, documents in kinds.items()}


class Asked:
    """A job, and what it said."""

    def __init__(self, daemon, document):
        self.daemon, self.id = daemon, daemon.submit(document)
        self.said = []
        self.ended = None

    def ask(self):
        status = self.daemon.status(self.id)
        now = time.monotonic()
        if status["state"] in ("completed", "failed", "canceled"):
            assert status["state"] == "completed", status
            self.ended = now
        elif "eta_range" in status:
            self.said.append((now, status["eta"], *status["eta_range"], status["progress"]))

    def hits(self):
        """The part of its answers whose range has the truth, to the time between two questions."""
        right = [low - PAUSE <= self.ended - at <= high + PAUSE for at, _, low, high, _ in self.said]
        return sum(right) / len(right) if right else None

    def errors(self):
        """Truth by middle of what it said, by progress, where enough is left for it to matter."""
        return [(progress, (self.ended - at) / eta) for at, eta, _, _, progress in self.said if eta > 5 * PAUSE]


def run(daemon, documents):
    running = [Asked(daemon, document) for document in documents]
    while any(asked.ended is None for asked in running):
        for asked in running:
            if asked.ended is None:
                asked.ask()
        time.sleep(PAUSE)
    return running


def main():
    parser = argparse.ArgumentParser(prog="tests/bench eta", description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", help="where JSON goes; tests/bench gives it")
    parser.add_argument("--quick", action="store_true", help="fewer jobs")
    parser.add_argument("--raw", action="store_true", help="prints each answer")
    options = parser.parse_args()
    rows, all_hits = [["jobs", "running", "count", "truth in range"]], []
    report = Report("eta", options.folder)
    with Daemon() as daemon:
        for kind, documents in jobs(options.quick).items():
            for how, groups in (("alone", [[document] for document in documents]), ("two", [documents[:2]])):
                asked = [one for group in groups for one in run(daemon, group)]
                hits = [one.hits() for one in asked if one.hits() is not None]
                if options.raw:
                    for one in asked:
                        print(kind, how, " ".join(f"{p:.2f}:{r:.2f}" for p, r in one.errors()))
                if hits:
                    rows.append([kind, how, str(len(hits)), f"{sum(hits) / len(hits):.2f}"])
                    all_hits += hits
    print_table(rows)
    report.figures["jobs"] = [dict(zip(rows[0], row)) for row in rows[1:]]
    report.at_least("eta_in_range", sum(all_hits) / len(all_hits), ASKED)
    report.finish()


if __name__ == "__main__":
    main()
