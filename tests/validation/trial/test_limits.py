"""Every limit of the trial at its edge: as many boards as its bound allows meet it, one more misses it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from validation.trial.cells import CELLS, NOISES, Cell
from validation.trial.limits import PLANNED, limits
from validation.trial.made_records import GROUP, found_right, made

N = 400
SIX, NINE, BOTH = "cantilever-6", "cantilever-9", "cantilever-6-free-6"
A, B, FURTHER = "fluid_loading", "attached_mass", "clamp_translation"


def large(design, kind="one"):
    return Cell(kind, design, N, size=2.0)


def null(noise, design=SIX):
    return Cell("null", design, N, noise=noise)


LOUD = Cell("one", SIX, N, 17.0)


def right(cell, i, **kept):
    """A record that meets every limit of its cell; intervals of 90 % hold in nine of ten."""
    planted = {"null": (), "one": (A,), "two": (A, B), "outside": ("rib",)}[cell.kind]
    return found_right(cell, i, planted, **kept)


def called(word, effects=(), near=()):
    return lambda cell, i: right(cell, i) | {"word": word, "effects": list(effects), "set": [[[n], 0.5] for n in near]}


named_b = called("named", [B], [B])
in_part_b = lambda cell, i: right(cell, i) | {"in_part": [B]}  # noqa: E731
flagged = called("unexplained")
quiet = called("none needed")
no_more_than_nothing = lambda cell, i: right(cell, i) | {"none": 0.5, "support": 0.5}  # noqa: E731
claimed = lambda cell, i: right(cell, i) | {"claim": True}  # noqa: E731
one_missing = called(GROUP, [A], [A])

AT_MOST = [
    *((f"null, {d}, {words}: uniquely named", null(noise, d), named_b, 0.02) for noise, words in NOISES.items()
      for d in (SIX, BOTH)),
    ("one cantilever-6 5c 2x: unique and wrong", large(SIX), named_b, 0.05),
    ("two cantilever-6-free-6 5c 2x: unique and wrong", large(BOTH, "two"), called("named", ["grain_angle", A]), 0.05),
    ("cantilever-6, 5 cents, 2x: none needed", large(SIX), quiet, 200 / 1200),
    ("outside the library, cantilever-6: falsely unique", large(SIX, "outside"), named_b, 0.10),
    ("outside the library, cantilever-6-free-6: falsely unique", large(BOTH, "outside"), named_b, 0.10),
    ("outside the library, cantilever-6: named, or named in part", large(SIX, "outside"), named_b, 0.10),
    ("outside the library, cantilever-6: named, or named in part", large(SIX, "outside"), in_part_b, 0.10),
    ("17 cents: unique and wrong", LOUD, named_b, 0.02),
    ("claim made on a null", null("drawn"), claimed, 0.01),
]  # fmt: skip
AT_LEAST = [
    ("one effect, cantilever-6: in the set given", large(SIX), called(GROUP, [B], [B]), 0.90),
    ("top-1, cantilever-6, 5 cents, 2x", large(SIX), no_more_than_nothing, 0.65),
    ("top-1, cantilever-9, 5 cents, 2x", large(NINE), no_more_than_nothing, 0.85),
    ("top-1, cantilever-6-free-6, 5 cents, 2x", large(BOTH), no_more_than_nothing, 0.90),
    ("two effects: both in the set", large(BOTH, "two"), one_missing, 0.65),
]


def by_name(cells, records):
    """Limits by what they ask."""
    by_cell = {cell.name: [] for cell in cells}
    for record in records:
        by_cell[record["cell"]].append(record)
    return {limit["quantity"]: limit for limit in limits(cells, by_cell)}


def with_wrong(cell, wrong, n_wrong):
    return [wrong(cell, i) if i < n_wrong else right(cell, i) for i in range(N)]


COUNTS = np.arange(1, N)
LOWER = np.r_[0.0, stats.beta.ppf(0.025, COUNTS, N - COUNTS + 1), 0.025 ** (1 / N)]
UPPER = np.r_[1 - 0.025 ** (1 / N), stats.beta.ppf(0.975, COUNTS + 1, N - COUNTS), 1.0]
"""Exact bounds of every count of N, from the beta distribution."""


def most_allowed(limit):
    """The largest count whose upper bound is at most a limit."""
    return int(np.flatnonzero(limit >= UPPER).max())


def fewest_allowed(limit):
    """The smallest count whose lower bound is at least a limit."""
    return int(np.flatnonzero(limit <= LOWER).min())


@pytest.mark.parametrize(("quantity", "cell", "wrong", "limit"), AT_MOST, ids=[case[0] for case in AT_MOST])
def test_a_limit_from_above_at_its_edge(quantity, cell, wrong, limit):
    most = most_allowed(limit)
    assert [by_name((cell,), with_wrong(cell, wrong, n))[quantity]["met"] for n in (most, most + 1)] == [True, False]


@pytest.mark.parametrize(("noise", "words"), NOISES.items())
def test_boards_that_lack_nothing_are_flagged_as_often_as_the_rules_do_it_by_design(noise, words):
    """Five in a hundred by the gate of the misfit, two by the need of an effect, as far as the lower bound tells."""
    most = int(np.flatnonzero(LOWER <= 0.07).max())
    cell, quantity = null(noise), f"null, {SIX}, {words}: flagged at all"
    assert [by_name((cell,), with_wrong(cell, flagged, n))[quantity]["met"] for n in (most, most + 1)] == [True, False]


@pytest.mark.parametrize(("quantity", "cell", "wrong", "limit"), AT_LEAST, ids=[case[0] for case in AT_LEAST])
def test_a_limit_from_below_at_its_edge(quantity, cell, wrong, limit):
    most = N - fewest_allowed(limit)
    assert [by_name((cell,), with_wrong(cell, wrong, n))[quantity]["met"] for n in (most, most + 1)] == [True, False]


@pytest.mark.parametrize("quantity", ["constants after tracing, cantilever-9, 2x: 90 % intervals",
                                      "size of what is named right: 90 % intervals"])  # fmt: skip
def test_intervals_cover_within_their_bounds(quantity):
    """At both ends the bounds, not the estimates, decide."""
    cell = large(NINE)
    within = np.flatnonzero((LOWER >= 0.85) & (UPPER <= 0.95))
    met = []
    for k in (within[0] - 1, within[0], within[-1], within[-1] + 1):
        records = []
        for i in range(N):
            size = {"truth": 1.0, "nothing": 0.0, "q05": 0.9 if i < k else 1.01, "q50": 1.1, "q95": 1.2}
            records.append(right(cell, i, averaged=[i < k] * 3, amplitudes={A: size}))
        met.append(by_name((cell,), records)[quantity]["met"])
    assert met == [False, True, True, False]


def test_sizes_err_by_a_quarter_at_most_with_their_upper_bound():
    """Order statistics 180 and 221 of 400 hold their median with 95 %, so that 179 may be off."""
    cell = large(SIX)
    quantity = "size of what is named right: median relative error"
    for n_off, met in ((179, True), (180, False)):
        errors = [0.26 if i < n_off else 0.24 for i in range(N)]
        sizes = [{"truth": 1.0, "nothing": 0.0, "q05": 0.5, "q50": 1.0 + e, "q95": 2.0} for e in errors]
        records = [right(cell, i, amplitudes={A: size}) for i, size in enumerate(sizes)]
        assert by_name((cell,), records)[quantity]["met"] is met


def test_sets_hold_two_and_a_half_effects_at_most():
    """220 pairs and 180 triples: 2.45, and its upper bound 2.499; one triple more is too many."""
    cell = large(SIX)
    for n_pairs, met in ((220, True), (219, False)):
        records = [called(GROUP, [A], [A, B] if i < n_pairs else [A, B, "grain_angle"])(cell, i) for i in range(N)]
        limit = by_name((cell,), records)["one effect, cantilever-6: mean size of the set"]
        assert limit["value"] == pytest.approx(3.0 - n_pairs / N)
        assert limit["met"] is met


def test_a_bar_counts_all_classes_and_those_planned_first_stand_beside_it():
    assert FURTHER not in PLANNED
    cell = large(SIX)
    records = [right(cell, i) if i % 2 else made(cell, i, [FURTHER], "none needed", best=[A]) for i in range(N)]
    limit = by_name((cell,), records)["top-1, cantilever-6, 5 cents, 2x"]
    assert (limit["count"], limit["n"], limit["met"]) == (200, 400, False)
    assert "of the classes planned first 200/200 = 100.0 %" in limit["note"]
    assert "weakest: clamp_translation 0 %" in limit["note"]


def test_a_trial_that_finds_everything_meets_every_bar_and_one_without_truth_does_not():
    """All cells as they are, 90 % of the intervals right; then the truths dealt out anew."""
    rng = np.random.default_rng(0)
    records = []
    for cell in CELLS:
        for i in range(cell.n):
            planted = cell.draw_effects(rng)
            size = {"truth": 1.0, "nothing": 0.0, "q05": 0.9 if i % 10 else 1.01, "q50": 1.1, "q95": 1.2}
            kept = {"averaged": [bool(i % 10)] * 3, "amplitudes": {A: size} if cell.kind == "one" else {}}
            record = found_right(cell, i, planted, **kept)
            records.append(quiet_if_loud(cell, record))
    found = by_name(CELLS, records)
    assert [name for name, limit in found.items() if not limit["met"]] == []
    assert len(found) == 2 * 4 * 5 + 12 + 2 * 5 + 3 + 1 + 2 * 2 + 1 + 2 + 2 * 5 + 2 + 1
    assert not any("planned" in name or "further" in name for name in found)

    shuffled = []
    by_cell = {cell.name: [] for cell in CELLS}
    for record in records:
        by_cell[record["cell"]].append(record)
    for own in by_cell.values():
        shuffled += [r | {"truth": own[j]["truth"]} for r, j in zip(own, rng.permutation(len(own)), strict=True)]
    missed = [name for name, limit in by_name(CELLS, shuffled).items() if not limit["met"]]
    for words, n in (("unique and wrong", 11), ("in the set given", 5), ("top-1", 3), ("both in the set", 1)):
        assert sum(words in name for name in missed) == n, words


def quiet_if_loud(cell, record):
    return record | {"word": "none needed", "effects": [], "amplitudes": {}} if cell.noise_cents == 17.0 else record
