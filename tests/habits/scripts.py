"""shellcheck finds nothing in the shell scripts, and every script that has a first line for it can be run."""

import os
import shutil
import subprocess

from sources import ROOT, report, skip

FOLDERS = [".ci", "deploy", "tests"]


def scripts():
    """Files that start with #!, with that first line."""
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.is_file():
                with open(path, "rb") as file:
                    first_line = file.readline()
                if first_line.startswith(b"#!"):
                    yield path, first_line


def main():
    found = list(scripts())
    findings = [f"{path.relative_to(ROOT)}: is not executable" for path, _ in found if not os.access(path, os.X_OK)]
    shell = [path.relative_to(ROOT) for path, first_line in found if b"bash" in first_line or b"/sh" in first_line]
    if not shutil.which("shellcheck"):
        if findings:
            report(findings, f"{len(found)} scripts")
        skip("no shellcheck here")
    done = subprocess.run(["shellcheck", "--format=gcc", *shell], cwd=ROOT, capture_output=True, text=True, check=False)
    report(findings + done.stdout.splitlines(), f"{len(found)} scripts")


if __name__ == "__main__":
    main()
