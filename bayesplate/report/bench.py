"""The sheet for the bench: figures of the modes to look for, where they will be, and where sensor and hammer go."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bayesplate.planning.bench import Bench
from bayesplate.report.chladni import Marks, chladni_sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def bench_sheet(bench: Bench) -> Figure:
    """The sheet of one way to hold the board: A4 upright, one panel a mode in the order of frequency."""
    placing = bench.placing
    return chladni_sheet(bench.sheet, Marks(placing.sensor, placing.hammer, placing.taps, "Modes to look for"))
