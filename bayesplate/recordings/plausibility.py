"""How probable it is that what was fitted is no mode of the board, and why: noise, hum, a split peak, a faint line.

What is not said by the records themselves comes from how modes of boards differ from everything else: their residues
are real, they are alike from hit to hit, they are rarely a hundred times weaker than others nearby, they are damped
about alike, and where the peak of one mode is not simple, a fit gives it a weaker neighbour within its own width that
moves as it does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Bools, Floats
from bayesplate.recordings.local_fit import STEADY
from bayesplate.recordings.modes_found import Mode
from bayesplate.recordings.spectra import Spectra
from bayesplate.recordings.strength import Answer, answers

FAINT, FAINT_FACTOR = 0.01, 4.5
"""Strength of what is no mode over that of modes nearby, log-normal: its median and factor."""
SPLIT, SPLIT_FACTOR = 0.05, 2.7
"""The same of the second part of a peak that is not simple over the first."""
UNLIKE = "not alike from hit to hit"
"""What is called so a mode is not, if all hits were between the same two places."""
REACH = 3.0
"""Widths (both decay rates together) within which a second part lies."""
_REAL, _REAL_SHARE = 12.0, 0.85
"""Degrees by which a mode's residue is complex, and how often this holds."""
_BROAD_ODDS, _BROAD, _BROAD_FACTOR = 0.03, 0.03, 1.7
"""Of something broad on which modes stand, against a mode, before its damping is looked at; median and factor of its
damping ratio, log-normal."""
_ALIKE_FACTOR, _ALIKE_MODES = 1.8, 6.0
"""By how much the damping ratios of a board's modes differ, before they are seen, and what that counts, in modes."""
_UNSTABLE = 3.0
"""Odds that are added to what only windows of one width show."""
_MAINS = (50.0, 60.0)
_NEAR_MAINS = 0.5
"""Hz."""
_UNLIKE_PRIOR = 1.0 / 9.0


class Verdict(NamedTuple):
    """Whether a mode is one."""

    spurious: float
    """Probability that it is none."""
    kind: str
    """What it is otherwise: "noise", "hum", "a steady line", "part of NNN Hz", "faint", "something broad", `UNLIKE`."""
    part_of: int = -1
    """Number of the mode of which it is likeliest a part."""


@dataclass(frozen=True, eq=False)
class Peak:
    """A mode as it was fitted and judged last; `other`, as it was with a part of it as a mode of its own."""

    mode: Mode
    answer: Answer
    verdict: Verdict
    other: Mode
    doubt: float = 1.0
    """Probability that the part is none."""

    @property
    def pole(self) -> Floats:
        """Frequency and decay rate averaged over both: (2,) array, Hz."""
        return self.doubt * self.mode.pole + (1.0 - self.doubt) * self.other.pole

    @property
    def split(self) -> Floats:
        """Standard deviations of both for not knowing which of the two it is: (2,) array, Hz."""
        return np.abs(self.mode.pole - self.other.pole) * np.sqrt(self.doubt * (1.0 - self.doubt))

    @property
    def is_likely(self) -> bool:
        return self.verdict.spurious < 0.5


def judged(spectra: Spectra, modes: Sequence[Mode]) -> list[Peak]:
    """Fitted modes with how they answer and a verdict on each."""
    answered = answers(spectra, modes)
    every = zip(modes, answered, verdicts(spectra, modes, answered), strict=True)
    return [Peak(mode, answer, verdict, mode) for mode, answer, verdict in every]


def verdicts(spectra: Spectra, modes: Sequence[Mode], answered: Sequence[Answer]) -> list[Verdict]:
    """A verdict for each mode; the probabilities of different reasons are taken as independent."""
    if not modes:
        return []
    judged = _Beside(spectra, modes, answered)
    return [judged.verdict(m) for m in range(len(modes))]


def part_words(hertz: float) -> str:
    return f"part of {hertz:.1f} Hz"


class _Beside:
    """All modes that a verdict on one of them is held against."""

    def __init__(self, spectra: Spectra, modes: Sequence[Mode], answered: Sequence[Answer]) -> None:
        self.modes, self.answered = modes, answered
        self.n_places, self.n_records = len(spectra.between), spectra.places.size
        self.has_force = spectra.force is not None
        hertz = np.array([mode.frequency for mode in modes])
        self.strengths = np.array([one.strength for one in answered])
        self.steady = np.array([mode.decay * spectra.duration < STEADY for mode in modes])
        self.usual = _usual(hertz, self.strengths, ~self.steady)
        strong = hertz[~self.steady & (self.strengths > 0.2 * self.usual)]
        self.spacing = float(np.ptp(strong)) / max(strong.size - 1, 1) if strong.size > 1 else 50.0
        weights = np.where(self.steady, 0.0, self.strengths / self.usual)
        self.broad = broad_odds(np.array([mode.damping for mode in modes]), weights)

    def verdict(self, m: int) -> Verdict:
        mode, alike = self.modes[m], self.answered[m].alike
        unlike = _unlike(alike, self.n_places, self.n_records - self.n_places)
        lines = self._of_lines(m, unlike)
        split, part_of = self._part(m)
        unstable = 1.0 if mode.seen == 1.0 else _UNSTABLE
        odds = {"something broad": self.broad[m], "faint": self._faint(m) * unstable, "part": split * unstable}
        reasons = {"noise": mode.expected / (1.0 + mode.expected), UNLIKE: unlike, **lines}
        reasons |= {name: 1.0 - 1.0 / (1.0 + one) for name, one in odds.items()}
        spurious = min(1.0 - float(np.prod([1.0 - one for one in reasons.values()])), 1.0)
        worst = max(lines or reasons, key=lambda name: reasons[name])
        if reasons[worst] < 0.05:
            return Verdict(spurious, "")
        if worst == "part":
            return Verdict(spurious, part_words(self.modes[part_of].frequency), part_of)
        return Verdict(spurious, worst)

    def _of_lines(self, m: int, unlike: float) -> dict[str, float]:
        """Probability of hum of the mains, or of another line that does not decay."""
        mode = self.modes[m]
        off = min(abs(mode.frequency - base * round(mode.frequency / base)) for base in _MAINS)
        is_mains = mode.frequency > 40.0 and off < _NEAR_MAINS and mode.decay < _NEAR_MAINS
        if is_mains and (self.steady[m] or unlike > 0.5):
            return {"hum": 0.97}
        return {"a steady line": 0.9} if self.steady[m] else {}

    def _faint(self, m: int) -> float:
        """Odds that it is a faint line of something else, against its being a mode."""
        ratio = self.strengths[m] / self.usual[m]
        return float(_log_normal(ratio, FAINT, FAINT_FACTOR) / self._of_mode(m) * self._off_real(m))

    def _part(self, m: int) -> tuple[float, int]:
        """Odds that it is a part of a stronger mode, against its being one, and of which mode."""
        mode, split, part_of = self.modes[m], 0.0, -1
        for k, other in enumerate(self.modes):
            width = mode.decay + other.decay
            is_stronger = self.strengths[k] > self.strengths[m]
            if abs(mode.frequency - other.frequency) > REACH * width or not is_stronger or self.steady[k]:
                continue
            share = self.strengths[m] / self.strengths[k]
            odds = _log_normal(share, SPLIT, SPLIT_FACTOR) / self._of_mode(m) * self.spacing / (2.0 * REACH * width)
            odds *= self._off_real(m) * _pattern(self.answered[m], self.answered[k])
            odds /= 1.0 + self.broad[k]  # the ground has no parts
            if self.has_force and share > 0.3:
                reach, angle = float(np.degrees(np.arctan(2.0 * share))), self.answered[k].complexity
                odds *= (_uniform(reach) if angle <= reach else 0.2 * _uniform(90.0)) / _of_real(angle)
            if odds > split:
                split, part_of = odds, k
        return float(split), part_of

    def _of_mode(self, m: int) -> float:
        """Density of the strength of modes."""
        ratio = self.strengths[m] / self.usual[m]
        return float(max(ratio * np.exp(-ratio), 1e-12) if ratio < 1.0 else np.exp(-1.0))

    def _off_real(self, m: int) -> float:
        """Odds by the angle of its residues, which those of a mode have not."""
        return _uniform(90.0) / _of_real(self.answered[m].complexity) if self.has_force else 1.0


def _usual(hertz: Floats, strengths: Floats, rings: Bools) -> Floats:
    """Strength of the stronger modes that ring down within an octave of each, of all where none does: (n_modes,)."""
    near = (np.abs(np.log2(hertz[:, None] / hertz)) <= 1.0) & rings
    return np.array([np.quantile(strengths[row if row.any() else slice(None)], 0.7) for row in near])


def broad_odds(damping: Floats, strengths: Floats) -> Floats:
    """Odds that modes are something broad on which others stand, from their damping ratios: (n_modes,) array.

    Wood damps the modes of one board about alike; what a fit needs besides, as the tail of modes that it did not find,
    is broader. Strengths are over the usual ones: by them modes tell how a board damps.
    """
    logs, weights = np.log(damping), np.minimum(strengths, 1.0)
    middle = weighted_median(logs, weights)
    off = np.minimum(np.abs(logs - middle), 2.0 * np.log(_ALIKE_FACTOR))  # some of them are no modes
    variance = _ALIKE_MODES * np.log(_ALIKE_FACTOR) ** 2 + np.sum(weights * off**2)
    sd = float(np.sqrt(variance / (_ALIKE_MODES + weights.sum())))
    broad = _normal(logs - np.log(_BROAD), np.log(_BROAD_FACTOR))
    return np.asarray(_BROAD_ODDS * broad / np.maximum(_normal(np.maximum(logs - middle, 0.0), sd), 1e-12))


def weighted_median(values: Floats, weights: Floats) -> float:
    """The value with half of the weight on either side."""
    return float(np.quantile(values, 0.5, weights=weights + 1e-12, method="inverted_cdf"))


def _unlike(alike: float, n_places: int, spare: int) -> float:
    """Probability that residues are alike from hit to hit by chance only."""
    from scipy.special import betaln

    if spare < 2 or alike >= 1.0:
        return 0.0
    low = max(alike, 1e-9)
    by_chance = np.exp((n_places - 1) * np.log(low) + (spare - 1) * np.log1p(-low) - betaln(n_places, spare))
    of_mode = 20.0 * low**19
    odds = _UNLIKE_PRIOR * by_chance / max(of_mode, 1e-300)
    return float(odds / (1.0 + odds)) if np.isfinite(odds) else 1.0


def _log_normal(value: float, median: float, factor: float) -> float:
    """Density of the logarithm; above the median as far as it is exceeded only."""
    return float(_normal(np.maximum(np.log(value / median), 0.0), np.log(factor)))


def _normal(off: Floats, sd: float) -> Floats:
    return np.asarray(np.exp(-0.5 * (off / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi)))


def _uniform(reach: float) -> float:
    return 1.0 / (2.0 * reach)


def _of_real(angle: float) -> float:
    """Density of the angle of a mode's residue, per degree."""
    return float(_REAL_SHARE * _normal(np.asarray(angle), _REAL) + (1.0 - _REAL_SHARE) / 180.0)


def _pattern(one: Answer, other: Answer) -> float:
    """How much likelier two residues are alike over the places if both are of one mode than if they are of two."""
    n = one.mobility.size
    if n < 2:
        return 1.0
    inner = np.abs(np.sum(one.mobility.conj() * other.mobility)) ** 2
    alike = float(inner / max(np.sum(np.abs(one.mobility) ** 2) * np.sum(np.abs(other.mobility) ** 2), 1e-300))
    alike = float(np.clip(alike, 1e-6, 1.0 - 1e-6))
    from scipy.special import betaln

    of_one = 10.0 * alike**9
    of_two = np.exp(-0.5 * np.log(alike) + (0.5 * (n - 1) - 1.0) * np.log1p(-alike) - betaln(0.5, 0.5 * (n - 1)))
    return float(of_one / max(of_two, 1e-9))
