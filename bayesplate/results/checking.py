"""The report of `check` as types: what would be fitted, and what the readings can identify."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from bayesplate.results.contract import NOT_IN_JSON, Constants, Elastic


@dataclass(frozen=True)
class CheckedSetup:
    """How the board is held, and how much was read; the noise is the median of its prior, per cent."""

    name: str
    edges: Mapping[str, str]
    labelled: int
    unlabelled: int
    noise_percent: float


@dataclass(frozen=True)
class CheckedMode:
    """A reading over the weighted least-squares estimate, and what it tells."""

    setup: str
    label: str
    measured_hz: float
    residual_cents: float
    leverage: float  # share of the reading in its own prediction
    share_percent: tuple[float, ...]  # share of D_x, D_y, D_s in the mode's energy
    label_correlation: float


@dataclass(frozen=True)
class CheckedEffect:
    """What an effect that is not declared would do at a usual size, SI."""

    effect: str
    size: Mapping[str, float]  # value of each parameter
    raw_rms_cents: float  # shift of the modes in all
    visible_rms_cents: float  # what a fit of the constants leaves of it
    below_detection_limit: bool  # whether that is lost in the noise
    bias_percent: Elastic[float]  # what ignoring the effect does to each modulus
    look_alikes: tuple[str, ...]  # effects that no such readings can tell from it


@dataclass(frozen=True, repr=False)
class CheckReport:
    """What a fit of a card would do.

    Attributes
    ----------
    name, title, prior : str
    law : "linear" or "exact"
    setups : tuple of CheckedSetup
    uncertain_inputs : tuple of str
    estimate : Constants of float
        Weighted least squares: Pa, N m.
    expected_sd_percent : Elastic of float
        From noise, misfit and uncertain inputs.
    condition_number : float
    modes : tuple of CheckedMode
    in_sample_rms_cents : float
        Of their residuals.
    signatures : tuple of CheckedEffect
        Every effect that is not declared and could act.
    invisible : str
        What no frequencies can show.
    identifiability, notes : tuple of str
    n_doubts : int
        How many of the notes, the first ones, put a reading or a constant in doubt.
    """

    name: str
    title: str
    prior: str
    law: str
    setups: tuple[CheckedSetup, ...]
    uncertain_inputs: tuple[str, ...]
    estimate: Constants[float]
    expected_sd_percent: Elastic[float]
    condition_number: float
    modes: tuple[CheckedMode, ...]
    in_sample_rms_cents: float
    signatures: tuple[CheckedEffect, ...]
    invisible: str
    identifiability: tuple[str, ...]
    notes: tuple[str, ...]
    n_doubts: int = field(metadata=NOT_IN_JSON)

    def __repr__(self) -> str:
        told = ", ".join(f"{name} ± {percent:.1f} %" for name, percent in self.expected_sd_percent.items())
        return f"<CheckReport of {self.name}: {len(self.modes)} modes, {told} to expect>"
