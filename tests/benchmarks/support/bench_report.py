"""What a benchmark in Python leaves behind: tables and bar lines on the terminal, JSON and a plot in a folder, as
report.h has it for the others."""

import json
import math
import os
import pathlib
import statistics


def quantile(values, share):
    """Of the values themselves, the one that so many are at most."""
    ordered = sorted(values)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)]


def three_digits(value):
    """With so many decimals that about three digits count."""
    for digits, bound in enumerate((100, 10, 1, 0.1)):
        if abs(value) >= bound:
            return f"{value:.{digits}f}"
    return f"{value:.4f}"


def with_spread(values):
    """The median, and half the distance between the quartiles as a share of it."""
    median = statistics.median(values)
    spread = (quantile(values, 0.75) - quantile(values, 0.25)) / 2 / median if median else 0
    return f"{three_digits(median)} ±{100 * spread:.0f}%"


def print_table(rows):
    """Columns as wide as they need, the first one left-aligned."""
    widths = [max(len(row[i]) for row in rows if i < len(row)) for i in range(max(map(len, rows)))]
    print()
    for row in rows:
        cells = [cell.ljust(width) if i == 0 else cell.rjust(width) for i, (cell, width) in enumerate(zip(row, widths))]
        print("  ".join(cells).rstrip())
    print(flush=True)


def _processor():
    with open("/proc/cpuinfo") as info:
        for line in info:
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return "unknown"


class Report:
    """`figures` are free in form; "bars" and "machine" are the report's own."""

    def __init__(self, name, folder):
        self.name = name
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        load = os.getloadavg()[0]
        machine = {"processor": _processor(), "cores": os.cpu_count(), "load_average_before": load}
        self.figures = {"benchmark": name, "machine": machine, "bars": []}
        self._lines = []
        self._plotted = []
        print(f"{machine['processor']}, {machine['cores']} cores")
        if load > 0.5:
            print(f"The machine is busy with other work (load average {load:.1f}): expect worse figures.")

    def at_least(self, bar, value, bound):
        self._add(bar, value, bound, value >= bound)

    def at_most(self, bar, value, bound):
        self._add(bar, value, bound, value <= bound)

    def plot(self, label, seconds, whose):
        """A row of the plot: how long something takes."""
        self._plotted.append((label, seconds, whose))

    def finish(self):
        """Writes the JSON and the plot, and prints the bars."""
        if self._plotted:
            path = self.folder / f"{self.name}.svg"
            path.write_text(_plot(self._plotted))
            print(f"plot {path}")
        path = self.folder / f"{self.name}.json"
        path.write_text(json.dumps(self.figures, indent=1) + "\n")
        print(f"json {path}")
        print("\n".join(self._lines))

    def _add(self, bar, value, bound, is_ok):
        self.figures["bars"].append({"name": bar, "value": value, "bound": bound, "ok": is_ok})
        self._lines.append(f"bar {bar} {value:.3f} {bound:.3f} {'ok' if is_ok else 'short'}")


# As svg.h's, told apart by everyone.
_COLORS = ["#0072B2", "#E69F00", "#009E73", "#CC79A7"]


def _plot(rows):
    """Bars of seconds on a logarithmic axis, as an SVG document."""
    left, top, width, height = 250, 48, 560, 18
    most = 10 * max(seconds for _, seconds, _ in rows)
    least = min(seconds for _, seconds, _ in rows) / 2
    decades = [10.0**power for power in range(-7, 5) if least <= 10.0**power <= most]
    whose = list(dict.fromkeys(name for _, _, name in rows))
    bottom = top + height * len(rows)

    def place(seconds):
        return left + width * (math.log(seconds / least) / math.log(most / least))

    def text(x, y, words, anchor="start"):
        return f"<text x='{x:.1f}' y='{y:.1f}' font-size='11' text-anchor='{anchor}' fill='#222'>{words}</text>"

    parts = [
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{left + width + 80}' height='{bottom + 46}' "
        "font-family='Helvetica, Arial, DejaVu Sans, sans-serif'>",
        "<rect width='100%' height='100%' fill='white'/>",
    ]
    for i, name in enumerate(whose):
        parts.append(f"<rect x='{left + 130 * i}' y='18' width='10' height='10' fill='{_COLORS[i % len(_COLORS)]}'/>")
        parts.append(text(left + 130 * i + 14, 27, name))
    for decade in decades:
        x = place(decade)
        parts.append(f"<path d='M{x:.1f} {top}V{bottom}' stroke='#ddd'/>")
        parts.append(text(x, bottom + 16, f"{decade:g}", "middle"))
    parts.append(text(left + width / 2, bottom + 34, "seconds", "middle"))
    for i, (label, seconds, name) in enumerate(rows):
        y = top + height * i
        color = _COLORS[whose.index(name) % len(_COLORS)]
        parts.append(text(left - 6, y + 13, label, "end"))
        parts.append(
            f"<rect x='{left}' y='{y + 3}' width='{place(seconds) - left:.1f}' height='{height - 5}' fill='{color}'/>"
        )
        parts.append(text(place(seconds) + 4, y + 13, three_digits(seconds)))
    return "\n".join([*parts, "</svg>", ""])
