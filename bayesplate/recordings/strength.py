"""The mobility of each mode between two places: its strength, its sign, and its likeness from hit to hit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Complex, Floats
from bayesplate.recordings.local_fit import STEADY_DECAY
from bayesplate.recordings.modes_found import Mode
from bayesplate.recordings.signals import Motion
from bayesplate.recordings.spectra import Spectra

_MOBILITY_FACTORS: dict[Motion, tuple[complex, int]] = {
    "acceleration": (-1j, -1),
    "velocity": (1.0, 0),
    "displacement": (1j, 1),
    "pressure": (-1j, -1),
}
"""Factor and power of the frequency by which a residue becomes that of the mobility. The pressure near a board is
proportional to its acceleration."""
_LONGEST_DELAY = 0.004
"""Longest delay in s between the detected onsets of taps without a force."""
_N_DELAYS = 241
_SIGN_SDS, _SIGN_ANGLE = 3.0, 60.0
"""Least standard deviations of a residue that has a sign, and degrees by which it may be complex."""


@dataclass(frozen=True, eq=False)
class ModeMobility:
    """Residues of the mobility of a mode between pairs of places."""

    # (n_places,): residue between each pair of places, in the units of the recordings; real for a simple mode, known
    # up to a factor for each place without a force
    mobility: Complex
    sd: Floats
    # share of the residues' power that is common to all hits between the same places; 1 with one hit each
    alike: float

    @property
    def strength(self) -> float:
        """Root mean square over the places."""
        return float(np.sqrt(np.mean(np.abs(self.mobility) ** 2)))

    @property
    def complexity(self) -> float:
        """Angle of the residues from real ones, 0 to 90 degrees, weighted by their power."""
        squares, power = np.sum(self.mobility**2), float(np.sum(np.abs(self.mobility) ** 2))
        # of residues r_k e^(i a) with one a, the sum of squares is real and positive where a is zero
        return float(np.degrees(0.5 * np.arccos(np.clip(np.real(squares) / max(power, 1e-300), -1.0, 1.0))))

    def sign(self, flips: bool | None) -> str:
        """Sign of the residue between two places, "+" or "-"; empty where it, or the polarity, is not known.

        `flips` is whether force and response have opposite polarity.
        """
        is_known = self.mobility.size == 1 and abs(np.real(self.mobility[0])) >= _SIGN_SDS * self.sd[0]
        if flips is None or not is_known or self.complexity > _SIGN_ANGLE:
            return ""
        return "+" if (np.real(self.mobility[0]) > 0.0) != flips else "-"


def mode_mobilities(spectra: Spectra, modes: Sequence[Mode]) -> list[ModeMobility]:
    """The mobility of each mode; hits without a force are first aligned in time."""
    forces = _forces_at_modes(spectra, modes)
    return [_mode_mobility(spectra, mode, force) for mode, force in zip(modes, forces, strict=True)]


def _mode_mobility(spectra: Spectra, mode: Mode, force: Complex) -> ModeMobility:
    factor, power = _MOBILITY_FACTORS[spectra.motion]
    recorded = _recorded_share(spectra, mode)
    turned = factor * mode.frequency**power * mode.residues / recorded
    n_places = len(spectra.place_pairs)
    mobility, sd = np.zeros(n_places, dtype=complex), np.zeros(n_places)
    common = total = 0.0
    n_free = 0
    for place in range(n_places):
        same_places = spectra.places == place
        weight = max(float(np.sum(np.abs(force[same_places]) ** 2)), 1e-300)
        mobility[place] = np.sum(force[same_places].conj() * turned[same_places]) / weight
        sd[place] = (
            mode.frequency**power / abs(recorded) * float(np.sqrt(np.mean(mode.residue_sd[same_places] ** 2) / weight))
        )
        if same_places.sum() > 1:
            common += float(np.abs(mobility[place]) ** 2 * weight)
            total += float(np.sum(np.abs(turned[same_places]) ** 2))
            n_free += int(same_places.sum()) - 1
    return ModeMobility(mobility, sd, common / total if n_free and total > 0.0 else 1.0)


def _recorded_share(spectra: Spectra, mode: Mode) -> complex:
    """Share of a mode's residue in the spectrum of a decay that is cut off, 1 - exp(pole times duration).

    One in the spectra of frequency responses, and for a steady tone, which is no decay.
    """
    if not spectra.hits.all() or mode.decay * spectra.duration < STEADY_DECAY:
        return 1.0 + 0.0j
    return complex(1.0 - np.exp(2.0 * np.pi * spectra.duration * (1j * mode.frequency - mode.decay)))


def _forces_at_modes(spectra: Spectra, modes: Sequence[Mode]) -> list[Complex]:
    """Force of each hit at each mode's frequency, relative where it was not recorded: (n_records,) complex arrays."""
    if not modes:
        return []
    if spectra.force is not None:
        nearest = [int(np.argmin(np.abs(spectra.frequency - mode.frequency))) for mode in modes]
        return [spectra.force[line] for line in nearest]
    delays, gains = np.zeros(spectra.places.size), np.ones(spectra.places.size)
    ringing = [
        mode for mode in modes if mode.decay * spectra.duration >= STEADY_DECAY
    ] or modes  # steady tones do not start with the hit
    hertz = np.array([mode.frequency for mode in ringing])
    residues = np.array([mode.residues for mode in ringing]).reshape(len(ringing), -1)
    for place in range(len(spectra.place_pairs)):
        same_places = np.flatnonzero(spectra.places == place)
        if same_places.size > 1:
            delays[same_places], gains[same_places] = _hit_delays(hertz, residues[:, same_places])
    return [gains * np.exp(-2j * np.pi * mode.frequency * delays) for mode in modes]


def _hit_delays(hertz: Floats, residues: Complex) -> tuple[Floats, Floats]:
    """Delay (s) of each hit against the strongest one, from all modes together, and its strength."""
    scaled = residues / np.maximum(np.abs(residues).max(axis=1, keepdims=True), 1e-300)
    first = int(np.argmax(np.sum(np.abs(scaled) ** 2, axis=0)))
    trial_delays = np.linspace(-_LONGEST_DELAY, _LONGEST_DELAY, _N_DELAYS)
    turns = np.exp(2j * np.pi * np.outer(trial_delays, hertz))
    likeness = np.real(turns @ (scaled * scaled[:, [first]].conj()))
    delays = trial_delays[np.argmax(likeness, axis=0)]
    strengths = np.sqrt(np.mean(np.abs(scaled) ** 2, axis=0))
    return delays, strengths
