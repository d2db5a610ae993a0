"""What processes take: memory and processor time, as the system counts it."""

import os
import pathlib
import threading

_TICKS = os.sysconf("SC_CLK_TCK")


def _stat(process):
    """The fields after the program's name, which may hold anything."""
    return pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()


def processor_seconds(process):
    """Of all its threads so far."""
    fields = _stat(process)
    return (int(fields[11]) + int(fields[12])) / _TICKS


def _kilobytes(process, file, name):
    for line in pathlib.Path(f"/proc/{process}/{file}").read_text().splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1])
    return 0


def peak_bytes(process):
    """The most that it has had in memory so far."""
    return 1024 * _kilobytes(process, "status", "VmHWM")


def resident_bytes(process):
    return 1024 * _kilobytes(process, "status", "VmRSS")


def _family(process):
    """The process and all that come of it."""
    parents = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                parents.setdefault(int(_stat(entry)[1]), []).append(int(entry))
            except OSError:
                pass  # It has ended meanwhile.
    family = [process]
    for member in family:
        family.extend(parents.get(member, []))
    return family


def shared_out_bytes(process):
    """What it and all that come of it have in memory; what several of them share is counted once."""
    total = 0
    for member in _family(process):
        try:
            total += 1024 * _kilobytes(member, "smaps_rollup", "Pss")
        except OSError:
            pass  # It has ended meanwhile.
    return total


class PeakOfFamily:
    """Watches `shared_out_bytes` while a `with` lasts; `bytes` is the most that was seen."""

    def __init__(self, process):
        self._process = process
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch)
        self.bytes = 0

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._thread.join()

    def _watch(self):
        while not self._ended.wait(0.05):
            self.bytes = max(self.bytes, shared_out_bytes(self._process))
