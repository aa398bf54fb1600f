"""What the pages compute: functions that return Markdown, by the name under which a page asks for them."""

from __future__ import annotations

from computations.keys import keys_of
from computations.left_out import pareto, pareto_told
from computations.library import (
    campaign_limits,
    campaign_references,
    default_noise,
    effects_listed,
    exit_codes,
    gate,
    long_checks,
    planning_references,
    reference,
    references,
    symbols,
    verdict_limits,
)
from computations.plates import convergence, paper_table
from computations.runs import (
    both_laws,
    exact_law,
    files_of,
    provenance,
    sessions_together,
    sheet_of,
    thickness_part,
)
from computations.sight import cosines, designs, leverages, rounding, visible_parts

__all__ = [
    "both_laws",
    "campaign_limits",
    "campaign_references",
    "convergence",
    "cosines",
    "default_noise",
    "designs",
    "effects_listed",
    "exact_law",
    "exit_codes",
    "files_of",
    "gate",
    "keys_of",
    "leverages",
    "long_checks",
    "paper_table",
    "pareto",
    "pareto_told",
    "planning_references",
    "provenance",
    "reference",
    "references",
    "rounding",
    "sessions_together",
    "sheet_of",
    "symbols",
    "thickness_part",
    "verdict_limits",
    "visible_parts",
]
