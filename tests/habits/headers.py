"""Every header can be included first.

A header that its own .cpp includes first is shown to by the build itself, as far as the precompiled headers of libraries
let it. Compiling each of the others alone would take a minute, so they are compiled in one go, forwards and backwards,
and in all of them what they name is looked for in the text: names of the standard library (in sources, too, for there
as well precompiled headers hide what is missing), and types of the project.
Usage: headers.py compile_commands.json
"""

import collections
import functools
import json
import re
import shlex
import subprocess
import sys

from sources import ROOT, files, report
from standard_names import headers_of

OWN = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)
FOREIGN = re.compile(r"^\s*#\s*include\s*<([^>]+)>", re.MULTILINE)
NOT_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.DOTALL)
TYPE = re.compile(r"^(?:class|struct|enum class) ([A-Z]\w+)[^;]*?\{|^using ([A-Z]\w+) =", re.MULTILINE)
WORD = re.compile(r"(?<!::)\b[A-Z]\w+")
STANDARD_NAME = re.compile(r"\bstd::(\w+)")


@functools.cache
def text(path):
    return (ROOT / path).read_text() if (ROOT / path).is_file() else ""


def is_shown_by_its_source(header):
    first = re.search(r'^\s*#\s*include\s*["<]([^">]+)[">]', text(header.removesuffix(".h") + ".cpp"), re.MULTILINE)
    return first is not None and first.group(1) == header


@functools.cache
def code(path):
    """Without comments and strings."""
    return NOT_CODE.sub("", text(path))


@functools.cache
def closure(path):
    """The project's files that including `path` brings, itself among them, and the headers of others."""
    own, foreign, to_read = set(), set(), [path]
    while to_read:
        at = to_read.pop()
        if at not in own:
            own.add(at)
            foreign |= set(FOREIGN.findall(text(at)))
            to_read += OWN.findall(text(at))
    return own, foreign


def missing_standard_headers(header):
    _, brought = closure(header)
    for name in sorted(set(STANDARD_NAME.findall(code(header)))):
        if headers_of(name) and not headers_of(name) & brought:
            yield f"{header}: std::{name} without <{'> or <'.join(sorted(headers_of(name)))}>"


def homes_of_types(headers):
    """The types of namespace scope, which stand at the start of a line, by the one header that defines them."""
    homes = collections.defaultdict(set)
    for header in headers:
        for names in TYPE.findall(code(header)):
            homes["".join(names)].add(header)
    return {name: next(iter(where)) for name, where in homes.items() if len(where) == 1}


def missing_own_headers(header, homes):
    brought, _ = closure(header)
    for name in sorted(set(WORD.findall(code(header))) & homes.keys()):
        declares = re.search(rf"\b(?:class|struct|enum|using|typename|auto) {name}\b", code(header))
        if homes[name] not in brought and not declares:
            yield f"{header}: {name} without {homes[name]}"


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


def fault(headers, command):
    """The compiler's first complaint about the headers, one after the other; nothing when there is none."""
    source = "".join(f'#include "{header}"\n' for header in headers)
    done = subprocess.run(command, input=source, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return []
    return [next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)]


def main():
    compiler, flags = compiler_and_flags(sys.argv[1])
    headers = [header.as_posix() for header in files([".h"])]
    homes = homes_of_types(headers)
    findings = []
    for path in [path.as_posix() for path in files([".h", ".cpp"])]:
        findings += missing_standard_headers(path)
    for header in headers:
        findings += missing_own_headers(header, homes)
    alone = [header for header in headers if not is_shown_by_its_source(header)]
    command = [compiler, *flags, "-fsyntax-only", "-x", "c++", "-"]
    findings += fault(alone, command) + fault(alone[::-1], command)
    report(findings, f"Headers on their own ({len(headers)}, of which {len(alone)} compiled here)")


if __name__ == "__main__":
    main()
