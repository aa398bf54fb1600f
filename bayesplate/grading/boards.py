"""A board of many as a row of a table, and what became of all of them: batch.json; SI units."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.results.contract import JOINT, Joint, Spread
from bayesplate.results.summary import Summary

FITTED = "fitted"
MAKERS = (
    "density",
    "wave_speed_x",
    "wave_speed_y",
    "radiation_ratio_x",
    "radiation_ratio_y",
    "impedance_x",
    "anisotropy",
)
"""Which of the derived quantities a table of many boards has."""
_ENDS = ("mean", "sd", "q05", "q50", "q95")
_CORRELATED = (*MODULI, "density")
_PAIRS = tuple((a, b) for i, a in enumerate(_CORRELATED) for b in _CORRELATED[i + 1 :])
WORDS = ("name", "outcome", "message", "doubt", "card_sha256", "seed", "theory", "law", "effects", "prior")
"""Columns of texts, but for the seed."""
NUMBERS = (
    *(f"{name}_{end}" for name in MODULI for end in _ENDS),
    *(f"{name}_{end}" for name in (*RIGIDITIES, *MAKERS) for end in ("mean", "sd")),
    *(f"correlation_{a}_{b}" for a, b in _PAIRS),
    "n_modes",
    "in_sample_rms_cents",
    "leave_one_out_rms_cents",
    "n_warnings",
)
"""Columns of numbers; correlations are those of logarithms."""


@dataclass(frozen=True)
class BoardRow:
    """What became of one board of many."""

    name: str  # of a card that could not be read that of its file
    outcome: str  # "fitted", or why there are no constants, in two or three words
    message: str = ""  # of the error
    doubt: str = ""  # why the constants of a fitted board are not to be trusted
    card_sha256: str = ""
    seed: int | None = None
    told: Mapping[str, str] | None = None  # of a fitted board, by the names of `WORDS`
    numbers: Mapping[str, float | None] | None = None  # likewise of `NUMBERS`
    joint: Joint | None = None  # how its constants vary together
    readings_sha256: str = ""

    @property
    def is_fitted(self) -> bool:
        """Whether it has constants."""
        return self.outcome == FITTED

    def cells(self) -> list[str | float | int | None]:
        """The row, in the order of `WORDS` and `NUMBERS`."""
        told, numbers = self.told or {}, self.numbers or {}
        texts = [self.name, self.outcome, self.message, self.doubt, self.card_sha256, self.seed]
        return [*texts, *(told.get(word) for word in WORDS[len(texts) :]), *(numbers.get(name) for name in NUMBERS)]


def row_of(summary: Summary) -> BoardRow:
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
        numbers=_numbers(summary),
        joint=summary.joint,
    )


def _numbers(summary: Summary) -> dict[str, float | None]:
    found: dict[str, float | None] = {}
    for name, entry in summary.elastic.items():
        found |= {f"{name}_{end}": getattr(entry, end) for end in _ENDS}
    spreads: dict[str, Spread] = {**dict(summary.rigidity.items()), **{name: summary.derived[name] for name in MAKERS}}
    for name, entry in spreads.items():
        found |= {f"{name}_mean": entry.mean, f"{name}_sd": entry.sd}
    found |= {f"correlation_{a}_{b}": _correlation(summary.joint, a, b) for a, b in _PAIRS}
    found["n_modes"] = float(len(summary.modes))
    found["in_sample_rms_cents"] = summary.error.in_sample_rms_cents
    found["leave_one_out_rms_cents"] = summary.error.leave_one_out_rms_cents
    found["n_warnings"] = float(len(summary.warnings))
    return found


def _correlation(joint: Joint, a: str, b: str) -> float | None:
    """Of two logarithms; None where one of them is exact."""
    i, j = JOINT.index(a), JOINT.index(b)
    spread = (joint.log_covariance[i][i] * joint.log_covariance[j][j]) ** 0.5
    return joint.log_covariance[i][j] / spread if spread > 0.0 else None


_MOST_NAMED = 3


def with_copies_in_doubt(rows: Sequence[BoardRow]) -> list[BoardRow]:
    """The rows; those of boards whose readings are alike to the last digit say so among their doubts."""
    alike: dict[str, list[str]] = defaultdict(list)
    for row in rows:
        alike[row.readings_sha256].append(row.name)
    found = []
    for row in rows:
        others = [name for name in alike[row.readings_sha256] if name != row.name] if row.readings_sha256 else []
        if others:
            more = f" and {len(others) - _MOST_NAMED} more" if len(others) > _MOST_NAMED else ""
            which = ", ".join(others[:_MOST_NAMED]) + more
            copied = f"every reading is that of {which} to the last digit: one board twice, or a copy?"
            row = replace(row, doubt="; ".join(filter(None, (copied, row.doubt))))
        found.append(row)
    return found


FORMAT = 1
_MOST_TOLD = 10


@dataclass(frozen=True)
class Failure:
    """A board that was not fitted: its name, what became of it, and the message of the error."""

    name: str
    outcome: str
    message: str


@dataclass(frozen=True)
class Doubt:
    """A board that was fitted and whose constants are not to be trusted, and why."""

    name: str
    doubt: str


@dataclass(frozen=True)
class BatchSummary:
    """What became of the boards of a batch; tuples are in the order of the names."""

    format: int
    seed: int  # from which each board's own follows
    versions: Mapping[str, str]
    n_boards: int
    n_fitted: int
    n_failed: int
    failed: tuple[Failure, ...]
    doubts: tuple[Doubt, ...]
    aside: tuple[str, ...]  # files that are cards of another kind

    def failures_text(self, table: str) -> str:
        """The boards that were not fitted, the first ten with their reasons, and where the others stand."""
        lines = [f"{self.n_failed} of {self.n_boards} boards were not fitted, the others are written:"]
        lines += [f"{one.name}: {one.outcome}: {one.message}" for one in self.failed[:_MOST_TOLD]]
        if self.n_failed > _MOST_TOLD:
            lines.append(f"and {self.n_failed - _MOST_TOLD} more, in {table}")
        return "\n".join([*lines, "correct their cards or rows: --resume then fits these alone"])
