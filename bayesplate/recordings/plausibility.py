"""How probable it is that what was fitted is no mode of the board, and why: noise, hum, a split peak, a faint line.

What is not said by the records themselves comes from how modes of boards differ from everything else: their residues
are real, they are alike from hit to hit, they are rarely a hundred times weaker than others nearby, they are damped
about alike, and where the peak of one mode is not simple, a fit gives it a weaker neighbour within its own width that
moves as it does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.recordings.local_fit import STEADY
from bayesplate.recordings.modes_found import Mode
from bayesplate.recordings.spectra import Spectra
from bayesplate.recordings.strength import Answer

Floats = NDArray[np.float64]

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


@dataclass(frozen=True)
class Verdict:
    """Whether a mode is one.

    Attributes
    ----------
    spurious : float
        Probability that it is none.
    kind : str
        What it is otherwise: "noise", "hum", "a steady line", "part of NNN Hz", "faint", "something broad", `UNLIKE`;
        empty where nothing speaks of it.
    part_of : int
        Number of the mode of which it is likeliest a part; -1 if of none.
    """

    spurious: float
    kind: str
    part_of: int = -1

    def at_least(self, spurious: float) -> Verdict:
        """The same where something else makes it as doubtful as that."""
        return replace(self, spurious=max(self.spurious, spurious), kind=self.kind or "faint" * (spurious > 0.5))


def verdicts(spectra: Spectra, modes: Sequence[Mode], answered: Sequence[Answer]) -> list[Verdict]:
    """A verdict for each mode; the probabilities of different reasons are taken as independent."""
    if not modes:
        return []
    strengths = np.array([one.strength for one in answered])
    hertz = np.array([mode.frequency for mode in modes])
    steady = np.array([mode.decay * spectra.duration < STEADY for mode in modes])
    usual = _usual(hertz, strengths, ~steady)
    strong = hertz[~steady & (strengths > 0.2 * usual)]
    spacing = float(np.ptp(strong)) / max(strong.size - 1, 1) if strong.size > 1 else 50.0
    spare = spectra.places.size - len(spectra.between)
    broad = broad_odds(np.array([mode.damping for mode in modes]), np.where(steady, 0.0, strengths / usual))
    found = []
    for m, mode in enumerate(modes):
        reasons = {"noise": mode.expected / (1.0 + mode.expected)}
        reasons[UNLIKE] = _unlike(answered[m].alike, len(spectra.between), spare)
        reasons |= (lines := _of_lines(mode, spectra.duration, reasons[UNLIKE]))
        faint, split, part_of = _odds(
            m, modes, answered, usual, broad, spacing, spectra.duration, has_force=spectra.force is not None
        )
        unstable = 1.0 if mode.seen == 1.0 else _UNSTABLE
        reasons["something broad"] = 1.0 - 1.0 / (1.0 + broad[m])
        reasons["faint"] = 1.0 - 1.0 / (1.0 + faint * unstable)
        reasons["part"] = 1.0 - 1.0 / (1.0 + split * unstable)
        spurious = 1.0 - float(np.prod([1.0 - one for one in reasons.values()]))
        worst = max(lines or reasons, key=lambda name: reasons[name])
        kind = "" if reasons[worst] < 0.05 else worst
        is_part = kind == "part"
        words = part_words(modes[part_of].frequency) if is_part else kind
        found.append(Verdict(min(spurious, 1.0), words, part_of if is_part else -1))
    return found


def part_words(hertz: float) -> str:
    """What a part of the peak of another mode is called."""
    return f"part of {hertz:.1f} Hz"


def _usual(hertz: Floats, strengths: Floats, rings: NDArray[np.bool_]) -> Floats:
    """Strength of the stronger modes that ring down within an octave of each, of all where none does: (n_modes,)."""
    near = (np.abs(np.log2(hertz[:, None] / hertz)) <= 1.0) & rings
    return np.array([np.quantile(strengths[row if row.any() else slice(None)], 0.7) for row in near])


def broad_odds(damping: Floats, strengths: Floats) -> Floats:
    """Odds that modes are something broad on which others stand, from their damping beside the others'.

    Wood damps the modes of one board about alike; what a fit needs besides, as the tail of modes that it did not find,
    is broader.

    Parameters
    ----------
    damping : (n_modes,) array
        Ratios.
    strengths : (n_modes,) array
        Over the usual ones, by which modes tell how a board damps.

    Returns
    -------
    (n_modes,) array
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
    order = np.argsort(values)
    total = np.cumsum(weights[order] + 1e-12)
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])


def _of_lines(mode: Mode, duration: float, unlike: float) -> dict[str, float]:
    """That it is hum of the mains or another line that does not decay."""
    is_steady = mode.decay * duration < STEADY
    off = min(abs(mode.frequency - base * round(mode.frequency / base)) for base in _MAINS)
    is_mains = mode.frequency > 40.0 and off < _NEAR_MAINS and mode.decay < _NEAR_MAINS
    if is_mains and (is_steady or unlike > 0.5):
        return {"hum": 0.97}
    return {"a steady line": 0.9} if is_steady else {}


def _unlike(alike: float, n_places: int, spare: int) -> float:
    """That residues are alike from hit to hit by chance only."""
    from scipy.special import betaln

    if spare < 2 or alike >= 1.0:
        return 0.0
    low = max(alike, 1e-9)
    by_chance = np.exp((n_places - 1) * np.log(low) + (spare - 1) * np.log1p(-low) - betaln(n_places, spare))
    of_mode = 20.0 * low**19
    odds = _UNLIKE_PRIOR * by_chance / max(of_mode, 1e-300)
    return float(odds / (1.0 + odds)) if np.isfinite(odds) else 1.0


def _odds(
    m: int,
    modes: Sequence[Mode],
    answered: Sequence[Answer],
    usual: Floats,
    broad: Floats,
    spacing: float,
    duration: float,
    *,
    has_force: bool,
) -> tuple[float, float, int]:
    """Odds that a mode is a faint line of something else, or a part of a stronger one, against its being a mode."""
    mode, answer = modes[m], answered[m]
    ratio = answer.strength / usual[m]
    of_mode = max(ratio * np.exp(-ratio), 1e-12) if ratio < 1.0 else np.exp(-1.0)
    off_real = _uniform(90.0) / _of_real(complexity(answer)) if has_force else 1.0
    faint = _log_normal(ratio, FAINT, FAINT_FACTOR) / of_mode * off_real
    split, part_of = 0.0, -1
    for k, other in enumerate(modes):
        width = mode.decay + other.decay
        apart = abs(mode.frequency - other.frequency)
        is_weaker = answered[k].strength <= answer.strength
        if k == m or apart > REACH * width or is_weaker or other.decay * duration < STEADY:
            continue
        share = answer.strength / answered[k].strength
        odds = _log_normal(share, SPLIT, SPLIT_FACTOR) / of_mode * spacing / (2.0 * REACH * width)
        odds *= off_real * _pattern(answer, answered[k]) / (1.0 + broad[k])  # the ground has no parts
        if has_force:
            reach = float(np.degrees(np.arctan(2.0 * share)))
            angle = complexity(answered[k])
            odds *= (
                (_uniform(reach) if angle <= reach else 0.2 * _uniform(90.0)) / _of_real(angle) if share > 0.3 else 1.0
            )
        if odds > split:
            split, part_of = odds, k
    return float(faint), float(split), part_of


def _log_normal(value: float, median: float, factor: float) -> float:
    """Density of the logarithm; above the median as far as it is exceeded only."""
    return float(_normal(np.maximum(np.log(value / median), 0.0), np.log(factor)))


def _normal(off: Floats, sd: float) -> Floats:
    return np.asarray(np.exp(-0.5 * (off / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi)))


def complexity(answer: Answer) -> float:
    """By how many degrees the residues of a mode are complex, 0 to 90, the strongest counting most."""
    squares = np.sum(answer.mobility**2)
    power = float(np.sum(np.abs(answer.mobility) ** 2))
    # of residues r_k e^(i a) with one a, the sum of squares is real and positive where a is zero
    return float(np.degrees(0.5 * np.arccos(np.clip(np.real(squares) / max(power, 1e-300), -1.0, 1.0))))


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
