"""The report of `check` as types: the model to be fitted, and what the readings can identify."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from bayesplate.results.contract import NOT_IN_JSON, Constants, Elastic


@dataclass(frozen=True)
class CheckedSetup:
    """The edges of a setup and its number of readings; the noise is the median of its prior, per cent."""

    name: str
    edges: Mapping[str, str]
    labelled: int
    unlabelled: int
    noise_percent: float


@dataclass(frozen=True)
class CheckedMode:
    """A reading over the weighted least-squares prediction, its leverage, and its energy shares."""

    setup: str
    label: str
    measured_hz: float
    residual_cents: float
    leverage: float  # share of the reading in its own prediction
    share_percent: tuple[float, ...]  # share of D_x, D_y, D_s in the mode's energy
    label_correlation: float


@dataclass(frozen=True)
class CheckedEffect:
    """The signature of an undeclared effect at a usual size, SI."""

    effect: str
    size: Mapping[str, float]  # value of each parameter
    raw_rms_cents: float  # shift of the modes
    visible_rms_cents: float  # shift left after the constants are fitted again
    below_detection_limit: bool  # whether the visible shift is lost in the noise
    bias_percent: Elastic[float]  # bias of each modulus if the effect is ignored
    look_alikes: tuple[str, ...]  # effects that these readings cannot tell from it


@dataclass(frozen=True, repr=False)
class CheckReport:
    """What a fit of a card can identify.

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
        Rms of the residuals of the modes.
    signatures : tuple of CheckedEffect
        Effects that are not declared and could act.
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
        uncertainties = ", ".join(f"{name} ± {percent:.1f} %" for name, percent in self.expected_sd_percent.items())
        return f"<CheckReport of {self.name}: {len(self.modes)} modes, {uncertainties} to expect>"
