"""How strongly each mode answers a force between two places, with which sign, and alike from hit to hit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Complex, Floats
from bayesplate.recordings.local_fit import STEADY
from bayesplate.recordings.modes_found import Mode
from bayesplate.recordings.signals import Motion
from bayesplate.recordings.spectra import Spectra

_TURN: dict[Motion, tuple[complex, int]] = {
    "acceleration": (-1j, -1),
    "velocity": (1.0, 0),
    "displacement": (1j, 1),
    "pressure": (-1j, -1),
}
"""By what to multiply a residue to get that of the mobility: a factor and a power of the frequency. The pressure near a
board goes with its acceleration."""
_LATEST = 0.004
"""s by which taps without a force may have been noticed late."""
_N_DELAYS = 241
_SIGNED, _MOST_COMPLEX = 3.0, 60.0
"""Standard deviations of a residue, and degrees by which it may be complex, that still has a sign."""


@dataclass(frozen=True, eq=False)
class Answer:
    """How a mode answers."""

    # (n_places,): residue between each pair of places, in the units of the recordings; real for a simple mode, known
    # but for a factor for each place without a force
    mobility: Complex
    sd: Floats
    # share of the residues' power that is the same for every hit between the same places; 1 where there is one each
    alike: float

    @property
    def strength(self) -> float:
        """Root mean square over the places."""
        return float(np.sqrt(np.mean(np.abs(self.mobility) ** 2)))

    @property
    def complexity(self) -> float:
        """Angle of the residues from real ones, 0 to 90 degrees, the strongest counting most."""
        squares, power = np.sum(self.mobility**2), float(np.sum(np.abs(self.mobility) ** 2))
        # of residues r_k e^(i a) with one a, the sum of squares is real and positive where a is zero
        return float(np.degrees(0.5 * np.arccos(np.clip(np.real(squares) / max(power, 1e-300), -1.0, 1.0))))

    def sign(self, flips: bool | None) -> str:
        """Sign of the residue between two places, "+" or "-"; empty where it, or the polarity, is not known.

        `flips` is whether force and response have opposite polarity.
        """
        is_known = self.mobility.size == 1 and abs(np.real(self.mobility[0])) >= _SIGNED * self.sd[0]
        if flips is None or not is_known or self.complexity > _MOST_COMPLEX:
            return ""
        return "+" if (np.real(self.mobility[0]) > 0.0) != flips else "-"


def answers(spectra: Spectra, modes: Sequence[Mode]) -> list[Answer]:
    """How each mode answers; hits without a force are first set to one time."""
    forces = _forces(spectra, modes)
    return [_answer(spectra, mode, force) for mode, force in zip(modes, forces, strict=True)]


def _answer(spectra: Spectra, mode: Mode, force: Complex) -> Answer:
    factor, power = _TURN[spectra.motion]
    turned = factor * mode.frequency**power * mode.residues
    n_places = len(spectra.between)
    mobility, sd = np.zeros(n_places, dtype=complex), np.zeros(n_places)
    common = total = 0.0
    spare = 0
    for place in range(n_places):
        own = spectra.places == place
        weight = max(float(np.sum(np.abs(force[own]) ** 2)), 1e-300)
        mobility[place] = np.sum(force[own].conj() * turned[own]) / weight
        sd[place] = mode.frequency**power * float(np.sqrt(np.mean(mode.residue_sd[own] ** 2) / weight))
        if own.sum() > 1:
            common += float(np.abs(mobility[place]) ** 2 * weight)
            total += float(np.sum(np.abs(turned[own]) ** 2))
            spare += int(own.sum()) - 1
    return Answer(mobility, sd, common / total if spare and total > 0.0 else 1.0)


def _forces(spectra: Spectra, modes: Sequence[Mode]) -> list[Complex]:
    """What each hit was at each mode's frequency: (n_records,) complex arrays."""
    if not modes:
        return []
    if spectra.force is not None:
        nearest = [int(np.argmin(np.abs(spectra.frequency - mode.frequency))) for mode in modes]
        return [spectra.force[line] for line in nearest]
    delays, gains = np.zeros(spectra.places.size), np.ones(spectra.places.size)
    ringing = [mode for mode in modes if mode.decay * spectra.duration >= STEADY] or modes  # tones keep their own time
    rung = np.array([mode.frequency for mode in ringing])
    residues = np.array([mode.residues for mode in ringing]).reshape(len(ringing), -1)
    for place in range(len(spectra.between)):
        own = np.flatnonzero(spectra.places == place)
        if own.size > 1:
            delays[own], gains[own] = _delays(rung, residues[:, own])
    return [gains * np.exp(-2j * np.pi * mode.frequency * delays) for mode in modes]


def _delays(hertz: Floats, residues: Complex) -> tuple[Floats, Floats]:
    """Delay (s) and strength of each hit against the strongest one, from all modes together."""
    loud = residues / np.maximum(np.abs(residues).max(axis=1, keepdims=True), 1e-300)
    first = int(np.argmax(np.sum(np.abs(loud) ** 2, axis=0)))
    tried = np.linspace(-_LATEST, _LATEST, _N_DELAYS)
    turns = np.exp(2j * np.pi * np.outer(tried, hertz))
    alike = np.real(turns @ (loud * loud[:, [first]].conj()))
    delays = tried[np.argmax(alike, axis=0)]
    strengths = np.sqrt(np.mean(np.abs(loud) ** 2, axis=0))
    return delays, strengths
