"""Who may include what. Includes are root-relative; the tables are the architecture."""

import re

from sources import ROOT, files, report

# A file belongs to the longest prefix that fits. It may include its own part and these.
MAY_INCLUDE = {
    "core": [],
    "proto/wire": [],
    # Readers of files stand below what reads documents, which calls them.
    "proto/import": [
        "proto/wire", "proto/import/gltf/gltf.h", "core/math", "core/geometry", "core/scene",
        "core/io/image_header.h",
        "core/io/read_environment.h", "core/io/read_texture.h",
    ],
    # glTF is JSON, and read as documents are.
    "proto/import/gltf": [
        "proto/wire", "proto/import", "proto/json_document.h", "proto/json_cursor.h", "proto/read_values.h", "core/math",
        "core/geometry", "core/scene", "core/io/read_texture.h",
    ],
    # Scene types, and tables of which names and options are the wire's; and which integrator a scene takes.
    "proto": [
        "proto/wire", "proto/import", "core/math", "core/geometry", "core/bounds", "core/scene",
        "core/accel/accel_table.h", "core/film/aov_table.h", "core/plan/features.h",
    ],
    "server": ["proto", "core"],
    "client": ["proto/wire"],
    "tests": ["core", "proto", "server", "client"],
}

# Within core a folder knows itself and the folders before it. Bounds come before geometry: a shape says how it is
# bounded, and a bound needs points and planes, never a shape.
CORE_ORDER = [
    "math", "bounds", "geometry", "scene", "accel", "sampling", "screen", "material", "light", "plan", "integrator",
    "film", "io", "render",
]

# Libraries by the start of the header's name, beside the standard library.
LIBRARIES = {
    "core": [],
    "core/accel/wide": ["hwy/"],
    "core/io": ["jerror.h", "jpeglib.h", "png.h"],
    "core/io/oiio": ["OpenImageIO/"],
    "proto/wire": ["nlohmann/", "openssl/"],
    "proto": ["nlohmann/"],
    "proto/import/gltf": ["draco/", "meshoptimizer.h"],
    "server": ["nlohmann/", "spdlog/", "CLI/"],
    "server/http": ["nlohmann/", "openssl/", "spdlog/"],
    "server/metrics": ["prometheus/"],
    "server/webhooks": ["boost/", "nlohmann/", "openssl/", "spdlog/"],
    "client": ["boost/", "nlohmann/", "openssl/", "CLI/"],
    "tests": ["gtest/", "nlohmann/", "OpenImageIO/", "draco/", "meshoptimizer.h", "xmmintrin.h"],
    "tests/benchmarks": ["nlohmann/", "CLI/", "embree3/", "tiny_obj_loader.h", "OpenImageIO/", "malloc.h", "png.h"],
}

# POSIX, for the parts that talk to the system.
SYSTEM = {part: ["sys/", "unistd.h", "fcntl.h", "signal.h"] for part in ("server", "client", "tests", "proto/wire")}
SYSTEM["server"] += ["arpa/inet.h", "netdb.h", "netinet/", "poll.h", "linux/", "archive.h", "archive_entry.h", "sqlite3.h"]
SYSTEM["tests"] += ["sched.h", "archive.h", "archive_entry.h", "sqlite3.h"]
SYSTEM["core/accel/wide"] = ["sys/mman.h"]  # huge pages
SYSTEM["core/io/oiio"] = ["dlfcn.h"]

INCLUDE = re.compile(r'^\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)')


def part_of(path, table):
    """The longest key of `table` that is `path` or a folder above it."""
    fitting = [part for part in table if path == part or path.startswith(part + "/")]
    return max(fitting, key=len, default=None)


def core_folder(path):
    parts = path.split("/")
    return parts[1] if parts[0] == "core" and len(parts) > 2 else None


def fault_of_own(source, included):
    """Why `source` may not include the project's file `included`; nothing when it may."""
    if not (ROOT / included).is_file():
        return "no such file from the root"
    part = part_of(source, MAY_INCLUDE)
    included_part = part_of(included, MAY_INCLUDE)
    allowed = part_of(included, MAY_INCLUDE[part]) is not None
    if included_part != part and not allowed:
        return f"{part}/ may include {', '.join(MAY_INCLUDE[part]) or 'nothing but itself'}"
    above, below = core_folder(included), core_folder(source)
    if above and below:
        if below not in CORE_ORDER or above not in CORE_ORDER:
            return f"core/{below if below not in CORE_ORDER else above}/ has no place in the order of core's folders"
        if CORE_ORDER.index(above) > CORE_ORDER.index(below):
            return f"core/{below}/ stands above core/{above}/ and may not know it"
    return None


def fault_of_library(source, included):
    """Why `source` may not include the foreign header `included`; nothing when it may."""
    if re.fullmatch(r"[a-z0-9_]+", included):  # the standard library
        return None
    allowed = LIBRARIES[part_of(source, LIBRARIES)] + SYSTEM.get(part_of(source, SYSTEM), [])
    if any(included == name or (name.endswith("/") and included.startswith(name)) for name in allowed):
        return None
    return f"{part_of(source, LIBRARIES)}/ may use {', '.join(allowed) or 'the standard library alone'}"


def faults(source, text):
    """(line number, included, why) of every include of `text` that breaks the tables."""
    for number, line in enumerate(text.splitlines(), 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        own, library = match.groups()
        why = fault_of_own(source, own) if own else fault_of_library(source, library)
        if why:
            yield number, own or library, why


def main():
    sources = files([".h", ".cpp"])
    findings = [
        f'{source}:{line}: includes "{included}": {why}'
        for source in sources
        for line, included, why in faults(source.as_posix(), (ROOT / source).read_text())
    ]
    report(findings, f"Includes of {len(sources)} files")


if __name__ == "__main__":
    main()
