"""Every header compiles alone.

A header that its own .cpp includes first is shown to by the build itself; only the others are compiled here.
Usage: headers.py compile_commands.json
"""

import concurrent.futures
import json
import os
import re
import shlex
import subprocess
import sys

from sources import ROOT, files, report

INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]', re.MULTILINE)


def first_include(path):
    match = INCLUDE.search(path.read_text()) if path.is_file() else None
    return match.group(1) if match else None


def is_shown_by_its_source(header):
    return first_include(ROOT / header.with_suffix(".cpp")) == header.as_posix()


def compiler_and_flags(compile_commands):
    """The compiler, and the flags of the build that decide what a header sees."""
    flags, compiler = {}, "c++"
    with open(compile_commands, encoding="utf-8") as file:
        for entry in json.load(file):
            words = iter(shlex.split(entry["command"]))
            compiler = next(word for word in words if "ccache" not in word)
            for word in words:
                if word == "-isystem":
                    flags[f"-isystem{next(words)}"] = None
                elif word.startswith(("-I", "-D", "-isystem", "-std=", "-march=")):
                    flags[word] = None
    return compiler, list(flags)


def fault(header, command):
    """The compiler's first complaint about `header` on its own; nothing when there is none."""
    source = f'#include "{header.as_posix()}"\n'
    done = subprocess.run(command, input=source, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return None
    return next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)


def main():
    compiler, flags = compiler_and_flags(sys.argv[1])
    command = [compiler, *flags, "-fsyntax-only", "-x", "c++", "-"]
    headers = files([".h"])
    alone = [header for header in headers if not is_shown_by_its_source(header)]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        complaints = pool.map(lambda header: fault(header, command), alone)
    findings = [f"{header}: {why}" for header, why in zip(alone, complaints) if why]
    report(findings, f"Headers on their own ({len(headers)}, of which {len(alone)} compiled here)")


if __name__ == "__main__":
    main()
