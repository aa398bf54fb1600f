"""Probability that a fitted mode is spurious, and the reason: noise, hum, a split peak, a faint line.

Beside the records themselves, the judgement rests on what modes of boards have in common: their residues are real and
alike from hit to hit, they are rarely a hundred times weaker than modes nearby, and all are damped about alike. Where
the peak of one mode is not simple, a fit adds a weaker neighbour within its width, with the same pattern over places.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Bools, Floats
from bayesplate.recordings.local_fit import STEADY_DECAY
from bayesplate.recordings.modes_found import Mode
from bayesplate.recordings.spectra import Spectra
from bayesplate.recordings.strength import ModeMobility, mode_mobilities

FAINT_RATIO, FAINT_FACTOR = 0.01, 4.5
"""Strength of a spurious line over that of modes nearby, log-normal: median and factor."""
SPLIT_RATIO, SPLIT_FACTOR = 0.05, 2.7
"""Strength of the second part of a split peak over the first, log-normal: median and factor."""
UNLIKE_HITS = "not alike from hit to hit"
"""The kind of a line whose residues differ from hit to hit between the same two places."""
SPLIT_REACH = 3.0
"""Widths (sum of both decay rates) within which the second part of a split peak lies."""
_REAL_ANGLE, _REAL_SHARE = 12.0, 0.85
"""Standard deviation in degrees of a mode's residue from real, and the share of modes for which this holds."""
_BROAD_ODDS, _BROAD_DAMPING, _BROAD_FACTOR = 0.03, 0.03, 1.7
"""Prior odds of a broad background against a mode; median and factor of its damping ratio, log-normal."""
_ALIKE_FACTOR, _ALIKE_MODES = 1.8, 6.0
"""Prior factor by which the damping ratios of a board's modes differ, and its weight in modes."""
_UNSTABLE_ODDS = 3.0
"""Factor of the odds of a spurious line for a mode that only windows of one width show."""
_MAINS = (50.0, 60.0)
_NEAR_MAINS = 0.5
"""Hz."""
_UNLIKE_PRIOR = 1.0 / 9.0


class ModeVerdict(NamedTuple):
    """Whether a fitted mode is one."""

    spurious: float
    """Probability that it is none."""
    kind: str
    """Its kind if it is none: "noise", "hum", "a steady line", "part of NNN Hz", "faint", "something broad" or
    `UNLIKE_HITS`; empty where no kind is likely."""
    part_of: int = -1
    """Number of the mode of which it is likeliest a part."""


@dataclass(frozen=True, eq=False)
class JudgedMode:
    """A mode as last fitted, with its verdict; `other_fit` is the fit in which a part of its peak was another mode."""

    mode: Mode
    mobility: ModeMobility
    verdict: ModeVerdict
    other_fit: Mode
    doubt: float = 1.0
    """Probability that the part is no mode."""

    @property
    def pole(self) -> Floats:
        """Frequency and decay rate averaged over both fits: (2,) array, Hz."""
        return self.doubt * self.mode.pole + (1.0 - self.doubt) * self.other_fit.pole

    @property
    def split(self) -> Floats:
        """Standard deviations of frequency and decay rate between both fits: (2,) array, Hz."""
        return np.abs(self.mode.pole - self.other_fit.pole) * np.sqrt(self.doubt * (1.0 - self.doubt))

    @property
    def is_likely(self) -> bool:
        return self.verdict.spurious < 0.5


def judge_modes(spectra: Spectra, modes: Sequence[Mode]) -> list[JudgedMode]:
    """Fitted modes with their mobilities and a verdict on each."""
    mobilities = mode_mobilities(spectra, modes)
    judgements = zip(modes, mobilities, mode_verdicts(spectra, modes, mobilities), strict=True)
    return [JudgedMode(mode, mobility, verdict, mode) for mode, mobility, verdict in judgements]


def mode_verdicts(spectra: Spectra, modes: Sequence[Mode], mobilities: Sequence[ModeMobility]) -> list[ModeVerdict]:
    """A verdict for each mode; the probabilities of different reasons are taken as independent."""
    if not modes:
        return []
    comparison = _ModeComparison(spectra, modes, mobilities)
    return [comparison.verdict(m) for m in range(len(modes))]


def part_words(hertz: float) -> str:
    return f"part of {hertz:.1f} Hz"


class _ModeComparison:
    """All modes, with which each of them is compared for its verdict."""

    def __init__(self, spectra: Spectra, modes: Sequence[Mode], mobilities: Sequence[ModeMobility]) -> None:
        self.modes, self.mobilities = modes, mobilities
        self.n_places, self.n_records = len(spectra.place_pairs), spectra.places.size
        self.has_force = spectra.force is not None
        hertz = np.array([mode.frequency for mode in modes])
        self.strengths = np.array([mobility.strength for mobility in mobilities])
        self.steady = np.array([mode.decay * spectra.duration < STEADY_DECAY for mode in modes])
        self.usual = _usual_strengths(hertz, self.strengths, ~self.steady)
        strong = hertz[~self.steady & (self.strengths > 0.2 * self.usual)]
        self.spacing = float(np.ptp(strong)) / max(strong.size - 1, 1) if strong.size > 1 else 50.0
        weights = np.where(self.steady, 0.0, self.strengths / self.usual)
        self.broad = broad_odds(np.array([mode.damping for mode in modes]), weights)

    def verdict(self, m: int) -> ModeVerdict:
        mode, alike = self.modes[m], self.mobilities[m].alike
        unlike = _unlike_probability(alike, self.n_places, self.n_records - self.n_places)
        lines = self._line_reasons(m, unlike)
        split, part_of = self._part_odds(m)
        unstable = 1.0 if mode.seen == 1.0 else _UNSTABLE_ODDS
        odds = {"something broad": self.broad[m], "faint": self._faint_odds(m) * unstable, "part": split * unstable}
        reasons = {"noise": mode.expected / (1.0 + mode.expected), UNLIKE_HITS: unlike, **lines}
        reasons |= {name: 1.0 - 1.0 / (1.0 + ratio) for name, ratio in odds.items()}
        spurious = min(1.0 - float(np.prod([1.0 - probability for probability in reasons.values()])), 1.0)
        worst = max(lines or reasons, key=lambda name: reasons[name])
        if reasons[worst] < 0.05:
            return ModeVerdict(spurious, "")
        if worst == "part":
            return ModeVerdict(spurious, part_words(self.modes[part_of].frequency), part_of)
        return ModeVerdict(spurious, worst)

    def _line_reasons(self, m: int, unlike: float) -> dict[str, float]:
        """Probability of mains hum, or of another line that does not decay; empty where it is neither."""
        mode = self.modes[m]
        distance = min(abs(mode.frequency - base * round(mode.frequency / base)) for base in _MAINS)
        is_mains = mode.frequency > 40.0 and distance < _NEAR_MAINS and mode.decay < _NEAR_MAINS
        if is_mains and (self.steady[m] or unlike > 0.5):
            return {"hum": 0.97}
        return {"a steady line": 0.9} if self.steady[m] else {}

    def _faint_odds(self, m: int) -> float:
        """Odds that it is a faint spurious line, against a mode."""
        ratio = self.strengths[m] / self.usual[m]
        return float(_log_normal(ratio, FAINT_RATIO, FAINT_FACTOR) / self._strength_density(m) * self._angle_odds(m))

    def _part_odds(self, m: int) -> tuple[float, int]:
        """Odds that it is a part of the peak of a stronger mode, against a mode, and the number of that mode."""
        mode, split, part_of = self.modes[m], 0.0, -1
        for k, other in enumerate(self.modes):
            width = mode.decay + other.decay
            is_stronger = self.strengths[k] > self.strengths[m]
            if abs(mode.frequency - other.frequency) > SPLIT_REACH * width or not is_stronger or self.steady[k]:
                continue
            share = self.strengths[m] / self.strengths[k]
            odds = (
                _log_normal(share, SPLIT_RATIO, SPLIT_FACTOR)
                / self._strength_density(m)
                * self.spacing
                / (2.0 * SPLIT_REACH * width)
            )
            odds *= self._angle_odds(m) * _pattern_odds(self.mobilities[m], self.mobilities[k])
            odds /= 1.0 + self.broad[k]  # a broad background has no parts
            if self.has_force and share > 0.3:
                reach, angle = float(np.degrees(np.arctan(2.0 * share))), self.mobilities[k].complexity
                odds *= (_uniform(reach) if angle <= reach else 0.2 * _uniform(90.0)) / _angle_density(angle)
            if odds > split:
                split, part_of = odds, k
        return float(split), part_of

    def _strength_density(self, m: int) -> float:
        """Density of its strength if it is a mode."""
        ratio = self.strengths[m] / self.usual[m]
        return float(max(ratio * np.exp(-ratio), 1e-12) if ratio < 1.0 else np.exp(-1.0))

    def _angle_odds(self, m: int) -> float:
        """Odds by the angle of its residues: a spurious line has any angle, a mode has real residues."""
        return _uniform(90.0) / _angle_density(self.mobilities[m].complexity) if self.has_force else 1.0


def _usual_strengths(hertz: Floats, strengths: Floats, rings: Bools) -> Floats:
    """Upper strength of the modes that ring down within an octave of each, of all where none does: (n_modes,)."""
    near = (np.abs(np.log2(hertz[:, None] / hertz)) <= 1.0) & rings
    return np.array([np.quantile(strengths[row if row.any() else slice(None)], 0.7) for row in near])


def broad_odds(damping: Floats, strengths: Floats) -> Floats:
    """Odds that modes are a broad background of the others, from their damping ratios: (n_modes,) array.

    Wood damps the modes of one board about alike; a background, as the tails of modes that were not found, is broader.
    Strengths are over the usual ones: stronger modes have more weight in the damping of the board.
    """
    logs, weights = np.log(damping), np.minimum(strengths, 1.0)
    middle = weighted_median(logs, weights)
    deviations = np.minimum(np.abs(logs - middle), 2.0 * np.log(_ALIKE_FACTOR))  # some are no modes
    variance = _ALIKE_MODES * np.log(_ALIKE_FACTOR) ** 2 + np.sum(weights * deviations**2)
    sd = float(np.sqrt(variance / (_ALIKE_MODES + weights.sum())))
    broad = _normal(logs - np.log(_BROAD_DAMPING), np.log(_BROAD_FACTOR))
    return np.asarray(_BROAD_ODDS * broad / np.maximum(_normal(np.maximum(logs - middle, 0.0), sd), 1e-12))


def weighted_median(values: Floats, weights: Floats) -> float:
    """The value with half of the weight below it."""
    return float(np.quantile(values, 0.5, weights=weights + 1e-12, method="inverted_cdf"))


def _unlike_probability(alike: float, n_places: int, n_free: int) -> float:
    """Probability that residues, of which a share `alike` is common to all hits, are alike by chance only."""
    from scipy.special import betaln

    if n_free < 2 or alike >= 1.0:
        return 0.0
    low = max(alike, 1e-9)
    chance_density = np.exp((n_places - 1) * np.log(low) + (n_free - 1) * np.log1p(-low) - betaln(n_places, n_free))
    mode_density = 20.0 * low**19
    odds = _UNLIKE_PRIOR * chance_density / max(mode_density, 1e-300)
    return float(odds / (1.0 + odds)) if np.isfinite(odds) else 1.0


def _log_normal(value: float, median: float, factor: float) -> float:
    """Density of the logarithm above the median; below it, that of the median."""
    return float(_normal(np.maximum(np.log(value / median), 0.0), np.log(factor)))


def _normal(deviation: Floats, sd: float) -> Floats:
    return np.asarray(np.exp(-0.5 * (deviation / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi)))


def _uniform(reach: float) -> float:
    return 1.0 / (2.0 * reach)


def _angle_density(angle: float) -> float:
    """Density of the angle of a mode's residue, per degree."""
    return float(_REAL_SHARE * _normal(np.asarray(angle), _REAL_ANGLE) + (1.0 - _REAL_SHARE) / 180.0)


def _pattern_odds(first: ModeMobility, second: ModeMobility) -> float:
    """Odds, by the likeness of two patterns of residues over places, that both are of one mode against two."""
    n = first.mobility.size
    if n < 2:
        return 1.0
    inner = np.abs(np.sum(first.mobility.conj() * second.mobility)) ** 2
    alike = float(inner / max(np.sum(np.abs(first.mobility) ** 2) * np.sum(np.abs(second.mobility) ** 2), 1e-300))
    alike = float(np.clip(alike, 1e-6, 1.0 - 1e-6))
    from scipy.special import betaln

    one_mode_density = 10.0 * alike**9
    two_modes_density = np.exp(
        -0.5 * np.log(alike) + (0.5 * (n - 1) - 1.0) * np.log1p(-alike) - betaln(0.5, 0.5 * (n - 1))
    )
    return float(one_mode_density / max(two_modes_density, 1e-9))
