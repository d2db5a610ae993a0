"""Blender, headless and kept running, as a server for Drake's clients."""

import pathlib
import subprocess
import threading


class BlenderServer:
    """Use it in a `with`."""

    def __init__(self, samples):
        script = pathlib.Path(__file__).with_name("blender_server.py")
        self.process = subprocess.Popen(
            ["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python", script, "--",
             str(samples)],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        said = []
        for line in self.process.stdout:
            if line.startswith("listening on "):
                self.port = int(line.split()[-1])
                break
            said.append(line)
        else:
            self.process.wait()
            raise RuntimeError("Blender has ended; it said: " + "".join(said[-5:]).strip())
        # It tells of each image, and would stop if nobody listened.
        threading.Thread(target=lambda: [None for _ in self.process.stdout], daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
