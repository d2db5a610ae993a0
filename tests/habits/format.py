"""clang-format would change nothing. Its versions differ, so only the one of Debian 12 is asked."""

import re
import shutil
import subprocess

from sources import ROOT, files, report, skip

WANTED_MAJOR = "14"


def main():
    tool = shutil.which(f"clang-format-{WANTED_MAJOR}") or shutil.which("clang-format")
    if not tool:
        skip("no clang-format here")
    version = subprocess.run([tool, "--version"], capture_output=True, text=True, check=True).stdout
    major = re.search(r"version (\d+)", version).group(1)
    if major != WANTED_MAJOR:
        skip(f"clang-format {major} is here, {WANTED_MAJOR} is wanted")

    sources = files([".h", ".cpp"])
    done = subprocess.run([tool, "--dry-run", *sources], cwd=ROOT, capture_output=True, text=True, check=True)
    places = [line.split(": warning:")[0] for line in done.stderr.splitlines() if "warning:" in line]
    report([f"{place}: clang-format would change this" for place in places], f"Format of {len(sources)} files")


if __name__ == "__main__":
    main()
