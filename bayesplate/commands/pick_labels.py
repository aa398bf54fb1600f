"""Labels of picked peaks: the assignment likelihood of the spectrum, residues between known places, and sand.

Ways to label the lower peaks come from `bayesplate.posterior.first_labels`; about the constants of each, all peaks are
assigned to modes by the likelihood that the fit uses, with what residues and sand say of each pair added to it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import log
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak
from bayesplate.commands.assigned import MostlyKnown
from bayesplate.commands.fragment import spurious_share
from bayesplate.errors import NotIdentifiableError
from bayesplate.posterior.first_labels import FEWEST_PEAKS, probable_ways
from bayesplate.recordings.patterns import residue_evidence, sign_odds
from bayesplate.recordings.sand import sand_evidence, straightened

if TYPE_CHECKING:
    from bayesplate.board.board import Board
    from bayesplate.board.prior import PriorCard
    from bayesplate.recordings.contract import PickedRow
    from bayesplate.recordings.picking import Picked


MOST_PROPOSING = 12
"""Lowest peaks whose labels are proposed: higher ones lie where a thin plate is less and less like a real one."""
_LEAST_SHARE, _MOST_WAYS = 0.01, 3
_POLARITY_SURE = log(20.0)
_STATED, _BEYOND_DOUBT = 0.5, 0.99
"""Probability from which on a label is stated: where sand and residues speak for it too, and where they do not."""
_GRID = np.linspace(0.0, 1.0, 61)
_MOSTLY, _CLEARLY = 0.9, log(20.0)
"""Probability of a mode by the frequencies, and ln of the odds by the sand, from which on the two are compared."""
_NEAR = 0.15
"""Relative distance within which sand and residues choose among the modes."""
_OFF = 0.03
"""Relative distance up to which a picture of sand belongs to a peak."""
_OBLONG = 0.01
"""Product of the logarithms of two aspect ratios from which on it matters that one is oblong the other way."""
_CONTRADICTED = -12.0
"""ln of how much likelier all peaks are with their residues than without, below which the places must be wrong: more
than one peak contradicts every way to label them."""
_OTHER_PLACES = (
    "the residues are those of no modes between these places, and say nothing of the labels: are hammer and sensor "
    "where the files say, in mm from the corner of x0 and y0, and in the order of the files?"
)
_MOST_COMPLEX = 45.0
"""Degrees by which a residue may be complex whose sign tells the polarity."""


@dataclass(frozen=True, eq=False)
class Labels:
    """Labels of the likely peaks."""

    probabilities: tuple[dict[str, float], ...]  # of each likely peak: its labels, the most probable first
    by_evidence: tuple[dict[str, float], ...]  # from sand and residues alone; empty where neither tells anything
    flips: bool | None  # whether force and response have opposite polarity; None if that does not show
    doubts: tuple[str, ...] = ()  # places or pictures that contradict the frequencies

    def stated(self, peak: int) -> tuple[str, float] | None:
        """The label that a card may state, and the confidence in it; None where it is left to the fit.

        Sand and residues are not known to the fit: where they say the same, theirs is the confidence. What frequencies
        say the fit finds out by itself, and would use twice, unless it is beyond doubt: then the fit can begin there.
        """
        name, share = next(iter(self.probabilities[peak].items()), ("", 0.0))
        other, by_evidence = next(iter(self.by_evidence[peak].items()), ("", 0.0))
        if share < _STATED or not name.startswith("("):
            return None
        if name == other and by_evidence >= _STATED:
            return name, by_evidence
        return (name, share) if share >= _BEYOND_DOUBT else None


def label_peaks(
    board: Board, prior: PriorCard, picked: Picked, flips: bool | None, pictures: Mapping[int, Sequence[Floats]]
) -> Labels:
    """Labels of the likely peaks, from a board with one setup of which sizes and edges are known.

    `pictures` are straightened ones of sand, by number of the peak. Raises NotIdentifiableError for too few peaks.
    """
    likely = picked.likely
    if len(likely) < FEWEST_PEAKS:
        raise NotIdentifiableError(f"{FEWEST_PEAKS} peaks or more are needed to tell modes by their frequencies")
    ways = probable_ways(_bare(board, likely[:MOST_PROPOSING]), prior)
    ways = [(way, share) for way, share in ways if share > _LEAST_SHARE][:_MOST_WAYS]
    if not ways:
        raise NotIdentifiableError("no plate of these sizes and edges has such peaks")
    known = [MostlyKnown.of(way, _bare(board, likely)) for way, _ in ways]
    shares = np.array([share for _, share in ways])
    doubts = []
    if max(one.gain(_of_residues(one, picked)) for one in known) < _CONTRADICTED:
        doubts.append(_OTHER_PLACES)
        picked = replace(picked, spectra=replace(picked.spectra, between=((None, None),) * len(picked.spectra.between)))
    if flips is None:
        flips = _flips(known, shares, picked)
    if flips is not None:
        signs = [picked.sign(answer, flips) for answer in picked.likely_answers]
        known = [one.with_peaks(_bare(board, likely, signs)) for one in known]
    doubts += _other_modes(known[int(np.argmax(shares))], likely, pictures)
    evidence = [_evidence(one, picked, pictures) for one in known]
    weights = np.log(shares) + [one.gain(own) for one, own in zip(known, evidence, strict=True)]
    shares = np.exp(weights - weights.max())
    shares /= shares.sum()
    every = [*zip(known, evidence, shares, strict=True)]
    by_all = _by_name([(one.names, share * one.probabilities(own)) for one, own, share in every])
    alone = _by_name([(one.names, share * _alone(own, one, likely)) for one, own, share in every])
    return Labels(by_all, alone, flips, tuple(doubts))


def _bare(board: Board, peaks: Sequence[PickedRow], signs: Sequence[str] | None = None) -> Board:
    """A board with peaks in place of all that was read before."""
    (setup,) = board.setups
    every = zip(peaks, signs or [""] * len(peaks), strict=True)
    read = tuple(
        Peak(Quantity.from_mean(peak.hz, peak.sd_hz), sign, spurious=spurious_share([peak])) for peak, sign in every
    )
    return replace(board, setups=(replace(setup, readings=(), peaks=read),))


def _by_name(every: Sequence[tuple[Sequence[str], Floats]]) -> tuple[dict[str, float], ...]:
    """Probabilities of each peak by the names of the modes, summed over the ways, the largest first."""
    totals: list[dict[str, float]] = [{} for _ in every[0][1]]
    for names, probabilities in every:
        for total, row in zip(totals, probabilities.tolist(), strict=True):
            for name, one in zip(names, row, strict=True):
                if one > 0.0:
                    total[name] = total.get(name, 0.0) + one
    return tuple(dict(sorted(total.items(), key=lambda item: -item[1])) for total in totals)


def _residues(known: MostlyKnown, picked: Picked) -> Floats | None:
    """Residues of the modes between the places, 1/kg: (n_modes, n_places) array.

    None where a place is not known, or the force: then each place has a gain and a sign of its own.
    """
    if picked.spectra.force is None:
        return None
    columns = [
        known.deflections(hammer) * known.deflections(sensor)
        for hammer, sensor in picked.spectra.between
        if hammer is not None and sensor is not None
    ]
    return np.stack(columns, axis=1) if len(columns) == len(picked.spectra.between) else None


def _residue_evidence(known: MostlyKnown, picked: Picked, residues: Floats) -> tuple[Floats, float]:
    """What the residues say of each pair of a likely peak and a mode, and of the polarity."""
    answers = picked.likely_answers
    measured, sd = np.array([np.real(one.mobility) for one in answers]), np.array([one.sd for one in answers])
    return residue_evidence(measured, sd, residues, known.largest, known.probabilities(None))


def _of_residues(known: MostlyKnown, picked: Picked) -> Floats:
    """ln of what the residues say of each pair of a likely peak and a mode: (n_likely, n_modes) array."""
    residues = _residues(known, picked)
    if residues is None:
        return np.zeros((len(picked.likely), len(known.names)))
    return _residue_evidence(known, picked, residues)[0]


def _flips(known: Sequence[MostlyKnown], shares: Floats, picked: Picked) -> bool | None:
    """Whether force and response have opposite polarity, where the signs leave no doubt."""
    odds = 0.0
    for one, share in zip(known, shares / shares.sum(), strict=True):
        if (residues := _residues(one, picked)) is None:
            return None
        if residues.shape[1] == 1:
            answers = picked.likely_answers
            signs = [np.sign(a.mobility[0].real) if a.complexity < _MOST_COMPLEX else 0.0 for a in answers]
            odds += share * sign_odds(np.array(signs), residues[:, 0], one.largest, one.probabilities(None))
        else:
            odds += share * _residue_evidence(one, picked, residues)[1]
    return None if abs(odds) < _POLARITY_SURE else bool(odds < 0.0)


def _evidence(known: MostlyKnown, picked: Picked, pictures: Mapping[int, Sequence[Floats]]) -> Floats:
    """ln of what residues and sand say of each pair of a likely peak and a mode: (n_likely, n_modes) array."""
    evidence = _of_residues(known, picked)
    for peak, own in pictures.items():
        for picture in own:
            evidence[peak] += sand_evidence(picture, known.shapes(_GRID))
    return evidence


def _other_modes(
    known: MostlyKnown, likely: Sequence[PickedRow], pictures: Mapping[int, Sequence[Floats]]
) -> Iterator[str]:
    """What to ask of a picture that shows another mode than the one that its peak is by all frequencies."""
    probabilities = known.probabilities(None)
    for peak, own in pictures.items():
        expected = int(np.argmax(probabilities[peak]))
        for picture in own if probabilities[peak, expected] > _MOSTLY else ():
            evidence = sand_evidence(picture, known.shapes(_GRID))
            shown = int(np.argmax(evidence))
            if evidence[shown] - evidence[expected] > _CLEARLY:
                yield (
                    f"the sand at {likely[peak].hz:.4g} Hz shows {known.names[shown]}, and its frequency is "
                    f"that of {known.names[expected]}: is it the picture of this peak, x from left to right?"
                )


def _alone(evidence: Floats, known: MostlyKnown, likely: Sequence[PickedRow]) -> Floats:
    """Probabilities by sand and residues alone, among the modes near each peak."""
    near = np.abs(np.log(known.hertz / np.array([[one.hz] for one in likely]))) < _NEAR
    tells = np.abs(evidence).max(axis=1, keepdims=True) > 0.0
    weights = np.where(near & tells, np.exp(evidence), 0.0)
    return np.asarray(weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-300))


def pictures_of(
    board: Board, likely: Sequence[PickedRow], pictures: Mapping[float, Floats]
) -> tuple[dict[int, list[Floats]], list[str]]:
    """Straightened pictures by the number of the likely peak nearest to them; and why others were left out."""
    nominal = board.nominal()
    x, y = (1e3 * nominal[side] for side in ("length_x", "length_y"))
    form = "higher than wide" if x > y else "wider than high"
    found: dict[int, list[Floats]] = {}
    told = []
    for hertz, picture in pictures.items():
        off = [abs(peak.hz / hertz - 1.0) for peak in likely]
        if log(picture.shape[1] / picture.shape[0]) * log(x / y) < -_OBLONG:
            told.append(
                f"the sand at {hertz:g} Hz left out: the picture is {form}, the board {x:.0f} mm along x and "
                f"{y:.0f} mm along y; turn it, x from left to right"
            )
        elif min(off, default=1.0) > _OFF:
            told.append(f"no peak within {100.0 * _OFF:g} % of the sand at {hertz:g} Hz")
        else:
            found.setdefault(off.index(min(off)), []).append(straightened(picture))
    return found, told
