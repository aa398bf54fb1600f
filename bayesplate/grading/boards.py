"""The boards of a batch as table rows, and the summary of the batch as batch.json has it; SI units."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.results.contract import JOINT_NAMES, JointMoments, Spread
from bayesplate.results.summary import Summary

FITTED = "fitted"
MAKERS_QUANTITIES = (
    "density",
    "wave_speed_x",
    "wave_speed_y",
    "radiation_ratio_x",
    "radiation_ratio_y",
    "impedance_x",
    "anisotropy",
)
"""Derived quantities in the table of a batch."""
_STATISTICS = ("mean", "sd", "q05", "q50", "q95")
_CORRELATED = (*MODULI, "density")
_PAIRS = tuple((a, b) for i, a in enumerate(_CORRELATED) for b in _CORRELATED[i + 1 :])
TEXT_COLUMNS = ("name", "outcome", "message", "doubt", "card_sha256", "seed", "theory", "law", "effects", "prior")
"""Columns of texts; the seed is an integer."""
NUMBER_COLUMNS = (
    *(f"{name}_{statistic}" for name in MODULI for statistic in _STATISTICS),
    *(f"{name}_{statistic}" for name in (*RIGIDITIES, *MAKERS_QUANTITIES) for statistic in ("mean", "sd")),
    *(f"correlation_{a}_{b}" for a, b in _PAIRS),
    "n_modes",
    "in_sample_rms_cents",
    "leave_one_out_rms_cents",
    "n_warnings",
)
"""Columns of numbers; the correlations are between logarithms."""


@dataclass(frozen=True)
class BoardRow:
    """The outcome of one board of a batch."""

    name: str  # of the board, or of the file where its card could not be read
    outcome: str  # "fitted", or in two or three words why there are no constants
    message: str = ""  # of the error
    doubt: str = ""  # why the constants of a fitted board are not to be trusted
    card_sha256: str = ""
    seed: int | None = None
    told: Mapping[str, str] | None = None  # theory, law, effects and prior of a fitted board, by `TEXT_COLUMNS`
    numbers: Mapping[str, float | None] | None = None  # numbers of a fitted board, by `NUMBER_COLUMNS`
    joint: JointMoments | None = None  # joint moments of its constants
    readings_sha256: str = ""

    @property
    def is_fitted(self) -> bool:
        """Whether the board has constants."""
        return self.outcome == FITTED

    def cells(self) -> list[str | float | int | None]:
        """The cells of the row, in the order of `TEXT_COLUMNS` and `NUMBER_COLUMNS`."""
        model, numbers = self.told or {}, self.numbers or {}
        texts = [self.name, self.outcome, self.message, self.doubt, self.card_sha256, self.seed]
        return [
            *texts,
            *(model.get(word) for word in TEXT_COLUMNS[len(texts) :]),
            *(numbers.get(name) for name in NUMBER_COLUMNS),
        ]


def board_row(summary: Summary) -> BoardRow:
    """The row of a fitted board."""
    model = summary.model
    return BoardRow(
        name=summary.name,
        outcome=FITTED,
        doubt="; ".join(summary.doubts),
        card_sha256=summary.card_sha256,
        seed=summary.seed,
        told={
            "theory": model.theory,
            "law": model.law,
            "effects": " ".join(model.effects),
            "prior": model.prior,
        },
        numbers=_number_cells(summary),
        joint=summary.joint,
    )


def _number_cells(summary: Summary) -> dict[str, float | None]:
    numbers: dict[str, float | None] = {}
    for name, entry in summary.elastic.items():
        numbers |= {f"{name}_{statistic}": getattr(entry, statistic) for statistic in _STATISTICS}
    spreads: dict[str, Spread] = {
        **dict(summary.rigidity.items()),
        **{name: summary.derived[name] for name in MAKERS_QUANTITIES},
    }
    for name, entry in spreads.items():
        numbers |= {f"{name}_mean": entry.mean, f"{name}_sd": entry.sd}
    numbers |= {f"correlation_{a}_{b}": _log_correlation(summary.joint, a, b) for a, b in _PAIRS}
    numbers["n_modes"] = float(len(summary.modes))
    numbers["in_sample_rms_cents"] = summary.error.in_sample_rms_cents
    numbers["leave_one_out_rms_cents"] = summary.error.leave_one_out_rms_cents
    numbers["n_warnings"] = float(len(summary.warnings))
    return numbers


def _log_correlation(joint: JointMoments, a: str, b: str) -> float | None:
    """Correlation of the logarithms of two quantities; None where one of them is exact."""
    i, j = JOINT_NAMES.index(a), JOINT_NAMES.index(b)
    sd_product = (joint.log_covariance[i][i] * joint.log_covariance[j][j]) ** 0.5
    return joint.log_covariance[i][j] / sd_product if sd_product > 0.0 else None


_MOST_COPIES = 3


def mark_copied_readings(rows: Sequence[BoardRow]) -> list[BoardRow]:
    """The rows, with a doubt on each board whose readings equal those of another board to the last digit."""
    board_names: dict[str, list[str]] = defaultdict(list)
    for row in rows:
        board_names[row.readings_sha256].append(row.name)
    marked_rows = []
    for row in rows:
        copies = [name for name in board_names[row.readings_sha256] if name != row.name] if row.readings_sha256 else []
        if copies:
            surplus = f" and {len(copies) - _MOST_COPIES} more" if len(copies) > _MOST_COPIES else ""
            listed = ", ".join(copies[:_MOST_COPIES]) + surplus
            doubt = f"every reading is that of {listed} to the last digit: one board twice, or a copy?"
            row = replace(row, doubt="; ".join(filter(None, (doubt, row.doubt))))
        marked_rows.append(row)
    return marked_rows


FORMAT = 1
_MOST_FAILURES = 10


@dataclass(frozen=True)
class FailedBoard:
    """A board that was not fitted: its name, its outcome and the message of the error."""

    name: str
    outcome: str
    message: str


@dataclass(frozen=True)
class DoubtfulBoard:
    """A fitted board whose constants are not to be trusted, and why."""

    name: str
    doubt: str


@dataclass(frozen=True)
class BatchSummary:
    """The outcome of a batch; tuples are in the order of the names."""

    format: int
    seed: int  # from which the seed of each board follows
    versions: Mapping[str, str]
    n_boards: int
    n_fitted: int
    n_failed: int
    failed: tuple[FailedBoard, ...]
    doubts: tuple[DoubtfulBoard, ...]
    aside: tuple[str, ...]  # files that are cards of another kind

    def failures_text(self, table: str) -> str:
        """The boards that were not fitted: the first ten with their reasons, and the table that has the others."""
        others = ", the others are written" if self.n_fitted else ""
        lines = [f"{self.n_failed} of {self.n_boards} boards were not fitted{others}:"]
        lines += [f"{failure.name}: {failure.outcome}: {failure.message}" for failure in self.failed[:_MOST_FAILURES]]
        if self.n_failed > _MOST_FAILURES:
            lines.append(f"and {self.n_failed - _MOST_FAILURES} more, in {table}")
        return "\n".join([*lines, "correct their cards or rows: --resume then fits these alone"])
