"""What a part of the campaign finds: rows of the table, bars, and what must hold whatever the machine."""

import os
import shutil

from support.bench_report import Report, print_table, quantile, three_digits


class Skipped(Exception):
    """The part can't be done here; the text says why."""


class Broken(Exception):
    """Something that must hold doesn't, on any machine."""


def expect(condition, what):
    if not condition:
        raise Broken(what)


def need(*programs):
    """The paths of these programs; skips the part where one is missing."""
    path = os.environ["PATH"] + ":/usr/sbin"
    found = [shutil.which(program, path=path) for program in programs]
    missing = [program for program, where in zip(programs, found) if not where]
    if missing:
        raise Skipped(f"no {', no '.join(missing)} here (deploy/install-deps --test brings them)")
    return found


class Outcome:
    """Of all parts together. Times are measured and held against their bars in the long form alone."""

    def __init__(self, is_short, seed, kills, folder):
        self.is_short = is_short
        self.seed = seed
        self.kills = kills
        self._report = Report("load", folder) if folder else None
        self._rows = [["", "measured", "bar", ""]]

    def choose(self, short, long):
        return short if self.is_short else long

    def row(self, what, measured, bar="", remark=""):
        """Printed at once, and again in the table."""
        self._rows.append([what, measured, bar, remark])
        print(f"  {what}: {measured}{f'  (bar: {bar})' if bar else ''}{f'  {remark}' if remark else ''}", flush=True)

    def at_least(self, name, value, bound, what, unit="", remark=""):
        self._bar(name, value, bound, what, "≥", unit, remark, Report.at_least)

    def at_most(self, name, value, bound, what, unit="", remark=""):
        self._bar(name, value, bound, what, "≤", unit, remark, Report.at_most)

    def finish(self):
        print_table(self._rows)
        if self._report:
            self._report.figures["rows"] = self._rows
            self._report.finish()

    def _bar(self, name, value, bound, what, sign, unit, remark, add):
        self.row(what, f"{three_digits(value)}{unit}", f"{sign} {bound:g}{unit}", remark)
        if self._report:
            add(self._report, f"load/{name}", value, bound)


def spread(values, scale=1, unit=""):
    """Median, and least to most."""
    return (
        f"{three_digits(quantile(values, 0.5) * scale)}{unit}"
        f" ({three_digits(min(values) * scale)}–{three_digits(max(values) * scale)})"
    )
