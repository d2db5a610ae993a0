"""Processor time by what a thread of the daemon is for, as their names tell."""

import os
import pathlib

_TICKS = os.sysconf("SC_CLK_TCK")


def _nanoseconds_on_cpu(task):
    """As the scheduler has it: exact, where ticks are hundredths of seconds."""
    try:
        return int((task / "schedstat").read_text().split()[0])
    except (OSError, ValueError, IndexError):
        fields = (task / "stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) * 1_000_000_000 // _TICKS


def processor_seconds(process):
    """{"io": …, "others": …} so far."""
    total = {"io": 0, "others": 0}
    for task in pathlib.Path(f"/proc/{process}/task").iterdir():
        try:
            name = (task / "comm").read_text().strip()
            total["io" if name == "io" else "others"] += _nanoseconds_on_cpu(task)
        except OSError:
            pass  # It has ended meanwhile.
    return {name: nanoseconds / 1e9 for name, nanoseconds in total.items()}


def io_threads(process):
    """How many there are."""
    tasks = pathlib.Path(f"/proc/{process}/task").iterdir()
    return sum((task / "comm").read_text().strip() == "io" for task in tasks)
