"""Recordings of boards that are hit: modes of the generator's own plate, superposed over time, with noise and hum.

A hit is a half-sine of force. What a damped mode does under it and after it is known in closed form, so that nothing is
stepped through time and no transform is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import ritz
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Place = tuple[float, float]


@dataclass(frozen=True)
class Ringing:
    """Damped modes of a board: undamped frequencies, damping ratios and modal masses (kg), each (n_modes,)."""

    hertz: Floats
    damping: Floats
    masses: Floats
    modes: ritz.Modes

    @property
    def damped(self) -> Floats:
        """Frequencies at which the modes ring down, Hz."""
        return self.hertz * np.sqrt(1.0 - self.damping**2)

    def deflections(self, place: Place) -> Floats:
        """Of each mode at a place, m from the corner x0, y0: (n_modes,) array."""
        x, y = np.array([place[0]]), np.array([place[1]])
        return np.array([self.modes.shape(m)(x, y)[0, 0] for m in range(self.hertz.size)])

    def residues(self, hammer: Place, sensor: Place) -> Floats:
        """Of the mobility between two places, 1/kg: (n_modes,) array."""
        return self.deflections(hammer) * self.deflections(sensor) / self.masses


def ringing(
    plate: ritz.Plate,
    n_modes: int,
    damping: Floats,
    sensor: Place = (0.0, 0.0),
    sensor_mass: float = 0.0,
) -> Ringing:
    """The lowest modes of a plate that carries a sensor (m, kg)."""
    basis = ritz.Ritz(plate)
    along_x, along_y = basis.sides
    there = np.kron(along_x.values(np.array([sensor[0]]))[0], along_y.values(np.array([sensor[1]]))[0])
    mass = basis.mass + sensor_mass * np.outer(there, there)
    modes = ritz.solve(basis, mass=mass)
    shapes = modes.shapes[:n_modes].reshape(n_modes, -1)
    masses = np.einsum("ki,ij,kj->k", shapes, mass, shapes)
    return Ringing(modes.frequencies[:n_modes], damping, masses, modes)


def moved(board: Ringing, mode: int, hertz: float) -> Ringing:
    """The same with one mode at another frequency, so that two come as close as one wants."""
    frequencies = board.hertz.copy()
    frequencies[mode] = hertz
    return Ringing(frequencies, board.damping, board.masses, board.modes)


@dataclass(frozen=True)
class Blow:
    """A half-sine of force: when it begins (s), how long it lasts (s), and its height (N)."""

    at: float
    lasts: float
    height: float


def recorded(
    board: Ringing, hammer: Place, sensor: Place, blows: Sequence[Blow], rate: float, duration: float
) -> tuple[Floats, Floats]:
    """Force (N) and acceleration (m/s^2) at the samples of a recording: two (n_samples,) arrays."""
    times = np.arange(round(duration * rate)) / rate
    force, acceleration = np.zeros_like(times), np.zeros_like(times)
    residues = board.residues(hammer, sensor)
    omega = 2.0 * np.pi * board.damped
    poles = -2.0 * np.pi * board.hertz * board.damping + 1j * omega
    for blow in blows:
        since = times - blow.at
        during = (since >= 0.0) & (since <= blow.lasts)
        here = blow.height * np.sin(np.pi * since[during] / blow.lasts)
        force[during] += here
        acceleration[during] += here * residues.sum()
        k = np.pi / blow.lasts
        after = np.flatnonzero(since > 0.0)
        first = after[0]
        for pole, residue, w in zip(poles, residues, omega, strict=True):
            whole = blow.height * residue / w * pole**2 / (pole**2 + k**2)
            inside = since[during][since[during] > 0.0]
            growing = k * np.exp(pole * inside) - (pole * np.sin(k * inside) + k * np.cos(k * inside))
            acceleration[first : first + inside.size] += np.imag(whole * growing)
            rest = since[first + inside.size :]
            # one complex power after the other: an exponential for each sample of each mode takes ten times as long
            n_block = 256
            inner = np.exp(pole * np.arange(n_block) / rate)
            starts = np.exp(pole * (rest[0] + np.arange(0, rest.size, n_block) / rate))
            ring = whole * k * (1.0 + np.exp(-pole * blow.lasts))
            acceleration[first + inside.size :] += np.imag(ring * np.outer(starts, inner).ravel()[: rest.size])
    return force, acceleration


def with_noise(
    rng: np.random.Generator, signal: Floats, decibels: float, rate: float, hum: float = 0.0, mains: float = 50.0
) -> Floats:
    """A signal with white noise so many dB below its root mean square, and hum of a share of that, with a harmonic."""
    level = float(np.sqrt(np.mean(signal**2)))
    times = np.arange(signal.size) / rate
    noisy = signal + level * 10.0 ** (-decibels / 20.0) * rng.standard_normal(signal.size)
    if hum:
        for harmonic, share in ((1, 1.0), (3, 0.5)):
            phase = rng.uniform(0.0, 2.0 * np.pi)
            noisy += np.sqrt(2.0) * level * hum * share * np.sin(2.0 * np.pi * harmonic * mains * times + phase)
    return noisy
