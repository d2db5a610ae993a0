"""What the parts of the campaign share. Daemons come from the e2e tests, reports and processes from the benchmarks."""

import pathlib
import sys

_TESTS = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(_TESTS / "e2e"), str(_TESTS / "benchmarks")]
