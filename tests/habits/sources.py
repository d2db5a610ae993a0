"""What the house tests share: the project's own files, and how findings are told."""

import os
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PARTS = ["core", "proto", "server", "client", "tests"]
SKIPPED = 77  # ctest's SKIP_RETURN_CODE in CMakeLists.txt


def files(endings, parts=PARTS):
    """Paths relative to the root, sorted, of the files under `parts` whose names end so."""
    found = []
    for part in parts:
        for folder, _, names in os.walk(ROOT / part):
            found += [pathlib.Path(folder, n).relative_to(ROOT) for n in names if n.endswith(tuple(endings))]
    return sorted(found)


def report(findings, what_was_checked):
    """Prints the findings and ends the program accordingly."""
    for finding in findings:
        print(finding)
    print(f"{what_was_checked}: {len(findings)} findings")
    sys.exit(1 if findings else 0)


def skip(reason):
    print(f"SKIPPED: {reason}")
    sys.exit(SKIPPED)
