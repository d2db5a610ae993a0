"""What syncing costs on the disk that holds a folder."""

import os
import tempfile
import time


def sync_seconds(folder, times=100):
    """Of each write of 4 KiB at the end of a file, with fdatasync(2)."""
    seconds = []
    with tempfile.TemporaryFile(dir=folder) as file:
        for _ in range(times):
            begin = time.perf_counter()
            os.write(file.fileno(), b"x" * 4096)
            os.fdatasync(file.fileno())
            seconds.append(time.perf_counter() - begin)
    return seconds
