"""Labels of picked peaks: the assignment likelihood of the spectrum, residues between known places, and sand.

Ways to label the lower peaks come from `bayesplate.posterior.first_labels`; about the constants of each, all peaks are
assigned to modes by the likelihood that the fit uses, with what residues and sand say of each pair added to it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.commands.assigned import MostlyKnown, bare_board, mostly_known
from bayesplate.errors import NotIdentifiableError
from bayesplate.posterior.first_labels import FEWEST_PEAKS, probable_ways
from bayesplate.recordings.patterns import residue_evidence, sign_odds
from bayesplate.recordings.sand import sand_evidence

if TYPE_CHECKING:
    from bayesplate.board.board import Board
    from bayesplate.board.prior import PriorCard
    from bayesplate.recordings.picking import Picked, PickedMode

Floats = NDArray[np.float64]

MOST_PROPOSING = 12
"""Lowest peaks whose labels are proposed: higher ones lie where a thin plate is less and less like a real one."""
_LEAST_SHARE, _MOST_WAYS = 0.01, 3
_POLARITY_SURE = float(np.log(20.0))
_STATED, _BEYOND_DOUBT = 0.5, 0.99
"""Probability from which on a label is stated: where sand and residues speak for it too, and where they do not."""
_GRID = np.linspace(0.0, 1.0, 61)
_MOSTLY, _CLEARLY = 0.9, float(np.log(20.0))
"""Probability of a mode by the frequencies, and ln of the odds by the sand, from which on the two are compared."""
_NEAR = 0.15
"""Relative distance within which sand and residues choose among the modes."""
_OFF = 0.03
"""Relative distance up to which a picture of sand belongs to a peak."""
_OBLONG = 0.01
"""Product of the logarithms of two aspect ratios from which on it matters that one is oblong the other way."""


@dataclass(frozen=True, eq=False)
class Labels:
    """Labels of the likely peaks.

    Attributes
    ----------
    probabilities : tuple of dict of float
        Of each likely peak: its labels, the most probable first.
    by_evidence : tuple of dict of float
        The same from sand and residues alone, among the modes nearby; empty where neither tells anything.
    flips : bool or None
        Whether force and response have opposite polarity; None if that does not show.
    doubts : tuple of str
        Pictures that show another mode than their frequency says.
    """

    probabilities: tuple[dict[str, float], ...]
    by_evidence: tuple[dict[str, float], ...]
    flips: bool | None
    doubts: tuple[str, ...] = ()

    def of(self, peak: int) -> list[tuple[str, float]]:
        """Labels of one likely peak, the most probable first."""
        return [*self.probabilities[peak].items()]

    def stated(self, peak: int) -> tuple[str, float] | None:
        """The label that a card may state, and the confidence in it; None where it is left to the fit.

        It is the most probable by all that is known. Sand and residues are not known to the fit: where they say the
        same, theirs is the confidence. What the frequencies alone say the fit finds out by itself, and would use twice,
        unless it is beyond doubt: then it is where the fit can begin.
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
    """Labels of the likely peaks, from a board of which sizes and edges are known.

    Parameters
    ----------
    board : Board
        With one setup; what was read in it before is not used.
    flips : bool or None
        Whether force and response have opposite polarity; None if that is to be found.
    pictures : mapping
        Number of a likely peak to pictures of sand at its frequency.

    Raises
    ------
    NotIdentifiableError
        If there are too few peaks for constants to begin with.
    """
    likely = picked.likely
    if len(likely) < FEWEST_PEAKS:
        raise NotIdentifiableError(f"{FEWEST_PEAKS} peaks or more are needed to tell modes by their frequencies")
    unsigned = bare_board(board, likely, picked, None)
    ways = probable_ways(bare_board(board, likely[:MOST_PROPOSING], picked, None), prior)
    ways = [(way, share) for way, share in ways if share > _LEAST_SHARE][:_MOST_WAYS]
    if not ways:
        raise NotIdentifiableError("no plate of these sizes and edges has such peaks")
    known = [mostly_known(way, unsigned) for way, _ in ways]
    shares = np.array([share for _, share in ways])
    if flips is None and picked.spectra.force is not None and _residues(known[0], picked) is not None:
        flips = _flips(known, shares, picked)
    if flips is not None:
        signed = bare_board(board, likely, picked, flips)
        known = [one.with_peaks(signed) for one in known]
    doubts = tuple(_other_modes(known[int(np.argmax(shares))], likely, pictures))
    evidence = [_evidence(one, picked, pictures) for one in known]
    weights = np.log(shares) + [one.gain(own) for one, own in zip(known, evidence, strict=True)]
    shares = np.exp(weights - weights.max())
    shares /= shares.sum()
    totals: list[dict[str, float]] = [{} for _ in likely]
    alone: list[dict[str, float]] = [{} for _ in likely]
    for one, own, share in zip(known, evidence, shares, strict=True):
        _add(totals, one.probabilities(own), one.names, share)
        _add(alone, _alone(own, one, likely), one.names, share)
    return Labels(tuple(map(_sorted, totals)), tuple(map(_sorted, alone)), flips, doubts)


def _add(totals: list[dict[str, float]], probabilities: Floats, names: Sequence[str], share: float) -> None:
    for total, row in zip(totals, probabilities, strict=True):
        for name, one in zip(names, row, strict=True):
            if one > 0.0:
                total[name] = total.get(name, 0.0) + share * float(one)


def _sorted(total: dict[str, float]) -> dict[str, float]:
    return dict(sorted(total.items(), key=lambda item: -item[1]))


def _residues(known: MostlyKnown, picked: Picked) -> Floats | None:
    """Residues of the modes between the places, 1/kg: (n_modes, n_places) array; None if a place is not known."""
    columns = []
    for hammer, sensor in picked.spectra.between:
        if hammer is None or sensor is None:
            return None
        columns.append(known.deflections(hammer) * known.deflections(sensor))
    return np.stack(columns, axis=1)


def _flips(known: Sequence[MostlyKnown], shares: Floats, picked: Picked) -> bool | None:
    """Whether force and response have opposite polarity, where the signs leave no doubt."""
    odds = 0.0
    for one, share in zip(known, shares / shares.sum(), strict=True):
        residues, probabilities = _residues(one, picked), one.probabilities(None)
        assert residues is not None
        if residues.shape[1] == 1:
            signs = np.array([np.sign(m.mobility[0]) if m.complexity < 45.0 else 0.0 for m in picked.likely])
            odds += share * sign_odds(signs, residues[:, 0], one.largest, probabilities)
        else:
            odds += (
                share
                * residue_evidence(*_measured(picked.likely), residues, one.largest, probabilities, has_force=True)[1]
            )
    return None if abs(odds) < _POLARITY_SURE else bool(odds < 0.0)


def _measured(likely: Sequence[PickedMode]) -> tuple[Floats, Floats]:
    return np.array([one.mobility for one in likely]), np.array([one.mobility_sd for one in likely])


def _evidence(known: MostlyKnown, picked: Picked, pictures: Mapping[int, Sequence[Floats]]) -> Floats:
    """ln of what residues and sand say of each pair of a likely peak and a mode: (n_likely, n_modes) array."""
    probabilities = known.probabilities(None)
    evidence = np.zeros(probabilities.shape)
    residues = _residues(known, picked)
    # without a force each place has a gain and a sign of its own, and so has each mode between two places
    if residues is not None and picked.spectra.force is not None:
        measured, sd = _measured(picked.likely)
        evidence += residue_evidence(measured, sd, residues, known.largest, probabilities, has_force=True)[0]
    for peak, own in pictures.items():
        for picture in own:
            evidence[peak] += sand_evidence(picture, known.shapes(_GRID))
    return evidence


def _other_modes(
    known: MostlyKnown, likely: Sequence[PickedMode], pictures: Mapping[int, Sequence[Floats]]
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
                    f"the sand at {likely[peak].frequency:.4g} Hz shows {known.names[shown]}, and its frequency is "
                    f"that of {known.names[expected]}: is it the picture of this peak, x from left to right?"
                )


def _alone(evidence: Floats, known: MostlyKnown, likely: Sequence[PickedMode]) -> Floats:
    """Probabilities by sand and residues alone, among the modes near each peak."""
    hertz = np.array([one.frequency for one in likely])
    near = np.abs(np.log(known.hertz / hertz[:, None])) < _NEAR
    tells = np.abs(evidence).max(axis=1, keepdims=True) > 0.0
    weights = np.where(near & tells, np.exp(evidence), 0.0)
    return np.asarray(weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-300))


def pictures_of(picked: Picked, pictures: Mapping[float, Floats]) -> tuple[dict[int, list[Floats]], list[str]]:
    """Pictures by the number of the likely peak nearest to their frequency, and those without one."""
    found: dict[int, list[Floats]] = {}
    told = []
    likely = picked.likely
    for hertz, picture in pictures.items():
        off = [abs(mode.frequency / hertz - 1.0) for mode in likely]
        if not off or min(off) > _OFF:
            told.append(f"no peak within {100.0 * _OFF:g} % of the sand at {hertz:g} Hz")
        else:
            found.setdefault(off.index(min(off)), []).append(picture)
    return found, told


def upright(board: Board, pictures: Mapping[float, Floats]) -> tuple[dict[float, Floats], list[str]]:
    """Pictures but those that are oblong the other way than their board, and what to do about these."""
    nominal = board.nominal()
    x, y = (1e3 * nominal[side] for side in ("length_x", "length_y"))
    aspects = {hertz: picture.shape[1] / picture.shape[0] for hertz, picture in pictures.items()}
    crosswise = [hertz for hertz, aspect in aspects.items() if log(aspect) * log(x / y) < -_OBLONG]
    form = "higher than wide" if x > y else "wider than high"
    told = [
        f"the sand at {hertz:g} Hz left out: the picture is {form}, the board {x:.0f} mm along x and {y:.0f} mm "
        "along y; turn it, x from left to right"
        for hertz in crosswise
    ]
    return {hertz: picture for hertz, picture in pictures.items() if hertz not in crosswise}, told
