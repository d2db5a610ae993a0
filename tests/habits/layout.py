"""The top level holds what the design names, and dot-files."""

import subprocess

from sources import ROOT, report

TOP_LEVEL = {
    "CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md", "client", "core", "deploy", "proto", "server", "tests",
}


def entries():
    """What is committed at the top; in an unpacked archive, what lies there but for the build folder."""
    git = subprocess.run(["git", "-C", ROOT, "ls-files"], capture_output=True, text=True, check=False)
    if git.returncode == 0:
        return {line.split("/")[0] for line in git.stdout.splitlines()}
    return {path.name for path in ROOT.iterdir()} - {"build"}


if __name__ == "__main__":
    strangers = sorted(name for name in entries() - TOP_LEVEL if not name.startswith("."))
    report([f"{name}: has no place at the top level" for name in strangers], "Top level")
