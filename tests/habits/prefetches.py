"""The kernels prefetch on every instruction set: a compiler that takes prefetching for nothing drops it unseen."""

import re
import shutil
import subprocess
import sys

from sources import report, skip


def main():
    if not shutil.which("objdump"):
        skip("no objdump here")
    code = subprocess.run(["objdump", "-d", "-C", *sys.argv[1:]], capture_output=True, text=True, check=True).stdout
    prefetches = {}
    for function in re.split(r"^(?=[0-9a-f]+ <)", code, flags=re.MULTILINE):
        target = re.search(r"tessera::(N_\w+)::", function.partition("\n")[0])
        if target:
            count = len(re.findall(r"\s(?:prefetch|prfm)", function))
            prefetches[target[1]] = prefetches.get(target[1], 0) + count
    if not prefetches:
        report(["no kernel found"], "Objects")
    report([f"{target}: no prefetch" for target, count in prefetches.items() if count == 0],
           f"Prefetches of {len(prefetches)} instruction sets")


if __name__ == "__main__":
    main()
