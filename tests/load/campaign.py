"""Load, faults and abuse, part by part; tests/load/run builds what it takes and calls this."""

import argparse
import importlib
import os
import sys
import time

import tools  # noqa: F401  (finds what the tests share)
from tools.outcome import Broken, Outcome, Skipped

# Module and what it is about, in the order in which they run.
PARTS = {
    "polls": "status polls beside nginx, idle and while every core renders",
    "small_jobs": "ten thousand jobs of 64 x 64 from 32 clients",
    "beside": "small things beside large ones: thumbnails, and posts behind hostile documents and huge encodings",
    "idle_connections": "thousands of connections that ask for nothing",
    "slow_clients": "slowhttptest in every way that it knows",
    "memory": "the worst clients, ten ways",
    "faults": "disk full, read-only or gone, no descriptors, the clock set back, journal or structures damaged",
    "kills": "kill -9 at random moments of a script of work: nothing is lost",
    "soak": "all kinds of work for twenty minutes: memory and descriptors stay flat",
}
SKIPPED = 77  # ctest's SKIP_RETURN_CODE.


def run(part, outcome):
    """Whether all held that must; None where it couldn't be tried."""
    print(f"{part}: {PARTS[part]} (load average {os.getloadavg()[0]:.1f})", flush=True)
    begin = time.monotonic()
    try:
        importlib.import_module(f"parts.{part}").measure(outcome)
        print(f"  took {time.monotonic() - begin:.0f} s", flush=True)
        return True
    except Skipped as reason:
        outcome.row(part, "SKIPPED", remark=str(reason))
        return None
    except Broken as failure:
        outcome.row(part, "BROKEN", remark=str(failure))
        return False


def main():
    parts = "\n".join(f"  {name:<14}{about}" for name, about in PARTS.items())
    parser = argparse.ArgumentParser(
        prog="tests/load/run", epilog=f"parts:\n{parts}", formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--short", action="store_true", help="seconds a part, and no bars")
    parser.add_argument("--parts", type=lambda text: text.split(","), default=list(PARTS), metavar="A,B")
    parser.add_argument("--seed", type=int, default=time.time_ns() % 1_000_000)
    parser.add_argument("--kills", type=int, help="how many, instead of 12 or 1000")
    parser.add_argument("--folder", help="where the figures go as JSON")
    options = parser.parse_args()
    if unknown := set(options.parts) - PARTS.keys():
        parser.error(f"there is no part {', '.join(sorted(unknown))}")
    print(f"seed {options.seed}")
    outcome = Outcome(options.short, options.seed, options.kills, None if options.short else options.folder)
    held = [run(part, outcome) for part in options.parts]
    outcome.finish()
    if False in held:
        sys.exit(1)
    sys.exit(SKIPPED if held == [None] * len(held) else 0)


if __name__ == "__main__":
    main()
